/** What is to be simulated: the point, liner, casing, and the two questions that can be asked of them. */

import { fill, h } from "../dom.js";
import { number } from "../format.js";
import { CasingFields } from "./casing_fields.js";
import { Field } from "../field.js";

/** Long enough that growth shows from the first touch on; a few seconds' work at most. */
const RESPONSE_REVOLUTIONS = 150;
const WEAR_REVOLUTIONS = 50;
const WEAR_SPEEDS = 60;
const LONGEST_NAME = 200;

export class QuestionForm {
  /** @param {App} app  @param {(body: Object) => void} submit called with what POST /v1/simulations takes */
  constructor(app, submit) {
    this.app = app;
    this.submit = submit;
    this.design = null;
    const moved = () => this.tellPoint();
    this.speed = new Field({ label: "Rotor speed", min: 0, change: moved, hint: "At which the blade turns." });
    this.ke = new Field({ label: "Kₑ of the liner", unit: "N/m", min: 0, change: moved, hint: "How stiffly it is cut under each contact node." });
    this.friction = new Field({ label: "Friction coefficient", min: 0, empty: "none", hint: "Of tip on liner; needs tangential mode shapes. Empty: none." });
    this.rotation = h(
      "select", { "aria-label": "The blade turns" },
      h("option", { value: "1" }, "turns towards positive tangential"), h("option", { value: "-1" }, "turns towards negative tangential"),
    );
    this.thickness = new Field({ label: "Thickness of the liner", unit: "mm", factor: 1e3, min: 0, hint: "Worn through beyond it." });
    this.cells = new Field({ label: "Cells round the casing", whole: true, min: 4, hint: "How finely the liner is divided." });
    this.steps = new Field({ label: "Time steps in a cell", whole: true, min: 1, empty: "least", hint: "Empty: as few as the modes allow." });
    this.revolutions = new Field({ label: "Revolutions", whole: true, min: 1, hint: "150 show growth from the first touch on." });
    this.low = new Field({ label: "From", min: 0, hint: "Slowest speed." });
    this.high = new Field({ label: "to", min: 0, hint: "Fastest speed." });
    this.count = new Field({ label: "Speeds", whole: true, min: 2, hint: "Evenly between them." });
    this.wearRevolutions = new Field({ label: "Revolutions at each", whole: true, min: 1, hint: "50 show where wear begins." });
    this.casings = { response: new CasingFields("even"), wear: new CasingFields("oval") };
    this.thickness.value = 5e-3;
    this.cells.value = 8000;
    this.revolutions.value = RESPONSE_REVOLUTIONS;
    this.wearRevolutions.value = WEAR_REVOLUTIONS;
    this.count.value = WEAR_SPEEDS;
    this.blade = h("p", {});
    this.caution = h("p", { class: "note" });
    this.permission = h("p", { class: "warning", hidden: true });
    this.fault = h("p", { class: "problem", role: "alert", hidden: true });
    this.buttons = {
      response: h("button", { type: "submit", class: "primary" }, "Response at this speed"),
      wear: h("button", { type: "submit", class: "primary" }, "Wear map round this speed"),
    };
    this.element = this.build();
    this.refresh();
  }

  build() {
    const form = (kind, legend, ...children) => {
      const made = h("form", { noValidate: true }, h("fieldset", {}, h("legend", {}, legend), ...children, this.buttons[kind]));
      made.addEventListener("submit", (event) => {
        event.preventDefault();
        this.ask(kind);
      });
      return made;
    };
    const fields = (...list) => h("div", { class: "fields" }, list.map((field) => field.element));
    const common = h(
      "fieldset", {}, h("legend", {}, "Blade and liner"), this.blade, this.caution, fields(this.speed, this.ke),
      h(
        "details", {}, h("summary", {}, "Friction, thickness, steps"),
        fields(this.friction), h("p", {}, "With friction, the blade ", this.rotation), fields(this.thickness, this.cells, this.steps),
      ),
    );
    return h(
      "div", { class: "question no-print" }, common,
      form("response", "At this speed", fields(this.revolutions), this.casings.response.element),
      form("wear", "Over a range of speeds", fields(this.low, this.high, this.count, this.wearRevolutions), this.casings.wear.element),
      h("div", { class: "whole" }, this.permission, this.fault),
    );
  }

  /** Take over what the page has changed; what was typed for the same design stays. */
  refresh() {
    const { active, point, range, unit } = this.app;
    const speeds = [this.speed, this.low, this.high];
    if (active !== this.design) for (const field of [...speeds, this.ke]) field.touched = false;
    this.design = active;
    for (const field of speeds) field.show(unit.factor, unit.symbol);
    if (point) {
      if (this.speed.value !== point.speed_hz) this.speed.value = point.speed_hz;
      if (this.ke.value !== point.ke) this.ke.value = point.ke;
    } else {
      if (!this.speed.touched) this.speed.value = (range.low_hz + range.high_hz) / 2;
      if (!this.ke.touched) this.ke.value = range.ke_liner;
    }
    if (!this.low.touched) this.low.value = range.low_hz;
    if (!this.high.touched) this.high.value = range.high_hz;
    this.describe();
    this.permit();
  }

  /** Simulate at another point. */
  setPoint(speedHz) {
    this.speed.value = speedHz;
    this.tellPoint();
    this.buttons.response.focus();
  }

  tellPoint() {
    const [speed_hz, ke] = [this.speed.value, this.ke.value];
    if (!(speed_hz > 0 && ke > 0)) return;
    this.app.point = { speed_hz, ke };
    this.app.changed("point");
  }

  get nodes() {
    return this.design.nodes.filter((node) => this.design.weights[node] > 0);
  }

  describe() {
    if (!this.design) return;
    fill(this.blade, h("strong", {}, this.design.label), `, contact at ${this.nodes.join(", ") || "no node"}`,
      this.design.changeName && ` (${this.design.changeName})`);
    const told = [];
    if (this.nodes.some((node) => this.design.weights[node] !== 1)) {
      told.push("Weights count as 1 here: each contact node meets the liner with the whole Kₑ.");
    }
    if (this.design.arcs) told.push("Arcs are not simulated: an oval casing decides where the tip touches.");
    fill(this.caution, told.join(" "));
  }

  permit() {
    const may = this.app.may("submit");
    for (const button of Object.values(this.buttons)) button.disabled = !may;
    this.permission.hidden = may;
    this.permission.textContent = may ? "" : `The key in use has the role “${this.app.caller.role}”: it may look at simulations, not ask for `
      + "one. Give a key of role “submit”, which your administrator makes.";
  }

  ask(kind) {
    this.acceptAll();
    if (kind === "wear" && !(this.count.value >= 2)) {
      this.count.refuse("Give 2 speeds or more, for a map.");
      return;
    }
    if (!this.nodes.length) {
      this.refuseWhole("No node touches: choose contact nodes in the explorer, at the drawn blade tip.");
      return;
    }
    this.kind = kind;
    this.submit(this.body(kind));
  }

  /** What POST /v1/simulations takes. */
  body(kind) {
    const casing = this.casings[kind];
    const unit = this.app.unit;
    const speeds = kind === "response" ? [this.speed.value] : evenly(this.low.value, this.high.value, this.count.value);
    const where = kind === "response" ? `at ${unit.write(speeds[0])}` : `${speeds.length} speeds, ${unit.write(speeds[0])} to ${unit.write(speeds.at(-1))}`;
    const name = [this.design.label, this.nodes.join(" + "), where, `${number(this.ke.value)} N/m`, casing.words].join(" · ");
    const friction = this.friction.value;
    return {
      name: name.slice(0, LONGEST_NAME),
      blade: this.design.blade,
      speed_hz: speeds,
      nodes: this.nodes,
      revolutions: (kind === "response" ? this.revolutions : this.wearRevolutions).value,
      liner: { ke: this.ke.value, thickness_m: this.thickness.value },
      casing: casing.value,
      friction: friction === null ? null : { coefficient: friction, rotation: Number(this.rotation.value) },
      cells: this.cells.value,
      steps_per_cell: this.steps.value,
    };
  }

  get allFields() {
    const shared = [this.speed, this.ke, this.friction, this.thickness, this.cells, this.steps];
    const own = [this.revolutions, this.wearRevolutions, this.low, this.high, this.count];
    return [...shared, ...own, ...Object.values(this.casings).flatMap((casing) => Object.values(casing.fields))];
  }

  acceptAll() {
    for (const field of this.allFields) field.accept();
    this.fault.hidden = true;
  }

  /** Show a problem of the service where it can be mended. */
  refuse(problem) {
    const text = [h("strong", {}, problem.title), `: ${problem.field ? `${problem.field} = ${problem.value}: ${problem.remedy}` : problem.message}`];
    const field = this.fieldOf(problem.field);
    if (field) field.refuse(...text);
    else this.refuseWhole(...text);
  }

  refuseWhole(...text) {
    this.fault.hidden = false;
    fill(this.fault, ...text);
    this.fault.scrollIntoView({ block: "nearest" });
  }

  fieldOf(name) {
    const wear = this.kind === "wear";
    if (name.startsWith("speed_hz")) return this.speedField(name, wear);
    if (name.startsWith("friction")) return this.friction;
    if (name.startsWith("casing.")) return this.casings[this.kind].fields[name.slice("casing.".length).replace(/\[.*/, "")];
    return {
      revolutions: wear ? this.wearRevolutions : this.revolutions, "liner.ke": this.ke, "liner.thickness_m": this.thickness,
      cells: this.cells, steps_per_cell: this.steps,
    }[name];
  }

  speedField(name, wear) {
    if (!wear) return this.speed;
    const at = /\[(\d+)\]/.exec(name);
    if (!at) return this.count;
    return Number(at[1]) === 0 ? this.low : this.high;
  }
}

const evenly = (low, high, count) =>
  Array.from({ length: Math.min(Math.max(count, 1), 100_000) }, (_, i) => low + ((high - low) * i) / (count - 1));
