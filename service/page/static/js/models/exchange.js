/** Another model in the place of the active one, or the one before again: asked twice, told why not. */

import { fill, fresh, h, say } from "../dom.js";
import { inWords } from "../problem_note.js";
import { Unreachable, ask } from "../service.js";

export class Exchange {
  /** @param {(change: Object) => void} onChanged */
  constructor(onChanged) {
    this.onChanged = onChanged;
    const id = fresh("exchange");
    this.title = h("h2", { id });
    this.body = h("div");
    this.answer = h("div", { "aria-live": "assertive" });
    this.go = h("button", { type: "button", class: "primary" });
    this.go.addEventListener("click", () => this.run());
    this.close = h("button", { type: "button", onclick: () => this.element.close() }, "Leave everything as it is");
    this.element = h("dialog", { class: "exchange", "aria-labelledby": id }, this.title, this.body, this.answer, h("p", { class: "actions" }, this.go, this.close));
    // While it is decided in the service, closing would only hide what comes of it.
    this.element.addEventListener("cancel", (event) => this.busy && event.preventDefault());
  }

  /** Ask whether a model shall become the active one. */
  promote(id, active) {
    this.open({
      title: `Make ${id} the active model?`,
      told: [
        `From then on every answer comes from it in place of ${active ?? "the exact core"}: for everybody who asks this service, and every other service with the same models folder. Screenings under way keep the model they began with.`,
        "Before that it is held to the active model: certificate, figures of its card, and 2,000 fresh points, which takes some seconds. A model that is worse is refused.",
        "Roll back makes the present one active again.",
      ],
      go: "Check it, and make it active",
      send: (force) => ask(`v1/models/${id}/promote`, { force }),
    });
  }

  /** Ask whether the model before shall be active again. */
  rollBack(active) {
    this.open({
      title: "Roll back to the model before?",
      told: [
        `The model that was active before ${active} answers again, for everybody who asks this service and every other with the same models folder. It is not measured again.`,
        "Screenings under way keep the model they began with. Roll back once more returns to the one before that.",
      ],
      go: "Roll back",
      send: () => ask("v1/models/rollback", {}, { method: "POST" }),
    });
  }

  open({ title, told, go, send }) {
    this.send = send;
    this.force = false;
    fill(this.title, title);
    fill(this.body, told.map((text) => h("p", {}, text)));
    fill(this.answer);
    this.go.textContent = go;
    this.go.className = "primary";
    this.ready(true);
    this.element.showModal();
    // What does nothing is what Enter does first.
    this.close.focus();
  }

  ready(is) {
    this.busy = !is;
    this.go.hidden = false;
    this.go.disabled = this.close.disabled = !is;
    this.close.textContent = "Leave everything as it is";
  }

  async run() {
    this.ready(false);
    fill(this.answer, h("p", { class: "hint" }, "The service is at it…"));
    try {
      const change = await this.send(this.force);
      this.ready(true);
      this.done(change);
    } catch (error) {
      this.ready(true);
      if (error.reasons?.length) this.refused(error);
      else this.failed(error);
    }
  }

  done(change) {
    const same = change.model === change.was;
    const words = same ? `${change.model} was the active model already.` : `${change.model} is the active model now, after ${change.was ?? "none"}.`;
    fill(this.answer, h("p", { class: "good" }, words, change.answering ? "" : " It answers in a moment."),
      change.overridden.length ? [h("p", {}, "On record, against it:"), list(change.overridden)] : null);
    this.go.hidden = true;
    this.close.textContent = "Close";
    say(words);
    this.onChanged(change);
  }

  failed(error) {
    const away = error instanceof Unreachable ? " Whether it was done is seen in the history below." : "";
    fill(this.answer, h("p", { class: "problem", role: "alert" }, inWords(error), away));
  }

  /** The gate's reasons; and apart from them, to be ticked first, the way past it. */
  refused(problem) {
    const box = h("input", { type: "checkbox", onchange: () => { this.force = box.checked; this.go.disabled = !box.checked; } });
    fill(this.answer,
      h("div", { class: "problem", role: "alert" }, h("strong", {}, "It was not made active: it is worse than the model that answers now."), list(problem.reasons)),
      h("fieldset", {}, h("legend", {}, "Make it active in spite of that"),
        h("p", {}, "The reasons above go on record in the history. Answers may then be wrong more often than users are promised, or slower."),
        h("label", {}, box, " I have read why it is worse, and want it to answer everybody all the same")));
    this.force = false;
    this.go.textContent = "Make it active by force";
    this.go.className = "danger";
    this.go.disabled = true;
  }
}

const list = (reasons) => h("ul", { class: "reasons" }, reasons.map((reason) => h("li", {}, reason)));
