/** A cross over a chart that follows the pointer or the arrow keys, drawn beside plotly.js, which is slower. */

import { h } from "../dom.js";

export class Crosshair {
  /** @param {HTMLElement} plot the element that plotly.js draws in */
  constructor(plot) {
    this.plot = plot;
    this.vertical = h("div", { class: "hair vertical", "aria-hidden": "true" });
    this.horizontal = h("div", { class: "hair horizontal", "aria-hidden": "true" });
    this.dot = h("div", { class: "hair dot", "aria-hidden": "true" });
    this.hide();
  }

  #axes() {
    const layout = this.plot._fullLayout;
    return layout?.xaxis && layout?.yaxis ? [layout.xaxis, layout.yaxis] : null;
  }

  /** Figures at a pointer's place, {x, y} in those of the axes; null outside. */
  at(event) {
    const axes = this.#axes();
    if (!axes) return null;
    const box = this.plot.getBoundingClientRect();
    const [px, py] = [event.clientX - box.left - axes[0]._offset, event.clientY - box.top - axes[1]._offset];
    if (px < 0 || py < 0 || px > axes[0]._length || py > axes[1]._length) return null;
    return { x: axes[0].p2d(px), y: axes[1].p2d(py) };
  }

  /** Put it at figures of the axes; y may be null for a line alone. */
  show(x, y = null) {
    const axes = this.#axes();
    if (!axes) return;
    if (!this.vertical.isConnected) this.plot.append(this.vertical, this.horizontal, this.dot);
    const [xa, ya] = axes;
    const [px, py] = [xa.d2p(x), y === null ? null : ya.d2p(y)];
    const inside = px >= 0 && px <= xa._length;
    const level = inside && py !== null && py >= 0 && py <= ya._length;
    this.vertical.hidden = !inside;
    this.horizontal.hidden = this.dot.hidden = !level;
    const put = (element, style) => Object.entries(style).forEach(([k, v]) => { element.style[k] = `${v}px`; });
    put(this.vertical, { left: xa._offset + px, top: ya._offset, height: ya._length });
    if (level) {
      put(this.horizontal, { left: xa._offset, top: ya._offset + py, width: xa._length });
      put(this.dot, { left: xa._offset + px - 4, top: ya._offset + py - 4 });
    }
  }

  hide() {
    this.vertical.hidden = this.horizontal.hidden = this.dot.hidden = true;
  }
}
