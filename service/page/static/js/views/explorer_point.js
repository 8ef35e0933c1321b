/** A point of the map, under the pointer or chosen: verdict, growth, chatter frequency, wear lobes, source, error. */

import { verdictName } from "../charts/map_chart.js";
import { fill, h, say, settled } from "../dom.js";
import { number, percent, stiffness } from "../format.js";
import { Problem, Unreachable, ask } from "../service.js";

const REASONS = {
  confident: "the surrogate is sure of it", near_boundary: "near the boundary, so verified", out_of_domain: "outside the training domain, so verified",
  requested: "asked for",
};
/** The pointer at rest for so long asks the exact core, ms. */
const REST = 70;

export class PointReading {
  /** @param {import("../app.js").App} app  @param {{clear: () => void, modesAt: (speed_hz: number) => number[]|null}} does */
  constructor(app, { clear, modesAt }) {
    this.app = app;
    this.clear = clear;
    this.modesAt = modesAt;
    this.place = h("h3", {}, "Point of the map");
    this.table = h("dl", { class: "reading" });
    this.hint = h("p", { class: "note" });
    this.actions = h("div", { class: "actions" });
    this.element = h("section", { class: "point", "aria-label": "Point of the map" }, this.place, this.hint, this.table, this.actions);
    this.exact = settled(REST, (place) => this.#askExact(place));
    this.#hint();
  }

  #hint() {
    fill(this.place, "Point of the map");
    fill(this.hint, "Move over the map for verdict, growth and chatter frequency; click to choose a point.");
    this.hint.className = "note";
    fill(this.table);
    fill(this.actions);
  }

  /** @param {{speed_hz: number, ke: number, byKey?: boolean}} place  @param {Object|null} read from the map itself */
  hover(place, read) {
    this.#write(place, read, null);
    this.exact(place);
  }

  leave() {
    this.exact.cancel();
    this.asking?.abort();
    this.show(this.app.point);
  }

  /** The chosen point; null for none. */
  show(point) {
    if (!point) return this.#hint();
    this.#write(point, null, null);
    return this.#askExact(point);
  }

  async #askExact(place) {
    this.asking?.abort();
    this.asking = new AbortController();
    const { blade, contact } = this.app.active;
    try {
      const found = await ask("v1/stability", { blade, contact, speed_hz: [place.speed_hz], ke: [place.ke], policy: "exact" }, { signal: this.asking.signal });
      const first = Object.fromEntries(Object.entries(found).filter(([, value]) => Array.isArray(value)).map(([name, value]) => [name, value[0]]));
      this.#write(place, null, first);
      if (place.byKey) say(this.spoken);
    } catch (error) {
      if (error.name === "AbortError" || error instanceof Unreachable) return;
      if (!(error instanceof Problem)) throw error;
      fill(this.table);
      fill(this.hint, `${error.field} = ${error.value}: ${error.remedy}`);
      this.hint.className = "problem";
    }
  }

  #write(place, read, exact) {
    const { unit, point } = this.app;
    const chosen = point && point.speed_hz === place.speed_hz && point.ke === place.ke;
    fill(this.place, `${unit.write(place.speed_hz)}, Kₑ = ${stiffness(place.ke)}`, chosen ? h("span", { class: "badge" }, "chosen") : null);
    fill(this.hint);
    const rows = [];
    const row = (name, value) => rows.push(h("dt", {}, name), h("dd", {}, value));
    // Lines stay where they are while the pointer moves: what is not yet known is a dash.
    const verdict = exact ? (exact.stable === null ? "undecided" : exact.stable ? "stable" : "unstable") : read ? verdictName(read.stable) : "…";
    row("Verdict", h("span", { class: `badge ${verdict === "stable" ? "fine" : verdict === "unstable" ? "bad" : ""}` }, verdict === "stable" ? "✓ stable" : verdict === "unstable" ? "✕ unstable" : verdict));
    row("Growth a revolution", exact ? growth(exact.growth_per_revolution) : "–");
    row("Chatter frequency", exact && exact.chatter_hz ? `${number(exact.chatter_hz)} Hz${this.#mode(exact.chatter_hz, place.speed_hz)}` : "–");
    row("Wear lobes round the casing", exact ? number(exact.wear_lobes) : "–");
    row("Source", exact ? "exact core" : read ? `${read.source === "exact" ? "exact core" : "surrogate"}: ${REASONS[read.reason] ?? read.reason}` : "–");
    row(exact ? "Error of |μ|" : "Probability unstable", exact ? number(exact.error_estimate, 2) : read && !Number.isNaN(read.probability) ? percent(read.probability) : "–");
    fill(this.table, rows);
    this.spoken = `${unit.write(place.speed_hz)}, ${stiffness(place.ke)}: ${verdict}${exact?.chatter_hz ? `, chatter at ${number(exact.chatter_hz)} hertz` : ""}`;
    fill(this.actions, chosen ? [
      h("button", { type: "button", class: "primary", onclick: () => this.app.go("time") }, "Simulate the rub here"),
      h("button", { type: "button", onclick: this.clear }, "Clear"),
    ] : null);
  }

  #mode(chatter, speed) {
    const frequencies = this.modesAt(speed);
    if (!frequencies) return "";
    const nearest = frequencies.reduce((best, f, j) => (Math.abs(Math.log(f / chatter)) < Math.abs(Math.log(frequencies[best] / chatter)) ? j : best), 0);
    return ` (mode ${nearest + 1})`;
  }
}

/** Of the vibration's amplitude in a revolution. */
function growth(perRevolution) {
  if (perRevolution === null) return "–";
  const share = Math.expm1(perRevolution);
  return `${share >= 0 ? "+" : "−"}${percent(Math.abs(share), 3)}`;
}
