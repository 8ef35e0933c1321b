/** What a model promises: for each rate, how much has to be verified so that it is kept. */

import { fill, h } from "../dom.js";
import { number, percent } from "../format.js";
import { certificates, inWords } from "./figures.js";
import { scrollable } from "../scrollable.js";

/** @param {HTMLElement} place  @param {Object} card */
export function showCertificates(place, card) {
  const found = certificates(card);
  if (!found.length) {
    fill(place, h("p", { class: "hint" }, "The card holds no certificate: nothing is promised of this model's answers."));
    return;
  }
  fill(place,
    h("p", { class: "hint" }, "Of the points that the model calls stable at most the share α is unstable: at the confidence stated, for blades drawn from the distribution stated. Points nearer to the boundary than so many spreads of the model are verified by the exact core first."),
    found.map((one) => scrollable(`Certificate, ${inWords(one.contact)}`, h("table", {},
      h("caption", {}, `${capital(inWords(one.contact))}: ${percent(one.confidence)} confidence, distribution ${one.distribution}, ${number(one.points)} points`),
      h("thead", {}, h("tr", {}, ["α promised", "Verified exactly", "Nearer than [spreads]", "Called stable", "of these unstable", "False unstable"].map((text) => h("th", { scope: "col", class: "n" }, text)))),
      h("tbody", {}, one.table.map((line) => h("tr", {},
        h("th", { scope: "row", class: "n" }, percent(line.alpha)), cell(percent(line.verified_share)), cell(number(line.spreads)),
        cell(number(line.accepted)), cell(number(line.errors)), cell(percent(line.false_unstable_rate))))),
    ), one.not_reached?.length ? h("p", { class: "hint" }, `Not reached: ${one.not_reached.map((alpha) => percent(alpha)).join(", ")}. Asked for these, the service refuses.`) : null)));
}

const cell = (text) => h("td", { class: "n" }, text);
const capital = (text) => text[0].toUpperCase() + text.slice(1);
