/** What the audit in the background has found about a model's confident answers. */

import { fill, h } from "../dom.js";
import { number, percent } from "../format.js";
import { inWords } from "./figures.js";
import { scrollable } from "../scrollable.js";

// Evidence beyond this says no more.
const LARGE = 1e6;

/** @param {HTMLElement} place  @param {Object} found of GET /v1/models/{id}/audits */
export function showAudits(place, found) {
  const { audits, auditing, alarm, alarm_at: limit } = found;
  const wrong = audits.reduce((sum, one) => sum + one.false_stable, 0);
  const stable = audits.reduce((sum, one) => sum + one.answered_stable, 0);
  const state = alarm ? h("p", { class: "problem", role: "alert" }, h("strong", {}, "Alarm: "),
    "more of the answers that this model called stable are unstable than it promises. Promote another model, or ask with policy exact.")
    : audits.length ? h("p", { class: "good" }, `No alarm: ${number(wrong)} of ${number(stable)} audited answers “stable” were unstable.`)
      : h("p", { class: "hint" }, auditing ? "None of this model's answers have been audited yet." : "None of this model's answers were audited.");
  fill(place,
    h("p", { class: "hint" }, auditing ? "A sample of what the service answers from the model alone is solved exactly in the background, and held to what the certificate promises."
      : "This service does not audit now (audit_share_of_time is 0); what is shown was counted before, or by others of its kind."),
    state,
    audits.length ? scrollable("Audited answers", h("table", {}, h("caption", {}, "Audited answers, under each promise"),
      h("thead", {}, h("tr", {}, h("th", { scope: "col" }, "Contact"), ["α promised", "Called stable", "of these unstable", "rate", "Called unstable", "of these stable", "Not decided", "Evidence against the promise"].map((text) => h("th", { scope: "col", class: "n" }, text)))),
      h("tbody", {}, audits.map((one) => h("tr", {}, h("th", { scope: "row" }, inWords(one.contact)), cell(percent(one.alpha)),
        cell(number(one.answered_stable)), cell(number(one.false_stable)), cell(one.answered_stable ? percent(one.false_stable / one.answered_stable) : "–"),
        cell(number(one.answered_unstable)), cell(number(one.false_unstable)), cell(number(one.undecided)),
        h("td", { class: "n" }, one.evidence > LARGE ? "over a million" : number(one.evidence, 3),
          one.alarmed_at && h("span", { class: "hint" }, `alarm since ${one.alarmed_at.slice(0, 10)}`))))))) : null,
    audits.length ? h("p", { class: "hint" }, `An alarm is raised when the evidence reaches ${number(limit)}, which a promise that is kept ever does with a chance of 1 %. An alarm stays.`) : null);
}

const cell = (text) => h("td", { class: "n" }, text);
