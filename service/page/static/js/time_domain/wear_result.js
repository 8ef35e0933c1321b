/** What is shown of a wear map: a sentence, the charts, and the figures by speed. */

import { fill, h } from "../dom.js";
import { number } from "../format.js";
import { WearCharts } from "./wear_charts.js";

const MICRO = 1e6;

export class WearResult {
  /** @param {(speedHz: number) => void} choose a speed to look at closer */
  constructor(choose) {
    this.choose = choose;
    this.charts = new WearCharts();
    this.sentence = h("p", { class: "verdict note" });
    this.body = h("div", { class: "scroll" });
    this.table = h("details", {}, h("summary", {}, "Figures by speed"), this.body);
    this.element = h(
      "div", { class: "wear" }, this.sentence,
      h("p", { class: "note" }, "Contact is one-sided and the liner wears, so the exact core's verdict on permanent contact speaks of the onset; the simulation says what comes of it."),
      this.charts.chooser, h("div", { class: "charts" }, this.charts.all.map((chart) => chart.element)), this.table,
    );
  }

  /** @param {Outcome} outcome  @param {SpeedUnit} unit */
  draw(outcome, unit) {
    this.outcome = outcome;
    this.charts.draw(outcome, unit);
    this.sentence.textContent = sentence(outcome, unit);
    this.drawTable(outcome, unit);
  }

  redraw(unit) {
    if (this.outcome) this.draw(this.outcome, unit);
  }

  drawTable({ figures, nodes }, unit) {
    const column = (text, n = "n") => h("th", { scope: "col", class: n }, text);
    const most = (row) => number(Math.max(...row) * MICRO, 3);
    const row = (hz, i) => h(
      "tr", {}, h("th", { scope: "row", class: "n" }, number(unit.of(hz), 5)),
      h("td", {}, figures.stable[i] === null ? "not decided" : figures.stable[i] ? "stable" : "unstable"),
      [number(figures.growth_per_revolution[i], 3), number(figures.chatter_hz[i]), figures.wear_lobes[i].join(", "), most(figures.deepest_m[i]) + (figures.worn_through[i] ? ", through" : ""),
        most(figures.peak_m[i]), number(figures.strongest_hz[i])].map((text) => h("td", { class: "n" }, text)),
      h("td", {}, h("button", { type: "button", class: "small no-print", "aria-label": `Look closer at ${unit.write(hz)}`, onclick: () => this.choose(hz) }, "Look closer")),
    );
    fill(this.body, h(
      "table", {}, h("caption", {}, `By speed; lobes under ${nodes.join(", ")}, the others the largest of all nodes`),
      h("thead", {}, h("tr", {}, column(unit.title), column("Exact core, permanent contact", ""), column("ln |μ| a revolution"), column("Chatter [Hz]"), column("Wear lobes"),
        column("Deepest wear [µm]"), column("Largest displacement [µm]"), column("Strongest at the end [Hz]"), column("Response", ""))),
      h("tbody", {}, figures.speed_hz.map(row)),
    ));
  }
}

/** Where it is worn deepest, and whether the exact core has that speed among the unstable ones. */
function sentence({ figures, nodes }, unit) {
  const depth = figures.deepest_m.map((row) => Math.max(...row));
  const i = depth.indexOf(Math.max(...depth));
  const node = nodes[figures.deepest_m[i].indexOf(depth[i])];
  const unstable = figures.stable.filter((stable) => stable === false).length;
  const here = figures.stable[i] === null ? "not decided" : figures.stable[i] ? "stable" : "unstable";
  return `Worn deepest at ${unit.write(figures.speed_hz[i])}: ${number(depth[i] * MICRO, 3)} µm under ${node}, with ${figures.wear_lobes[i][nodes.indexOf(node)]} wear lobes; `
    + `permanent contact is ${here} there by the exact core, which calls ${unstable} of ${figures.speed_hz.length} simulated speeds unstable.`;
}
