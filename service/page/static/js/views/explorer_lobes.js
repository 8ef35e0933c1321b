/** The deepest lobes in a table; a row chosen stands out on both charts. */

import { fill, h } from "../dom.js";
import { number } from "../format.js";
import { saveTable } from "../charts/chart.js";

const SHOWN = 8;

export class LobeTable {
  /** @param {(index: number) => void} onChoose */
  constructor(onChoose) {
    this.onChoose = onChoose;
    this.table = h("div", { class: "scroll", tabIndex: 0, role: "region", "aria-label": "Deepest lobes" });
    this.element = h("section", { class: "lobes" },
      h("div", { class: "row" }, h("h3", {}, "Deepest lobes"),
        h("button", { type: "button", class: "small", onclick: () => this.#save() }, "CSV")), this.table);
  }

  show(lobes, unit, chosen) {
    this.lobes = lobes;
    if (!lobes) return fill(this.table, h("p", { class: "note" }, "…"));
    if (!lobes.length) return fill(this.table, h("p", { class: "note" }, "None below the largest Kₑ."));
    const heading = (text, n = true) => h("th", { scope: "col", class: n ? "n" : "" }, text);
    const row = ({ tip, mode }, i) =>
      h("tr", { class: i === chosen ? "chosen" : "" },
        h("td", {}, h("button", {
          type: "button", class: "small", "aria-pressed": String(i === chosen), "aria-label": `Lobe ${i + 1}: show on both charts`, onclick: () => this.onChoose(i),
        }, `${i + 1}`)),
        h("td", { class: "n" }, number(tip.ke)), h("td", { class: "n" }, number(unit.of(tip.speed_hz))),
        h("td", { class: "n" }, mode),
        h("td", { class: "n" }, number(tip.chatter_hz)), h("td", { class: "n" }, number(tip.lobes_per_revolution)));
    return fill(this.table, h("table", {},
      h("thead", {}, h("tr", {}, heading("", false), heading("Kₑ [N/m]"), heading(`Speed [${unit.symbol}]`), heading("Mode"), heading("Chatter [Hz]"), heading("Wear lobes"))),
      h("tbody", {}, lobes.slice(0, SHOWN).map(row))),
    lobes.length > SHOWN ? h("p", { class: "note" }, `${lobes.length - SHOWN} more are on the charts and in the CSV.`) : null);
  }

  #save() {
    if (!this.lobes) return;
    saveTable({
      header: ["ke_n_per_m", "speed_hz", "speed_rpm", "mode", "chatter_hz", "waves_per_revolution", "error_estimate"],
      rows: this.lobes.map(({ tip, mode }) => [tip.ke, tip.speed_hz, tip.speed_rpm, mode, tip.chatter_hz, tip.lobes_per_revolution, tip.error_estimate]),
    }, "lobes.csv");
  }
}
