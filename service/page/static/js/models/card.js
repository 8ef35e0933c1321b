/** A model's card in words: where it came from, what it was taught on, what it may be asked. */

import { fill, h } from "../dom.js";
import { number } from "../format.js";
import { inWords } from "./figures.js";
import { scrollable } from "../scrollable.js";

const RANGES = {
  mode_count: "Number of modes",
  first_ratio: "Second frequency over the first",
  next_ratio: "Each further frequency over the one below it",
  damping_ratio: "Damping ratio of each mode",
  speed_ratio: "Rotor speed over the first frequency at that speed, Ω/f₁",
  arc_count: "Arcs of contact",
  engaged_share: "Share of the revolution in contact, with arcs",
};
const LARGEST = {
  damping_spread: "Damping ratio of a mode over their geometric mean, or the inverse",
  largest_kappa: "Largest Kₑ over modal stiffness at the contact, permanent contact",
  largest_kappa_with_arcs: "Largest Kₑ over modal stiffness at the contact, arcs of contact",
};

/** @param {HTMLElement} place  @param {Object} model of GET /v1/models */
export function showCard(place, { card }) {
  const { dataset = {}, fit = {}, architecture = {} } = card;
  const space = card.design_space ?? {};
  const facts = [
    ["Taught on", dataset.labels && `${number(dataset.labels)} labels${dataset.labelled_by ? `: ${dataset.labelled_by}` : ""}`],
    ["Chosen by", dataset.sampling],
    ["Network", architecture.blocks && `${architecture.blocks} residual blocks of ${architecture.width} units, ${card.features?.length ?? "?"} features`],
    ["Fitted", fit.epochs && `${fit.epochs} epochs, batches of ${number(fit.batch)}, learning rate ${number(fit.learning_rate)}`],
    ["Certified by", (card.certificates ?? []).map((one) => `${number(one.points)} fresh points, ${inWords(one.contact)}`).join("; ")],
    ["Written by version", [card.code_version, card.calibrated_by && `calibrated by ${card.calibrated_by}`].filter(Boolean).join(", ")],
    ["Remark", card.made],
    ["Data, SHA-256", dataset.sha256 && h("code", {}, `${dataset.sha256.slice(0, 16)}…`)],
  ].filter(([, told]) => told);
  const ranges = [
    ...Object.keys(RANGES).filter((name) => space[name]).map((name) => [RANGES[name], `${number(space[name][0])} to ${number(space[name][1])}`]),
    ...Object.keys(LARGEST).filter((name) => space[name]).map((name) => [LARGEST[name], `up to ${number(space[name])}`]),
  ];
  fill(place,
    h("dl", {}, facts.map(([name, told]) => [h("dt", {}, name), h("dd", {}, told)])),
    ranges.length ? [
      scrollable("Design space", h("table", {}, h("caption", {}, `Design space ${space.name ?? ""}: outside it the exact core answers`),
        h("thead", {}, h("tr", {}, h("th", { scope: "col" }, "Of the blade and its contact"), h("th", { scope: "col", class: "n" }, "Range"))),
        h("tbody", {}, ranges.map(([name, range]) => h("tr", {}, h("td", {}, name), h("td", { class: "n" }, range))))))] : null);
}
