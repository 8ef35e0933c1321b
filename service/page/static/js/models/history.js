/** Which model was active when, and the way back. */

import { fill, h } from "../dom.js";
import { moment } from "../batches/words.js";
import { scrollable } from "../scrollable.js";

/**
 * @param {HTMLElement} place
 * @param {Object[]} changes of GET /v1/models/history, oldest first
 */
export function showHistory(place, changes) {
  if (!changes.length) {
    fill(place, h("p", { class: "hint" }, "Nothing is on record: these are the models that came with the package, which are never exchanged."));
    return;
  }
  const head = ["When", "What", "Active from then on", "Before", "Against it"];
  fill(place, scrollable("Changes of the active model", h("table", {}, h("caption", { class: "hidden" }, "Changes of the active model, newest first"),
    h("thead", {}, h("tr", {}, head.map((text) => h("th", { scope: "col" }, text)))),
    h("tbody", {}, [...changes].reverse().map((change) => h("tr", {}, h("td", {}, moment(change.at)), h("td", {}, change.forced ? `${change.event} by force` : change.event),
      h("td", {}, h("code", {}, change.model)), h("td", {}, change.was ? h("code", {}, change.was) : "–"),
      h("td", {}, change.reasons.length ? h("ul", { class: "reasons" }, change.reasons.map((reason) => h("li", {}, reason))) : "–")))))));
}
