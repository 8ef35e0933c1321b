/** Where round the casing the blade rubs: the ring to draw arcs of contact on, and their figures beside. */

import { fill, h, s } from "../dom.js";
import { sortedArcs } from "./design.js";

const [SIZE, RADIUS] = [190, 62];
const CENTRE = SIZE / 2;
const MOST_ARCS = 8;
/** Arcs end on whole degrees when drawn by hand; figures may be finer. */
const snapped = (turns) => Math.round(turns * 360) / 360;

export class CasingRing {
  /** @param {() => void} onChange called after `design.arcs` changed */
  constructor(onChange) {
    this.onChange = onChange;
    this.ring = s("svg", {
      viewBox: `0 0 ${SIZE} ${SIZE}`, class: "ring", "aria-hidden": "true",
      onpointerdown: (event) => this.#begin(event),
      onpointermove: (event) => this.#move(event),
      onpointerup: () => this.#end(),
      onpointercancel: () => this.#end(),
    });
    this.figures = h("div", {});
    this.problem = h("p", { class: "problem", role: "alert", hidden: true });
    this.element = h("div", { class: "ring-and-arcs" }, this.ring, h("div", {}, this.figures, this.problem));
  }

  show(design) {
    this.design = design;
    const arcs = design.arcs ?? [];
    const preset = (name, value) => {
      const pressed = JSON.stringify(value) === JSON.stringify(design.arcs);
      return h("button", { type: "button", class: "small", "aria-pressed": String(pressed), onclick: () => this.#set(value) }, name);
    };
    fill(this.figures,
      h("div", { class: "row", role: "group", "aria-label": "Round the casing" },
        preset("All round", null), preset("One quarter", [[0, 0.25]]), preset("Two quarters", [[0, 0.25], [0.5, 0.75]])),
      arcs.map((arc, i) => this.#arc(arc, i)),
      arcs.length < MOST_ARCS
        ? h("button", { type: "button", class: "small", onclick: () => this.#add() }, "Add an arc")
        : null,
      h("p", { class: "hint" }, arcs.length ? "Degrees round the casing; or draw on the ring." : "Permanent contact. Draw on the ring for arcs."));
    this.#draw();
  }

  #arc([start, end], i) {
    const field = (which, value) =>
      h("input", {
        type: "number", class: "short", min: -360, max: 720, step: 1, value: Number((360 * value).toFixed(3)),
        "aria-label": `Arc ${i + 1} ${which}, degrees`,
        onchange: (event) => {
          const arcs = structuredClone(this.design.arcs);
          arcs[i][which === "from" ? 0 : 1] = Number(event.target.value) / 360;
          this.#set(arcs);
        },
      });
    return h("div", { class: "row" }, field("from", start), "to", field("to", end), "°",
      h("button", {
        type: "button", class: "small", "aria-label": `Remove arc ${i + 1}`,
        onclick: () => {
          const rest = this.design.arcs.filter((_, j) => j !== i);
          this.#set(rest.length ? rest : null);
        },
      }, "✕"));
  }

  /** In the widest gap. */
  #add() {
    const arcs = sortedArcs(this.design.arcs ?? []);
    if (!arcs.length) return this.#set([[0, 0.25]]);
    const gaps = arcs.map(([, end], i) => [end, i + 1 < arcs.length ? arcs[i + 1][0] : arcs[0][0] + 1]);
    const [from, to] = gaps.reduce((best, gap) => (gap[1] - gap[0] > best[1] - best[0] ? gap : best));
    const third = (to - from) / 3;
    return this.#set([...arcs, [snapped(from + third) % 1, snapped(from + third) % 1 + snapped(third)]]);
  }

  /** Take arcs that can be; otherwise say why not, and keep those there were. */
  #set(arcs) {
    const why = arcs && fault(arcs);
    this.problem.textContent = why ?? "";
    this.problem.hidden = !why;
    if (why) return;
    this.design.arcs = arcs && sortedArcs(arcs);
    this.show(this.design);
    this.onChange();
  }

  #angle(event) {
    const box = this.ring.getBoundingClientRect();
    const [x, y] = [event.clientX - box.left - box.width / 2, event.clientY - box.top - box.height / 2];
    // From the top, clockwise, in revolutions.
    return (Math.atan2(x, -y) / (2 * Math.PI) + 1) % 1;
  }

  #begin(event) {
    const box = this.ring.getBoundingClientRect();
    const from = Math.hypot(event.clientX - box.left - box.width / 2, event.clientY - box.top - box.height / 2);
    if (Math.abs((from * SIZE) / box.width - RADIUS) > 20) return;
    this.ring.setPointerCapture(event.pointerId);
    this.drag = { from: this.#angle(event), last: this.#angle(event), turned: 0 };
  }

  #move(event) {
    if (!this.drag) return;
    const now = this.#angle(event);
    // Followed step by step, so that an arc may run past the top.
    let step = now - this.drag.last;
    if (step > 0.5) step -= 1;
    if (step < -0.5) step += 1;
    this.drag.turned += step;
    this.drag.last = now;
    this.#draw(this.#drawn());
  }

  #drawn() {
    const { from, turned } = this.drag;
    const start = turned < 0 ? from + turned : from;
    const whole = ((snapped(start) % 1) + 1) % 1;
    return [whole, whole + snapped(Math.min(Math.abs(turned), 0.99))];
  }

  #end() {
    if (!this.drag) return;
    const arc = this.#drawn();
    this.drag = null;
    if (arc[1] - arc[0] < 2 / 360) return this.#draw();
    return this.#set([...(this.design.arcs ?? []).filter((other) => !overlap(arc, other)), arc]);
  }

  #draw(extra = null) {
    const arcs = this.design.arcs;
    fill(this.ring,
      s("circle", { cx: CENTRE, cy: CENTRE, r: RADIUS, class: arcs ? "ring-free" : "ring-contact" }),
      (arcs ?? []).map(([start, end]) => s("path", { d: arcPath(start, end), class: "ring-contact" })),
      extra ? s("path", { d: arcPath(...extra), class: "ring-new" }) : null,
      [0, 90, 180, 270].map((degrees) => {
        const [x, y] = at(degrees / 360, RADIUS + 16);
        return s("text", { x, y: y + 4, class: "small-text", "text-anchor": "middle" }, `${degrees}°`);
      }),
      s("path", { d: `M${CENTRE},${CENTRE} L${at(0.03, RADIUS - 12).join(",")}`, class: "ring-blade" }),
      s("text", { x: CENTRE, y: CENTRE + 24, class: "small-text", "text-anchor": "middle" },
        arcs ? `${Math.round(100 * arcs.reduce((sum, [a, b]) => sum + b - a, 0))} % contact` : "all round"));
  }
}

const at = (turns, radius) => [CENTRE + radius * Math.sin(2 * Math.PI * turns), CENTRE - radius * Math.cos(2 * Math.PI * turns)];

function arcPath(start, end) {
  const [x0, y0] = at(start, RADIUS);
  const [x1, y1] = at(Math.min(end, start + 0.9999), RADIUS);
  return `M${x0},${y0} A${RADIUS},${RADIUS} 0 ${end - start > 0.5 ? 1 : 0} 1 ${x1},${y1}`;
}

const overlap = (a, b) => [-1, 0, 1].some((turn) => a[0] < b[1] + turn && b[0] + turn < a[1]);

/** What is wrong with arcs of contact, in words; null for nothing. */
function fault(arcs) {
  if (arcs.some(([start, end]) => !Number.isFinite(start) || !Number.isFinite(end))) return "Give two numbers for each arc.";
  const wrong = arcs.findIndex(([start, end]) => end <= start);
  if (wrong >= 0) return `Arc ${wrong + 1} ends before it begins: let the second number be larger; past the top, go on beyond 360.`;
  if (arcs.some(([start]) => start < 0 || start >= 1)) return "Let each arc begin between 0° and 360°.";
  const whole = arcs.find(([start, end]) => end - start >= 1);
  if (whole) return "An arc of the whole circumference is permanent contact: choose All round.";
  for (let i = 0; i < arcs.length; i += 1) {
    for (let j = i + 1; j < arcs.length; j += 1) if (overlap(arcs[i], arcs[j])) return "Two arcs overlap: join them, or move one.";
  }
  return null;
}
