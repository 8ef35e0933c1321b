/** A table that may be wider than its place: it scrolls there, by keyboard too. */

import { h } from "./dom.js";

/** @param {string} label for who does not see it  @param {...Node} children */
export const scrollable = (label, ...children) =>
  h("div", { class: "scroll", role: "region", "aria-label": label, tabIndex: 0 }, children);
