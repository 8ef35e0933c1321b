/** How often a model was wrong on points it was not taught on. */

import { fill, h } from "../dom.js";
import { number, percent } from "../format.js";
import { evaluations, inWords, otherRate, rate } from "./figures.js";
import { scrollable } from "../scrollable.js";

const KINDS = [
  ["auto", "As the service answers, verified near the boundary"],
  ["auto_hard", "the same, hard points only"],
  ["alone", "The model alone, nothing verified"],
  ["alone_hard", "the same, hard points only"],
];

/** @param {HTMLElement} place  @param {Object} card */
export function showEvaluation(place, card) {
  const found = Object.entries(evaluations(card)).filter(([, one]) => one.auto);
  if (!found.length) {
    fill(place, h("p", { class: "hint" }, "The card holds no evaluation."));
    return;
  }
  fill(place,
    h("p", { class: "hint" }, "Held-out points of known verdict. False stable: called stable and unstable, the mistake that costs a blade. Hard points lie close to the boundary."),
    found.map(([contact, one]) => scrollable(`Evaluation, ${inWords(contact)}`, h("table", {},
      h("caption", {}, `${inWords(contact)[0].toUpperCase()}${inWords(contact).slice(1)}, at α = ${percent(one.alpha)}; error of the boundary: median ${percent(one.median_boundary_error)}, 99 of 100 within ${percent(one.p99_boundary_error)}`),
      h("thead", {}, h("tr", {}, h("th", { scope: "col" }, "Answered"), ["Points", "False stable", "rate", "False unstable", "rate", "Verified exactly"].map((text) => h("th", { scope: "col", class: "n" }, text)))),
      h("tbody", {}, KINDS.filter(([name]) => one[name]).map(([name, words]) => {
        const counts = one[name];
        return h("tr", { class: name.endsWith("hard") ? "part" : "" }, h("th", { scope: "row" }, words), cell(number(counts.points)),
          cell(`${number(counts.false_stable)} of ${number(counts.answered_stable)}`), cell(percent(rate(counts))),
          cell(`${number(counts.false_unstable)} of ${number(counts.answered_unstable)}`), cell(percent(otherRate(counts))), cell(percent(counts.exact_share)));
      }))))));
}

const cell = (text) => h("td", { class: "n" }, text);
