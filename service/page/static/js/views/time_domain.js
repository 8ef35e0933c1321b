import { h } from "../dom.js";

export class TimeView {
  constructor(app) {
    this.app = app;
    this.element = h("section", { "aria-label": "Time domain" }, h("h2", {}, "Time domain"));
  }
}
