/** The models there are, side by side by their key figures. */

import { fill, h } from "../dom.js";
import { number, percent } from "../format.js";
import { certificates, evaluations, keyFigures } from "./figures.js";
import { scrollable } from "../scrollable.js";

/**
 * @param {HTMLElement} place
 * @param {Object[]} models of GET /v1/models, the one that answers first
 * @param {string} looked id of the one that is looked at
 * @param {{look: (id: string) => void, promote: ((id: string) => void)|null}} todo `promote`: null where the reader may not
 */
export function showModels(place, models, looked, { look, promote }) {
  const contacts = [...new Set(models.flatMap(({ card }) => [...certificates(card).map((one) => one.contact), ...Object.keys(evaluations(card))]))];
  const active = models.find((model) => model.active);
  const rows = [
    { title: "Labels", cells: models.map(({ card }) => (card.dataset?.labels ? number(card.dataset.labels) : "–")) },
    ...keyFigures(contacts).map((figure) => ({
      title: figure.title,
      cells: models.map((model) => compared(figure, figure.of(model.card), model === active ? undefined : active && figure.of(active.card))),
    })),
    { title: "Version", cells: models.map(({ card }) => [card.code_version, card.calibrated_by].filter(Boolean).at(-1) ?? "–") },
  ];
  fill(place, scrollable("Key figures of the models", h("table", { class: "models-table" },
    h("caption", { class: "hidden" }, "Models and their key figures"),
    h("thead", {}, h("tr", {}, h("td"), models.map((model) => h("th", { scope: "col", class: model.id === looked ? "looked" : "" },
      h("code", {}, model.id), h("span", { class: "hint" }, model.active ? "answers now" : model.damage ? `damaged: ${model.damage}` : model.card.made ?? ""),
      h("span", { class: "row" },
        h("button", { type: "button", class: "small", "aria-pressed": String(model.id === looked), "aria-label": `Look at ${model.id}`, onclick: () => look(model.id) }, model.id === looked ? "shown below" : "look at"),
        promote && !model.active && !model.damage && h("button", { type: "button", class: "small", "aria-label": `Make ${model.id} the active model`, onclick: () => promote(model.id) }, "make active…")))))),
    h("tbody", {}, rows.map(({ title, cells }) => h("tr", {}, h("th", { scope: "row" }, title), cells.map((cell) => h("td", { class: "n" }, cell))))))));
}

/** A figure, and beside which way it differs from the active model's. */
function compared(figure, value, reference) {
  if (value === undefined || value === null) return "–";
  const text = percent(value);
  if (reference === undefined || reference === null || figure.less === null) return text;
  const same = Math.abs(value - reference) <= 1e-3 * Math.abs(reference);
  const better = value < reference === figure.less;
  const [words, kind] = same ? ["as the active", "hint"] : better ? ["better", "met"] : ["worse", "missed"];
  return [text, h("span", { class: `verdict ${kind}` }, h("span", { "aria-hidden": "true" }, same ? "" : better ? "▼" : "▲"), words)];
}
