/** What the views share: the designs, the range looked at, the units, who asks. */

import { Design } from "./design/design.js";
import { SpeedUnit } from "./format.js";
import { ask } from "./service.js";

export class App extends EventTarget {
  /** @type {Design[]} every design kept; the explorer changes `active` */
  designs = [];
  active = null;
  /** Rotor speeds [Hz], largest K_e and the liner's [N/m]. */
  range = { low_hz: 60, high_hz: 300, ke_max: 25000, ke_liner: 15000 };
  unitName = "rpm";
  examples = { blades: {}, profiles: {} };
  caller = { name: "", role: "read", key_id: null };
  /** A point of the map that was chosen: {speed_hz, ke}; null for none. */
  point = null;
  /** Id of the simulation that is looked at; null for none. */
  simulation = null;
  /** Identifier of the screening that is open; null for none. */
  job = null;

  get unit() {
    return new SpeedUnit(this.unitName, this.active?.firstHz ?? 1);
  }

  /** @param {"design"|"designs"|"range"|"unit"|"theme"|"point"|"caller"|"moved"|"model"} what */
  changed(what) {
    this.dispatchEvent(new CustomEvent("change", { detail: what }));
  }

  onChange(run) {
    this.addEventListener("change", (event) => run(event.detail));
  }

  async loadExamples() {
    this.examples = await ask("v1/examples");
    this.caller = await ask("v1/caller");
    this.changed("caller");
  }

  /** Whether the key that is in use may do what `role` may. */
  may(role) {
    const roles = ["read", "submit", "admin"];
    return roles.indexOf(this.caller.role) >= roles.indexOf(role);
  }

  /** Make a design the one that the explorer shows, with the range that suits it. */
  show(design, { range = true } = {}) {
    this.active = design;
    if (!this.designs.includes(design)) this.designs.push(design);
    if (range) [this.range.low_hz, this.range.high_hz] = design.usualRange();
    this.point = null;
    this.changed("designs");
  }

  /** Put another blade in the place of the active design. */
  replace(design) {
    this.designs = this.designs.map((kept) => (kept === this.active ? design : kept));
    this.show(design);
  }

  /** The designs without those that are as another is, which a copy is until it is changed. */
  get distinct() {
    return [...new Map(this.designs.map((design) => [design.sameness, design]).reverse()).values()].reverse();
  }

  /** Keep the active design as it is, and go on with a copy of it. @returns {boolean} false where it was kept already */
  keep() {
    const { active } = this;
    if (this.designs.some((other) => other !== active && other.sameness === active.sameness)) return false;
    this.#goOnWith(active);
    this.changed("designs");
    return true;
  }

  /** Go on with a copy of a kept design: what is changed of it leaves the kept one as it was. */
  open(design) {
    if (design !== this.active) {
      this.#drop();
      this.#goOnWith(design);
      [this.range.low_hz, this.range.high_hz] = design.usualRange();
      this.point = null;
    }
    this.changed("designs");
  }

  #goOnWith(design) {
    const twin = design.copy();
    this.designs.push(twin);
    this.active = twin;
  }

  /** The active design, where another is the same. */
  #drop() {
    const { active } = this;
    const twice = this.designs.some((other) => other !== active && other.sameness === active.sameness);
    if (twice) this.designs = this.designs.filter((kept) => kept !== active);
  }

  remove(design) {
    if (this.designs.length < 2) return;
    const rest = this.designs.filter((kept) => kept.sameness !== design.sameness);
    if (!rest.length) return;
    this.designs = rest;
    if (!rest.includes(this.active)) this.show(rest[0]);
    else this.changed("designs");
  }

  /** All that a link needs to show the same again. */
  toState(viewName) {
    const bases = [];
    const profiles = [];
    const place = (list, item) => {
      if (item === null) return null;
      const text = JSON.stringify(item);
      const at = list.findIndex((other) => JSON.stringify(other) === text);
      return at >= 0 ? at : list.push(item) - 1;
    };
    const named = (base) => Object.keys(this.examples.blades).find((name) => this.examples.blades[name] === base);
    const designs = this.designs.map((design) => ({
      ...design.toState(),
      example: named(design.base) ?? null,
      base: named(design.base) ? null : place(bases, design.base),
      shaped: place(bases, design.shapedBase),
      profile: place(profiles, design.profile),
    }));
    return {
      version: 1, view: viewName, designs, active: this.designs.indexOf(this.active), bases, profiles,
      range: this.range, unit: this.unitName, point: this.point, simulation: this.simulation, job: this.job,
    };
  }

  /** @returns {string} the view that the state was taken in */
  fromState(state) {
    this.designs = state.designs.map(({ example, base, shaped, profile, ...rest }) => {
      const loaded = example ? this.examples.blades[example] : state.bases[base];
      const design = new Design(loaded, { profile: profile === null ? null : state.profiles[profile] });
      design.shapedBase = shaped === null ? null : state.bases[shaped];
      return design.take(rest);
    });
    this.active = this.designs[state.active] ?? this.designs[0];
    Object.assign(this.range, state.range);
    this.unitName = state.unit;
    this.point = state.point;
    this.simulation = state.simulation ?? null;
    this.job = state.job ?? null;
    return state.view;
  }
}
