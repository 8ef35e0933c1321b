import { h } from "../dom.js";

export class BatchesView {
  constructor(app) {
    this.app = app;
    this.element = h("section", { "aria-label": "Batches" }, h("h2", {}, "Batches"));
  }
}
