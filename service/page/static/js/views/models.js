import { h } from "../dom.js";

export class ModelsView {
  constructor(app) {
    this.app = app;
    this.element = h("section", { "aria-label": "Models" }, h("h2", {}, "Models"));
  }
}
