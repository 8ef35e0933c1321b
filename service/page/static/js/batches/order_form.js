/** The form a screening is asked for with. */

import { fill, fresh, h, say } from "../dom.js";
import { Field } from "../field.js";
import { inWords, isSilent } from "../problem_note.js";
import { ask } from "../service.js";
import { BladeChoice } from "./blade_choice.js";
import { ContactChoice, SpeedChoice } from "./conditions.js";

export class OrderForm {
  /** @param {App} app  @param {(job: Object) => void} onAccepted */
  constructor(app, onAccepted) {
    this.app = app;
    this.onAccepted = onAccepted;
    this.blades = new BladeChoice(app, () => this.told());
    this.contacts = new ContactChoice(app);
    this.speeds = new SpeedChoice(app);
    this.keMax = new Field({ label: "Kₑ up to", unit: "N/m", min: 0, hint: "Largest stiffness of the maps." });
    this.keLiner = new Field({ label: "Kₑ of the liner", unit: "N/m", min: 0, empty: "none", hint: "Verdict and margin are given at it." });
    this.margin = new Field({ label: "Margin at least", unit: "%", factor: 100, empty: "any", hint: "Of the smallest Kₑ that destabilises, above the liner's." });
    this.leastKe = new Field({ label: "Smallest Kₑ at least", unit: "N/m", min: 0, empty: "any", hint: "Nothing below it may destabilise." });
    this.share = new Field({ label: "Unstable share at most", unit: "%", factor: 100, min: 0, empty: "any", hint: "Of the map's points." });
    this.speedPoints = new Field({ label: "Speeds in each map", whole: true, min: 2 });
    this.kePoints = new Field({ label: "Stiffnesses in each map", whole: true, min: 2 });
    this.keMax.value = app.range.ke_max;
    this.keLiner.value = app.range.ke_liner;
    this.speedPoints.value = this.kePoints.value = 100;
    this.name = h("input", { id: fresh("name"), type: "text", maxLength: 200, size: 28, placeholder: "in lists and reports" });
    this.priority = h("select", { id: fresh("priority") }, Array.from({ length: 9 }, (_, i) =>
      h("option", { value: String(i + 1), selected: i === 4 }, [1, 5, 9].includes(i + 1) ? `${i + 1} – ${{ 1: "first", 5: "usual", 9: "last" }[i + 1]}` : String(i + 1))));
    this.bad = h("select", { id: fresh("bad") },
      h("option", { value: "skip" }, "screen the others, and list it"), h("option", { value: "refuse" }, "refuse the whole batch"));
    this.submit = h("button", { class: "primary" }, "Screen");
    this.fault = h("p", { class: "problem", role: "alert", hidden: true });
    this.role = h("p", { class: "warning", hidden: true });
    this.form = h("form", { noValidate: true, onsubmit: (event) => this.send(event) },
      this.role,
      this.all = h("fieldset", { class: "bare" }, h("legend", { class: "hidden" }, "New screening"),
        this.blades.element,
        h("div", { class: "two" }, this.contacts.element, this.speeds.element),
        group("Stiffness", this.keMax, this.keLiner),
        group("Criteria, each result is held to them (all may be left out)", this.margin, this.leastKe, this.share),
        group("Map size", this.speedPoints, this.kePoints),
        h("fieldset", {}, h("legend", {}, "The job"), h("div", { class: "fields" },
          labelled("Name", this.name), labelled("Priority", this.priority), labelled("A blade that cannot be screened", this.bad))),
        this.fault,
        h("p", { class: "row" }, this.submit)));
    this.element = h("div", { class: "order" }, h("h2", { tabIndex: -1 }, "New screening"),
      h("p", { class: "hint" }, "Every blade is screened under every contact, as a job that the service runs to its end whether this page stays open or not."), this.form);
    this.blades.files.takeDrops(this.element);
    app.onChange((what) => {
      if (what === "designs") this.designsChanged();
      if (what === "unit" || what === "designs") this.speeds.showUnit();
      if (what === "caller") this.callerChanged();
    });
    this.callerChanged();
    this.told();
  }

  designsChanged() {
    this.blades.fillDesigns();
    this.contacts.designsChanged();
  }

  callerChanged() {
    const may = this.app.may("submit");
    this.all.disabled = !may;
    this.role.hidden = may;
    this.blades.fillExamples();
    this.role.textContent = may ? "" :
      `The key in use, “${this.app.caller.name}”, has the role read: it may look at screenings, not start them. Starting one takes a key of role submit, which your administrator makes with rubscreen keys create.`;
  }

  told() {
    if (!this.submit) return; // still being made
    const { count, busy } = this.blades;
    this.submit.disabled = busy;
    this.submit.textContent = count === 1 ? "Screen 1 blade" : `Screen ${count.toLocaleString("en-US")} blades`;
  }

  /** The request's body. */
  question() {
    const criteria = { least_margin: this.margin.value, least_ke: this.leastKe.value, most_unstable_share: this.share.value };
    const asked = Object.fromEntries(Object.entries(criteria).filter(([, bound]) => bound !== null));
    const body = {
      blades: this.blades.entries, ...this.contacts.asked, ...this.speeds.asked,
      ke_liner: this.keLiner.value, criteria: asked, map_shape: [this.speedPoints.value, this.kePoints.value],
      bad_blades: this.bad.value, priority: Number(this.priority.value), name: this.name.value.trim() || null,
    };
    if (this.keMax.value !== null) body.ke_max = this.keMax.value;
    return body;
  }

  async send(event) {
    event.preventDefault();
    this.accept();
    if (!this.blades.count) {
      this.refuse(["Choose at least one blade: tick a design or an example, or drop a file."]);
      return;
    }
    const body = this.question();
    this.submit.disabled = true;
    try {
      const job = await ask("v1/screenings", body, { headers: { "Idempotency-Key": this.keyOf(body) } });
      this.sent = null;
      say("The screening was accepted");
      this.onAccepted(job);
    } catch (error) {
      if (isSilent(error)) this.refuse(["The service did not answer. Nothing here is lost: press again when it does. The same order given twice is one job."]);
      else this.refuse(inWords(error), error.field);
    } finally {
      this.submit.disabled = this.blades.busy;
    }
  }

  /** The same order, sent again because no answer came, is one job; another is another. */
  keyOf(body) {
    const text = JSON.stringify(body);
    if (this.sent?.text !== text) {
      const random = crypto.getRandomValues(new Uint8Array(16));
      this.sent = { text, key: [...random].map((byte) => byte.toString(16).padStart(2, "0")).join("") };
    }
    return this.sent.key;
  }

  get fields() {
    return {
      ke_max: this.keMax, ke_liner: this.keLiner, "criteria.least_margin": this.margin, "criteria.least_ke": this.leastKe,
      "criteria.most_unstable_share": this.share, map_shape: this.speedPoints, ...this.speeds.fields,
    };
  }

  accept() {
    this.fault.hidden = true;
    Object.values(this.fields).forEach((field) => field.accept());
  }

  /** Say what is wrong, at its field where it has one. */
  refuse(words, name = "") {
    const field = this.fields[name] ?? this.fields[name.replace(/\[\d\]$/, "")];
    if (field) {
      field.refuse(...words);
      return;
    }
    this.fault.hidden = false;
    fill(this.fault, words);
    this.fault.scrollIntoView({ block: "nearest" });
  }
}

const group = (title, ...fields) =>
  h("fieldset", {}, h("legend", {}, title), h("div", { class: "fields" }, fields.map((field) => field.element)));

const labelled = (text, input) => h("div", { class: "field" }, h("label", { for: input.id }, text), input);
