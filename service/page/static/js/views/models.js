/** Models: which answers, what it promises, how it was found out, which others there are, and their exchange. */

import { showAudits } from "../models/audits.js";
import { showCard } from "../models/card.js";
import { showCertificates } from "../models/certificates.js";
import { showEvaluation } from "../models/evaluation.js";
import { Exchange } from "../models/exchange.js";
import { showHistory } from "../models/history.js";
import { LearningCurve } from "../models/learning_curve.js";
import { showModels } from "../models/model_table.js";
import { fill, h } from "../dom.js";
import { inWords, isSilent } from "../problem_note.js";
import { ask, events } from "../service.js";

// Counts of audits come in while one looks.
const LOOK_EVERY_S = 5;

export class ModelsView {
  /** @param {App} app */
  constructor(app) {
    this.app = app;
    this.looked = null;
    this.curve = new LearningCurve();
    this.exchange = new Exchange(() => {
      this.looked = null;
      this.load();
      app.changed("model");
    });
    this.state = h("div");
    this.fault = h("p", { class: "problem", role: "alert", hidden: true });
    this.rights = h("p", { class: "hint" });
    this.back = h("button", { type: "button", onclick: () => this.exchange.rollBack(this.answering) }, "Roll back…");
    const part = (title, ...more) => {
      const place = h("div");
      return { place, element: h("section", { class: "panel", "aria-label": title }, h("h2", {}, title), place, ...more) };
    };
    this.table = part("Models there are", this.rights);
    this.audits = part("Audit");
    this.certificates = part("Certificate");
    this.evaluation = part("Evaluation");
    this.card = part("What it was made of");
    this.history = part("History", h("p", {}, this.back));
    this.which = h("h2", { class: "which" });
    this.element = h("section", { "aria-label": "Models", class: "models" },
      this.fault, this.state, this.table.element, this.which,
      h("div", { class: "panels" }, h("div", {}, this.audits.element, this.certificates.element, this.evaluation.element),
        h("div", {}, h("section", { class: "panel", "aria-label": "Learning curve" }, this.curve.element), this.card.element)),
      this.history.element, this.exchange.element);
    app.onChange((what) => {
      if (!this.element.isConnected) return;
      if (what === "theme") this.drawCurve();
      if (what === "caller") this.load();
    });
    events.addEventListener("back", () => this.element.isConnected && this.load());
  }

  show() {
    this.load();
    this.timer = setInterval(() => this.loadAudits(), 1000 * LOOK_EVERY_S);
  }

  hide() {
    clearInterval(this.timer);
  }

  async load() {
    try {
      const [found, history] = await Promise.all([ask("v1/models"), ask("v1/models/history")]);
      this.fault.hidden = true;
      this.models = found.models;
      this.showState(found);
      this.showAll();
      showHistory(this.history.place, history.changes);
      this.back.disabled = history.changes.length < 2; // there is nothing to return to
      await this.loadAudits();
    } catch (error) {
      this.refuse(error);
    }
  }

  async loadAudits() {
    const { shown } = this;
    if (!shown) return;
    try {
      const found = await ask(`v1/models/${shown.id}/audits`);
      const text = JSON.stringify(found);
      if (this.shown !== shown || text === this.audited) return;
      this.audited = text; // an alarm that is there already is not said again
      showAudits(this.audits.place, found);
    } catch (error) {
      this.refuse(error);
    }
  }

  refuse(error) {
    if (isSilent(error) || error.status === 401) return;
    this.fault.hidden = false;
    fill(this.fault, inWords(error));
  }

  get answering() {
    return this.models?.find((model) => model.active)?.id ?? null;
  }

  /** The model that is looked at. */
  get shown() {
    return this.models?.find((model) => model.id === this.looked) ?? this.models?.[0];
  }

  showState({ loading, fault }) {
    fill(this.state,
      fault && h("p", { class: "problem", role: "alert" }, `The model that should answer does not: ${fault}`),
      loading && h("p", { class: "warning" }, `${loading} is being loaded; until it is there ${this.answering} answers.`),
      !this.models.length && h("p", { class: "warning" }, "There are no models: every answer is the exact core's."));
  }

  showAll() {
    const { shown } = this;
    const may = this.app.may("admin");
    this.back.hidden = !may;
    this.rights.textContent = may ? "" : "Exchanging the model takes a key of role admin.";
    for (const part of [this.which, this.audits.element, this.certificates.element, this.evaluation.element, this.card.element, this.curve.element.parentElement]) part.hidden = !shown;
    showModels(this.table.place, this.models, shown?.id, {
      look: (id) => this.look(id), promote: may ? (id) => this.exchange.promote(id, this.answering) : null,
    });
    if (!shown) return;
    fill(this.which, shown.active ? "The model that answers, " : "Model ", h("code", {}, shown.id));
    showCard(this.card.place, shown);
    showCertificates(this.certificates.place, shown.card);
    showEvaluation(this.evaluation.place, shown.card);
    fill(this.audits.place);
    this.audited = "";
    this.drawCurve();
  }

  async look(id) {
    this.looked = id;
    this.showAll();
    [...this.table.place.querySelectorAll("button[aria-pressed]")].find((one) => one.getAttribute("aria-pressed") === "true")?.focus();
    await this.loadAudits();
  }

  drawCurve() {
    if (this.shown) this.curve.show(this.shown.card);
  }
}
