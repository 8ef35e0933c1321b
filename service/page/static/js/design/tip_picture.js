/** Where the blade touches: its tip nodes under the casing, drawn to be clicked, with their weights. */

import { fill, h, s } from "../dom.js";

const [WIDTH, HEIGHT, EDGE] = [330, 118, 26];

export class TipPicture {
  /** @param {() => void} onChange called after a weight of `design.weights` changed */
  constructor(onChange) {
    this.onChange = onChange;
    this.picture = s("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, class: "tip-picture", role: "group", "aria-label": "Tip nodes in contact" });
    this.presets = h("div", { class: "row", role: "group", "aria-label": "Nodes in contact" });
    this.weights = h("div", { class: "weights" });
    this.element = h("div", {}, this.presets, this.picture,
      h("details", {}, h("summary", {}, "Weights of the nodes"), this.weights,
        h("p", { class: "hint" }, "The weight multiplies K_e at the node; 0 is no contact.")));
  }

  show(design) {
    this.design = design;
    const { nodes } = design;
    const [first, last] = [nodes[0], nodes.at(-1)];
    const preset = (name, touching) =>
      h("button", {
        type: "button", class: "small", "aria-pressed": String(this.#same(touching)),
        onclick: () => this.#set(Object.fromEntries(nodes.map((node) => [node, touching.includes(node) ? 1 : 0]))),
      }, name);
    fill(this.presets, nodes.length > 1
      ? [preset(`Leading edge (${first})`, [first]), preset(`Trailing edge (${last})`, [last]), preset("Both", [first, last]), preset("All", nodes)]
      : preset(first, [first]));
    this.#draw();
    fill(this.weights, nodes.map((node) => this.#weight(node)));
  }

  #same(touching) {
    return this.design.nodes.every((node) => (this.design.weights[node] ?? 0) === (touching.includes(node) ? 1 : 0));
  }

  #set(weights) {
    this.design.weights = weights;
    const focused = document.activeElement?.dataset?.node ?? document.activeElement?.textContent;
    this.show(this.design);
    // What was pressed has been drawn anew: the keyboard stays where it was.
    const again = [...this.element.querySelectorAll("button, [data-node]")].find(
      (item) => focused && (item.dataset.node === focused || item.textContent === focused),
    );
    again?.focus();
    this.onChange();
  }

  #weight(node) {
    const field = h("input", {
      type: "number", min: 0, max: 1000, step: 0.1, value: this.design.weights[node] ?? 0, class: "short",
      onchange: () => {
        const weight = Number(field.value);
        if (field.value === "" || !(weight >= 0 && weight <= 1000)) {
          field.setCustomValidity("give a weight from 0 to 1000");
          field.reportValidity();
          return;
        }
        field.setCustomValidity("");
        this.#set({ ...this.design.weights, [node]: weight });
      },
    });
    return h("label", {}, `${node} `, field);
  }

  /** The meridional plane: z along, r up, exaggerated so that the tip's slope is seen. */
  #draw() {
    const { nodes, base, weights } = this.design;
    const count = nodes.length;
    const z = base.tip_z_m ?? nodes.map((_, i) => i);
    const r = base.tip_radius_m ?? nodes.map(() => 0);
    const [left, right] = [Math.min(...z), Math.max(...z)];
    const [least, most] = [Math.min(...r), Math.max(...r)];
    const scale = right > left ? (WIDTH - 2 * EDGE) / (right - left) : 0;
    const x = z.map((value) => (count === 1 ? WIDTH / 2 : EDGE + (value - left) * scale));
    const rise = Math.min(scale, most > least ? 26 / (most - least) : 0);
    const y = r.map((value) => 50 + (most - value) * rise);
    const line = (dy) => x.map((px, i) => `${px},${y[i] + dy}`).join(" L");
    const outline = `M${line(0)} L${x[count - 1] - (count > 1 ? 6 : -18)},${HEIGHT - 4} L${x[0] + (count > 1 ? 6 : -18)},${HEIGHT - 4} Z`;
    const casing = `M${Math.max(x[0] - 16, 2)},${y[0] - 17} L${line(-17)} L${Math.min(x[count - 1] + 16, WIDTH - 2)},${y[count - 1] - 17}`;
    fill(this.picture,
      s("path", { d: `${casing} L${WIDTH - 2},12 L2,12 Z`, class: "casing-body" }),
      s("path", { d: casing, class: "casing-line" }),
      s("text", { x: 6, y: 10, class: "small-text" }, "casing"),
      s("path", { d: outline, class: "blade-body" }),
      s("text", { x: WIDTH / 2, y: HEIGHT - 12, class: "small-text", "text-anchor": "middle" }, "blade, flow from left to right"),
      nodes.map((node, i) => this.#node(node, x[i], y[i], weights[node] ?? 0, i === 0 || i === count - 1)),
    );
  }

  #node(node, x, y, weight, named) {
    const toggle = () => this.#set({ ...this.design.weights, [node]: weight > 0 ? 0 : 1 });
    return s("g", {
      role: "checkbox", tabindex: 0, "aria-checked": String(weight > 0), "aria-label": `${node}, weight ${weight}`, "data-node": node,
      class: `tip-node${weight > 0 ? " touching" : ""}`, onclick: toggle,
      onkeydown: (event) => {
        if (event.key !== " " && event.key !== "Enter") return;
        event.preventDefault();
        toggle();
      },
    },
    s("title", {}, `${node}: weight ${weight}; click to change`),
    s("circle", { cx: x, cy: y, r: 14, class: "reach" }),
    weight > 0 ? s("path", { d: `M${x},${y - 16} V${y - 7}`, class: "contact-mark" }) : null,
    s("circle", { cx: x, cy: y, r: weight > 0 ? 5 + 2.5 * Math.min(weight, 1) : 5 }),
    named ? s("text", { x, y: y + 21, class: "small-text", "text-anchor": "middle" }, node) : null);
  }
}
