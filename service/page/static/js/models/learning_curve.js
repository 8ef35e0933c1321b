/** What a model's rounds of labels were worth: the less has to be verified, the surer it is. */

import { Chart, DASHES, SERIES, colour, escaped } from "../charts/chart.js";
import { h } from "../dom.js";
import { number, percent } from "../format.js";
import { inWords, rounds, usualLine } from "./figures.js";

export class LearningCurve {
  constructor() {
    this.chart = new Chart({ title: "Learning curve", name: "learning-curve", height: 300 });
    this.none = h("p", { class: "hint" });
    this.element = h("div", {}, this.chart.element, this.none);
  }

  /** @param {Object} card */
  show(card) {
    const found = rounds(card);
    this.chart.element.hidden = found.length === 0;
    this.none.textContent = found.length ? "" : "The card keeps no rounds of training.";
    if (!found.length) return;
    const contacts = [...new Set(found.flatMap((round) => Object.keys(round.verified_share)))].sort().reverse();
    const points = (contact) => {
      const seen = found.map((round) => [round.labels, round.verified_share[contact] ?? null]);
      // The last round is followed by the fit that was certified, with all of the labels.
      const last = usualLine(card, contact)?.verified_share;
      return card.dataset.labels > found.at(-1).labels && last !== undefined ? [...seen, [card.dataset.labels, last]] : seen;
    };
    const traces = contacts.map((contact, i) => ({
      x: points(contact).map(([labels]) => labels), y: points(contact).map(([, share]) => share && 100 * share),
      name: escaped(inWords(contact)), mode: "lines+markers", type: "scatter",
      line: { color: SERIES[i], dash: DASHES[i], width: 2.5 }, marker: { color: SERIES[i], size: 9, symbol: ["circle", "diamond", "square"][i % 3] },
    }));
    const ticks = traces[0].x;
    const layout = {
      xaxis: { title: { text: "Labels (first crossings solved exactly)" }, tickvals: ticks, ticktext: ticks.map((value) => number(value)) },
      yaxis: { title: { text: "Verified exactly [%]" }, type: "log", dtick: "D2", range: logRange(traces.flatMap((trace) => trace.y)) },
      showlegend: true,
      legend: { x: 1, xanchor: "right", y: 1, bgcolor: colour("paper") },
    };
    const told = contacts.map((contact) => `${inWords(contact)}: ${points(contact).map(([labels, share]) => `${percent(share)} at ${number(labels)}`).join(", ")}`);
    this.chart.draw(traces, layout, `Share of answers to be verified exactly, over the number of labels. ${told.join(". ")}.`, {
      header: ["contact", "labels", "verified_share"],
      rows: contacts.flatMap((contact) => points(contact).map(([labels, share]) => [contact, labels, share])),
    });
    this.chart.note.textContent = "Share of the answers that is verified by the exact core, after each round of labels; the last point is the certified model.";
  }

  clear() {
    this.chart.element.hidden = true;
  }
}

/** Decades' logarithms that hold all the values, with some room. */
function logRange(values) {
  const logs = values.filter((value) => value > 0).map(Math.log10);
  return [Math.min(...logs) - 0.12, Math.max(...logs) + 0.15];
}
