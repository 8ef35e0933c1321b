import { h } from "../dom.js";

export class CompareView {
  constructor(app) {
    this.app = app;
    this.element = h("section", { "aria-label": "Compare" }, h("h2", {}, "Compare"));
  }
}
