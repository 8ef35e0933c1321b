/** What is shown of a response: the sentence, simulation and exact core side by side, the charts. */

import { fill, h } from "../dom.js";
import { number } from "../format.js";
import { changes, ending, fittedGrowth } from "./growth.js";
import { ResponseCharts } from "./response_charts.js";
import { growthWords, verdict } from "./verdict.js";

const MICRO = 1e6;
const MILLI = 1e3;

export class ResponseResult {
  constructor() {
    this.charts = new ResponseCharts();
    this.sentence = h("p", { class: "verdict" });
    this.tables = h("div", { class: "tables" });
    this.element = h("div", { class: "response" }, this.sentence, this.tables, h("div", { class: "charts" }, this.charts.all.map((chart) => chart.element)));
  }

  /** @param {Outcome} outcome  @param {SpeedUnit} unit */
  draw(outcome, unit) {
    const { response, figures } = outcome;
    const change = changes(response);
    const fitted = fittedGrowth(response, change, outcome.frequency.at(-1));
    const end = { ...ending(change), count: response.revolutions };
    const said = verdict(fitted, end, figures.stable[0], figures.worn_through[0], response.energy.length);
    this.sentence.className = `verdict ${said.look}`;
    this.sentence.textContent = said.text;
    this.drawTables(outcome, fitted, unit);
    this.charts.draw(outcome, { change, fitted, end });
  }

  redraw() {
    this.charts.redraw();
  }

  drawTables(outcome, fitted, unit) {
    const { figures } = outcome;
    const speed = figures.speed_hz[0];
    const stable = figures.stable[0];
    const row = (name, ...cells) => h("tr", {}, h("th", { scope: "row" }, name), cells.map((text) => h("td", {}, text)));
    const heads = (...names) => h("thead", {}, h("tr", {}, names.map((name) => h("th", { scope: "col" }, name))));
    const hz = (value) => (value === null || value === undefined ? "–" : `${number(value)} Hz = ${number(value / speed)} per revolution`);
    const word = fitted === null ? "contact was not kept long enough to tell" : Math.abs(fitted.growth) <= fitted.uncertainty ? "on the edge" : fitted.growth < 0 ? "stable" : "unstable";
    const core = stable === null ? "not decided" : stable ? "stable" : "unstable";
    fill(
      this.tables,
      h(
        "table", {}, h("caption", {}, `Onset at ${unit.write(speed)}, Kₑ = ${number(figures.ke)} N/m`), heads("", "Simulation, while contact is kept", "Exact core, permanent contact"),
        h(
          "tbody", {}, row("Verdict", word, core),
          row("Growth ln |μ| a revolution", fitted ? `${growthWords(fitted.growth)}; fit ± ${number(fitted.uncertainty, 2)}` : "–", growthWords(figures.growth_per_revolution[0])),
          row(stable === false ? "Chatter frequency" : "Frequency of the motion", hz(fitted?.hz ?? null), hz(figures.chatter_hz[0])),
        ),
      ),
      h(
        "table", {}, h("caption", {}, `In the end, after ${outcome.response.energy.length} revolutions`), heads("Contact node", "Largest displacement", "Largest force", "Deepest wear", "Wear lobes"),
        h("tbody", {}, outcome.nodes.map((node, j) => row(
          node, `${number(figures.peak_m[0][figures.tip_nodes.indexOf(node)] * MICRO, 3)} µm`, `${number(figures.force_peak_n[0][j], 3)} N`,
          `${number(figures.deepest_m[0][j] * MICRO, 3)} µm`,
          figures.wear_lobes[0][j] ? `${figures.wear_lobes[0][j]}, ± ${number(figures.lobe_amplitude_m[0][j] * MICRO, 3)} µm` : "none",
        ))),
      ),
      h("p", { class: "note" }, account(figures.energy)),
      figures.critical_ke_factor > 1 ? h("p", { class: "note" }, `The liner gives elastically before it is cut, so that with this liner Kₑ = ${number(figures.ke)} N/m acts as ${number(figures.ke / figures.critical_ke_factor)} N/m in the delay equation: that is what the exact core is asked here, while the explorer's map is of Kₑ itself.`) : null,
      h("p", { class: "note" }, "Contact is one-sided and the liner wears, so the delay equation behind the exact core speaks of the onset only: how far vibration then goes, and whether it ends, the simulation says."),
    );
  }
}

function account(energy) {
  if (!energy) return "";
  const mj = (joule) => `${number(joule * MILLI, 3)} mJ`;
  const friction = energy.work_of_friction_j;
  const rubbing = friction ? `, friction ${friction > 0 ? "put in" : "took"} ${mj(Math.abs(friction))}` : "";
  return `Energy: contact put in ${mj(energy.work_of_contact_j)}, damping took ${mj(-energy.work_of_damping_j)}${rubbing}, the blade holds ${mj(energy.energy_j)}; unaccounted for ${mj(energy.imbalance_j)}.${friction ? " The exact core's verdict is without friction." : ""}`;
}
