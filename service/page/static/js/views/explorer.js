import { h } from "../dom.js";

export class ExplorerView {
  constructor(app) {
    this.app = app;
    this.element = h("section", { "aria-label": "Explorer" }, h("h2", {}, "Explorer"));
  }
}
