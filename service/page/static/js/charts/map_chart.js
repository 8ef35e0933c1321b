/** The stability map: verdicts over rotor speed and K_e, exact boundary, lobes, the liner, a cursor. */

import { h, s } from "../dom.js";
import { number, stiffness } from "../format.js";
import { Chart, colour } from "./chart.js";
import { Crosshair } from "./crosshair.js";

/** Of the colour scale: the surrogate's doubt below, what the exact core answered above. */
const [SURROGATE_TOP, EXACT_STABLE, EXACT_UNSTABLE] = [0.6, 0.8, 1.0];
/** Odds of ten to this power are shown as sure. */
const SURE = 4;
/** Plotly.js takes two clicks within so long as one double click, ms. */
const DOUBLE_CLICK = 300;

export class MapChart extends Chart {
  /**
   * @param {{title?: string, name?: string, height?: number}} given
   * Events on `element`: "cursor" and "choose", detail {speed_hz, ke} or null.
   */
  constructor({ title = "Stability map", name = "stability_map", height = 500 } = {}) {
    super({ title, name, height });
    this.cross = new Crosshair(this.plot);
    this.plot.classList.add("map");
    this.plot.tabIndex = 0;
    this.plot.setAttribute("role", "application");
    this.plot.setAttribute("aria-roledescription", "stability map");
    this.plot.addEventListener("pointermove", (event) => this.#pointed(event), true);
    this.plot.addEventListener("pointerleave", () => this.#emit("cursor", null));
    this.plot.addEventListener("pointerdown", (event) => {
      this.pressed = [event.clientX, event.clientY];
      // On the window: while a button is down plotly.js lays a cover over the page.
      addEventListener("pointerup", (released) => this.#released(released), { capture: true, once: true });
    }, true);
    this.plot.addEventListener("keydown", (event) => this.#key(event));
    this.plot.addEventListener("blur", () => this.#emit("cursor", null));
    this.note.before(mapKey());
    this.note.textContent = "Drag over a part to enlarge it; double-click to see all again.";
    this.cursor = null;
    this.parts = {};
  }

  /** Parts that are given take the place of those before: map, boundary, lobes, range, unit, point, chosen. */
  show(parts) {
    Object.assign(this.parts, parts);
    const { map, boundary, lobes, range, unit, point, chosen } = this.parts;
    const traces = [
      map ? heat(map, unit) : { type: "heatmap", x: [], y: [], z: [] },
      ...edges(boundary, unit),
      ...tips(lobes, unit, chosen),
    ];
    const layout = {
      uirevision: `${range.low_hz} ${range.high_hz} ${range.ke_max} ${unit.name}`,
      xaxis: { title: { text: unit.title }, range: [unit.of(range.low_hz), unit.of(range.high_hz)] },
      yaxis: { title: { text: "Cutting stiffness Kₑ [N/m]" }, range: [0, range.ke_max] },
      shapes: [...liner(range), ...pinned(point, unit)],
      annotations: linerName(range),
    };
    return this.draw(traces, layout, this.#described(), () => this.#table());
  }

  /** Another map in the same frame, as while a slider moves: quicker than `show`, which draws all anew. */
  async showLive(map) {
    const { unit, boundary, lobes } = this.parts;
    if (!this.drawn || boundary || lobes || !this.parts.map) return false;
    this.parts.map = map;
    const { z, x, y } = heat(map, unit);
    this.last.traces[0] = { ...this.last.traces[0], z, x, y };
    this.queue = this.queue.then(() => Plotly.restyle(this.plot, { z: [z], x: [x], y: [y] }, [0]));
    this.plot.setAttribute("aria-label", `${this.title}. ${this.#described()}`);
    await this.queue;
    return true;
  }

  #described() {
    const { map, lobes, unit, range } = this.parts;
    if (!map) return "No map yet.";
    const worst = lobes?.[0]?.tip;
    const least = worst
      ? `Smallest destabilising stiffness ${stiffness(worst.ke)} at ${unit.write(worst.speed_hz)}.`
      : `No lobe found below ${stiffness(range.ke_max)}.`;
    return `${number(100 * unstableShare(map), 3)} % of the map is unstable. ${least} Arrow keys move a cursor, Enter chooses its point.`;
  }

  #table() {
    const { map } = this.parts;
    if (!map) return null;
    const rows = [];
    map.ke.forEach((ke, i) => map.speed_hz.forEach((speed, j) => {
      const at = i * map.speed_hz.length + j;
      rows.push([speed, ke, verdictName(map.stable[at]), map.probability[at], map.source[at], map.reason[at]]);
    }));
    return { header: ["speed_hz", "ke_n_per_m", "verdict", "unstable_probability", "source", "reason"], rows };
  }

  /** What the map says at a place: the nearest of its points; null without a map. */
  read({ speed_hz, ke }) {
    const { map } = this.parts;
    if (!map) return null;
    const nearest = (values, wanted) =>
      Math.max(0, Math.min(values.length - 1, Math.round(((wanted - values[0]) / (values.at(-1) - values[0])) * (values.length - 1))));
    const at = nearest(map.ke, ke) * map.speed_hz.length + nearest(map.speed_hz, speed_hz);
    return { stable: map.stable[at], probability: map.probability[at], source: map.source[at], reason: map.reason[at] };
  }

  #pointed(event) {
    const found = this.cross.at(event);
    this.#emit("cursor", found && { speed_hz: this.parts.unit.toHz(found.x), ke: Math.max(found.y, 0) });
  }

  #released(event) {
    if (!this.pressed || Math.hypot(event.clientX - this.pressed[0], event.clientY - this.pressed[1]) > 4) return;
    const found = this.cross.at(event);
    const second = this.choosing;
    clearTimeout(this.choosing);
    this.choosing = null;
    // Two clicks in a row leave the enlargement, and choose nothing.
    if (!found || second) return;
    this.choosing = setTimeout(() => {
      this.choosing = null;
      this.#emit("choose", { speed_hz: this.parts.unit.toHz(found.x), ke: Math.max(found.y, 0) });
    }, DOUBLE_CLICK);
  }

  #key(event) {
    const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    const { range } = this.parts;
    if (event.key === "Enter" && this.cursor) this.#emit("choose", this.cursor);
    if (!steps) return;
    event.preventDefault();
    const cells = event.shiftKey ? 12 : 120;
    const from = this.cursor ?? { speed_hz: 0.5 * (range.low_hz + range.high_hz), ke: 0.5 * range.ke_max };
    const clamp = (value, low, high) => Math.min(Math.max(value, low), high);
    this.#emit("cursor", {
      speed_hz: clamp(from.speed_hz + (steps[0] * (range.high_hz - range.low_hz)) / cells, range.low_hz, range.high_hz),
      ke: clamp(from.ke + (steps[1] * range.ke_max) / cells, 0, range.ke_max),
      byKey: true,
    });
  }

  #emit(name, detail) {
    if (name === "cursor") {
      this.cursor = detail;
      if (detail) this.cross.show(this.parts.unit.of(detail.speed_hz), detail.ke);
      else this.cross.hide();
    }
    this.element.dispatchEvent(new CustomEvent(name, { detail }));
  }
}

/** Share of the decided points that are unstable. */
export function unstableShare(map) {
  let [unstable, decided] = [0, 0];
  for (const stable of map.stable) {
    if (Number.isNaN(stable)) continue;
    decided += 1;
    if (!stable) unstable += 1;
  }
  return decided ? unstable / decided : NaN;
}

export const verdictName = (stable) => (Number.isNaN(stable) ? "undecided" : stable ? "stable" : "unstable");

function heat(map, unit) {
  const width = map.speed_hz.length;
  const z = map.ke.map((_, i) => {
    const row = new Array(width);
    for (let j = 0, at = i * width; j < width; j += 1, at += 1) {
      if (map.source[at] === "exact") {
        row[j] = Number.isNaN(map.stable[at]) ? 0.5 * SURROGATE_TOP : map.stable[at] ? EXACT_STABLE : EXACT_UNSTABLE;
      } else {
        const p = map.probability[at];
        const sureness = Math.log10(p / (1 - p)) / SURE;
        row[j] = SURROGATE_TOP * (0.5 + 0.5 * Math.min(1, Math.max(-1, sureness)));
      }
    }
    return row;
  });
  const [stable, unsure, unstable] = ["stable", "unsure", "unstable"].map(colour);
  return {
    type: "heatmap", z, x: map.speed_hz.map((hz) => unit.of(hz)), y: map.ke, zmin: 0, zmax: 1, showscale: false,
    hoverinfo: "none",
    colorscale: [
      [0, stable], [0.5 * SURROGATE_TOP, unsure], [SURROGATE_TOP, unstable], [0.7, unstable],
      [0.7, colour("stable-exact")], [0.9, colour("stable-exact")], [0.9, colour("unstable-exact")], [1, colour("unstable-exact")],
    ],
  };
}

/** First crossing as a line; the other edges of instability, where stability returns above, as dots. */
function edges(boundary, unit) {
  const empty = { type: "scatter", mode: "lines", x: [], y: [] };
  if (!boundary) return [empty, empty];
  const others = { x: [], y: [] };
  boundary.unstable_ke.forEach((intervals, i) => (intervals ?? []).forEach(([low, high]) => {
    for (const edge of [low, high]) {
      if (edge === boundary.critical_ke[i] || edge >= boundary.ke_max) continue;
      others.x.push(unit.of(boundary.speed_hz[i]));
      others.y.push(edge);
    }
  }));
  return [
    {
      type: "scatter", mode: "lines", x: boundary.speed_hz.map((hz) => unit.of(hz)), y: boundary.critical_ke,
      line: { color: colour("boundary"), width: 1.8 }, hoverinfo: "none", connectgaps: false,
    },
    {
      type: "scatter", mode: "markers", ...others, hoverinfo: "none",
      marker: { color: colour("boundary"), size: 2.5 },
    },
  ];
}

function tips(lobes, unit, chosen) {
  if (!lobes) return [];
  return [{
    type: "scatter", mode: "markers", hoverinfo: "none",
    x: lobes.map(({ tip }) => unit.of(tip.speed_hz)), y: lobes.map(({ tip }) => tip.ke),
    marker: {
      symbol: "triangle-down", line: { color: colour("paper"), width: 1 },
      color: lobes.map((_, i) => (i === chosen ? colour("cursor") : colour("boundary"))),
      size: lobes.map((_, i) => (i === chosen ? 14 : i === 0 ? 12 : 7)),
    },
  }];
}

function liner({ ke_liner: ke, ke_max: most }) {
  if (!ke || ke > most) return [];
  return [{ type: "line", xref: "paper", x0: 0, x1: 1, y0: ke, y1: ke, line: { color: colour("link"), width: 2, dash: "dash" } }];
}

function linerName({ ke_liner: ke, ke_max: most }) {
  if (!ke || ke > most) return [];
  return [{
    xref: "paper", x: 1, xanchor: "right", y: ke, yanchor: "bottom", showarrow: false,
    text: `liner ${number(ke)} N/m`, font: { color: colour("link") }, bgcolor: colour("paper"), opacity: 0.9,
  }];
}

function pinned(point, unit) {
  if (!point) return [];
  const line = { color: colour("cursor"), width: 1.5, dash: "dot" };
  return [
    { type: "line", yref: "paper", x0: unit.of(point.speed_hz), x1: unit.of(point.speed_hz), y0: 0, y1: 1, line },
    { type: "line", xref: "paper", x0: 0, x1: 1, y0: point.ke, y1: point.ke, line },
  ];
}

function mapKey() {
  const patch = (name) => s("svg", { viewBox: "0 0 28 16", "aria-hidden": "true" }, s("rect", { width: 28, height: 16, class: `fill-${name}` }));
  const item = (name, text) => h("li", {}, patch(name), text);
  const line = s("svg", { viewBox: "0 0 28 16", "aria-hidden": "true" }, s("path", { d: "M0 8H28", class: "stroke-boundary" }));
  return h(
    "ul", { class: "key", "aria-label": "Key of the map" },
    item("stable", "stable"), item("unstable", "unstable"), item("unsure", "surrogate unsure"),
    item("stable-exact", "stable, re-verified"), item("unstable-exact", "unstable, re-verified"),
    h("li", {}, line, "exact boundary"), h("li", {}, "▼ tip of a lobe"),
  );
}
