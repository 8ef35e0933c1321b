/** Batches: ask for a screening, watch it, read its ranking. */

import { JobList } from "../batches/job_list.js";
import { JobView } from "../batches/job_view.js";
import { OrderForm } from "../batches/order_form.js";
import { fill, h } from "../dom.js";
import { packed } from "../link.js";

export class BatchesView {
  /** @param {App} app */
  constructor(app) {
    this.app = app;
    this.list = new JobList((id) => this.open(id, { focus: true }));
    this.job = new JobView(app, (job) => this.list.put(job));
    this.order = new OrderForm(app, (job) => {
      this.list.put(job);
      this.open(job.id, { focus: true });
    });
    this.fresh = h("button", { type: "button", class: "primary", onclick: () => this.open(null, { focus: true }) }, "New screening");
    this.detail = h("div", { class: "detail" });
    this.element = h("section", { "aria-label": "Batches", class: "batches" },
      h("aside", { class: "no-print", "aria-label": "Screenings" }, h("div", { class: "row" }, h("h2", {}, "Screenings"), this.fresh), this.list.element),
      this.detail);
    // Another key may see, and do, other things.
    app.onChange((what) => what === "caller" && this.element.isConnected && this.list.restart());
  }

  show() {
    this.list.start();
    this.open(this.app.job, { keep: false });
  }

  /** The jobs go on in the service; only the looking ends. */
  hide() {
    this.list.stop();
    this.job.close();
  }

  /** Show a screening, or with null the form; the address then leads there. */
  async open(id, { focus = false, keep = true } = {}) {
    this.app.job = id;
    this.list.mark(id);
    this.fresh.disabled = id === null;
    if (id === null) this.job.close();
    const shown = id === null ? this.order : this.job;
    fill(this.detail, shown.element);
    if (id !== null) this.job.open(id);
    if (focus) shown.element.querySelector("h2").focus({ preventScroll: true });
    if (keep) history.replaceState(null, "", location.href.split("#")[0] + (await packed(this.app.toState("batches"))));
  }
}
