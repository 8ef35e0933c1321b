/** What to change of a design, and by how much, for its deepest lobe to clear the liner with a margin. */

import { fill, fresh, h } from "../dom.js";
import { number, percent, stiffness } from "../format.js";
import { Problem, Unreachable, ask } from "../service.js";

const SHOWN = 10;
/** Beyond this a slope says little about what a change would do, and below it the parameter hardly matters. */
const [LARGEST_CHANGE, LEAST_INFLUENCE] = [0.3, 0.01];

export class Influences {
  /** @param {import("../app.js").App} app  @param {import("../charts/comparison_charts.js").InfluencesChart} chart */
  constructor(app, chart) {
    this.app = app;
    this.chart = chart;
    this.which = h("select", { id: fresh("influence"), onchange: () => this.#ask() });
    this.margin = h("input", { type: "number", id: fresh("influence"), min: 0, max: 900, step: 5, value: 20, class: "short", onchange: () => this.#draw() });
    this.table = h("div", { class: "scroll" });
    this.element = h("section", { "aria-label": "What to change" },
      h("div", { class: "row" }, h("h3", {}, "What to change"), h("label", { for: this.which.id }, "of"), this.which,
        h("label", { for: this.margin.id }, "to clear the liner by"), this.margin, "%"),
      h("div", { class: "halves" }, chart.element, this.table));
  }

  /** @param {{design, worst}[]} found designs with their deepest lobe */
  show(found, waiting) {
    this.waiting = waiting;
    const chosen = this.found?.[this.which.selectedIndex]?.design ?? this.app.active;
    this.found = found.filter(({ worst }) => worst);
    fill(this.which, this.found.map(({ design }) => h("option", { selected: design === chosen }, design.title)));
    this.#ask();
  }

  async #ask() {
    const one = this.found[this.which.selectedIndex];
    if (!one) {
      this.slopes = null;
      fill(this.table);
      return this.chart.clear(this.waiting ? "Asking the exact core…" : "No lobe below the largest Kₑ: nothing has to change.");
    }
    if (one.slopes) {
      this.slopes = one;
      return this.#draw();
    }
    try {
      const { blade, contact } = one.design;
      const found = await ask("v1/sensitivities", { blade, contact, speed_hz: [one.worst.tip.speed_hz], ke_max: this.app.range.ke_max, policy: "exact" });
      one.slopes = found.parameter.map((parameter, i) => ({ parameter, unit: found.unit[i], value: found.value[0][i], relative: found.relative[0][i] }))
        .filter(({ relative, parameter }) => relative !== null && Math.abs(relative) >= LEAST_INFLUENCE && !parameter.startsWith("rotor speed"))
        .sort((a, b) => Math.abs(b.relative) - Math.abs(a.relative)).slice(0, SHOWN);
      this.slopes = one;
      return this.#draw();
    } catch (error) {
      if (error.name === "AbortError" || error instanceof Unreachable) return undefined;
      if (!(error instanceof Problem)) throw error;
      return this.chart.clear(`${error.field} = ${error.value}: ${error.remedy}`);
    }
  }

  #draw() {
    if (!this.slopes) return;
    const { design, worst, slopes } = this.slopes;
    const { ke_liner: liner } = this.app.range;
    const target = liner ? liner * (1 + Number(this.margin.value) / 100) : null;
    const gain = target ? Math.log(target / worst.tip.ke) : null;
    // ln K_e is taken as linear in ln p: a power law through the slope at the lobe's tip.
    const bars = slopes.map((slope) => ({ ...slope, needed: gain > 0 ? Math.expm1(gain / slope.relative) : null }));
    this.chart.show(bars, `${design.title}: at its deepest lobe, ${stiffness(worst.tip.ke)} at ${this.app.unit.write(worst.tip.speed_hz)}, mode ${worst.mode}.`);
    const said = gain === null ? "Give the liner’s Kₑ in the explorer." : gain <= 0 ? `It clears ${stiffness(target)} already.` : `To reach ${stiffness(target)} by one parameter alone, as far as the slopes hold; the explorer’s sliders tell what a larger change does.`;
    const change = (needed) => {
      if (needed === null) return "–";
      if (needed > 9 || needed < -0.9) return "out of reach alone";
      return `${needed > 0 ? "+" : "−"}${percent(Math.abs(needed), 2)}${Math.abs(needed) > LARGEST_CHANGE ? " (beyond the slope)" : ""}`;
    };
    const row = ({ parameter, unit, value, relative, needed }) => h("tr", {},
      h("th", { scope: "row" }, parameter), h("td", { class: "n" }, `${number(value)} ${unit.replace("kg^-1/2", "kg⁻½")}`),
      h("td", { class: "n" }, number(relative, 3)), h("td", { class: "n" }, change(needed)));
    fill(this.table, h("p", { class: "note" }, said), h("table", {},
      h("thead", {}, h("tr", {}, ["Parameter", "Value", "% of Kₑ for 1 %", "Change needed"].map((text, i) => h("th", { scope: "col", class: i ? "n" : "" }, text)))),
      h("tbody", {}, bars.map(row))));
  }
}
