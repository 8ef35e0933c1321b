/** Charts of many speeds: worn depth, its deepest, the spectrum on Campbell's diagram, and wear lobes. */

import { Chart, SERIES, colour, escaped } from "../charts/chart.js";
import { fill, fresh, h } from "../dom.js";
import { number } from "../format.js";

const MICRO = 1e6;
const SHOWN = 0.995; // of the map's points: a few deepest would leave the others without colour
const DECADES = 3;
const MOST_ROWS = 400;
const MOST_ORDERS = 10;
const MARGIN = { l: 64, r: 16, t: 52, b: 48 };
const KEY_ABOVE = { showlegend: true, legend: { orientation: "h", traceorder: "normal", x: 0, y: 1.06, yanchor: "bottom" }, margin: MARGIN };

export class WearCharts {
  constructor() {
    const chart = (name, title, note, height = 400) => {
      const made = new Chart({ title, name: `rub-${name}`, height });
      made.note.textContent = note;
      return made;
    };
    this.map = chart("wear-map", "Worn depth over speed and angle",
      "How deep the liner is cut at each angle of the casing. The bar above marks speeds at which the exact core calls permanent contact unstable. An oval casing is cut where it comes near, whatever vibrates.");
    this.spectrum = chart("spectrum-map", "Vibration on Campbell's diagram",
      "Amplitude of the first contact node over the last revolutions. Where dark spots lie on natural frequencies (dashed) away from engine orders (dotted), the blade chatters; on a crossing it may just resonate.");
    this.deepest = chart("deepest", "Deepest wear and largest displacement", "Of all angles and revolutions. An unstable speed with little wear never had contact enough to grow.");
    this.lobes = chart("wear-lobes", "Wear lobes round the casing",
      "Strongest harmonic of the worn profile, the ovalisation's own left aside; rings: chatter frequency over rotor speed by the exact core. Multiples of the ovalisation's lobes may be its groove, and no vibration.");
    this.all = [this.map, this.spectrum, this.deepest, this.lobes];
    const id = fresh("node");
    this.node = h("select", { id, onchange: () => this.redraw() });
    this.chooser = h("p", { class: "row no-print" }, h("label", { for: id }, "Contact node"), this.node);
  }

  /** @param {Outcome} outcome  @param {SpeedUnit} unit */
  draw(outcome, unit) {
    if (outcome.nodes.join() !== this.outcome?.nodes.join()) fill(this.node, outcome.nodes.map((node, j) => h("option", { value: j }, node)));
    this.outcome = outcome;
    this.unit = unit;
    this.chooser.hidden = outcome.nodes.length < 2;
    this.x = outcome.figures.speed_hz.map((hz) => unit.of(hz));
    this.axis = { title: { text: unit.title }, range: ends(this.x) };
    this.j = Number(this.node.value);
    this.drawMap();
    this.drawSpectrum();
    this.drawDeepest();
    this.drawLobes();
  }

  redraw(unit = this.unit) {
    if (this.outcome) this.draw(this.outcome, unit);
  }

  get header() {
    return ["speed_hz", `speed [${this.unit.symbol}]`];
  }

  /** Bars over the speeds that the exact core calls unstable. */
  unstable(bottom, top, opacity) {
    return this.outcome.figures.unstable_speeds_hz.map(([low, high]) => ({
      type: "rect", xref: "x", yref: "paper", x0: this.unit.of(low), x1: this.unit.of(high), y0: bottom, y1: top,
      fillcolor: colour("unstable-exact"), opacity, line: { width: 0 }, layer: bottom < 1 ? "below" : "above",
    }));
  }

  /** What stands for the bars in the key; they are no trace of their own. */
  get unstableKey() {
    return {
      x: [null], y: [null], mode: "markers", name: this.outcome.figures.unstable_speeds_hz.length ? "unstable in permanent contact (exact core)" : "permanent contact stable at every speed (exact core)",
      marker: { symbol: "square", size: 11, color: this.outcome.figures.unstable_speeds_hz.length ? colour("unstable-exact") : colour("paper") },
    };
  }

  drawMap() {
    const { figures, angle, nodes } = this.outcome;
    const degrees = Array.from(angle, (a) => (a * 180) / Math.PI);
    const depth = figures.speed_hz.map((_, i) => this.outcome.worn(i, this.j));
    const all = depth.flatMap((row) => Array.from(row)).sort((a, b) => a - b);
    const shown = Math.max(all[Math.floor(SHOWN * (all.length - 1))] * MICRO, 1e-6);
    const z = degrees.map((_, k) => depth.map((row) => row[k] * MICRO));
    this.map.draw([{ type: "heatmap", x: this.x, y: degrees, z, zmin: 0, zmax: shown, colorscale: this.scale(), colorbar: bar("worn depth [µm]") }, this.unstableKey], {
      ...KEY_ABOVE, shapes: this.unstable(1.01, 1.05, 1), xaxis: this.axis,
      yaxis: { title: { text: "angle round the casing [°]" }, range: [0, 360], tick0: 0, dtick: 45 },
    }, `Under ${nodes[this.j]}: deepest ${number(all.at(-1) * MICRO, 3)} µm.`,
    () => ({
      header: [...this.header, ...degrees.map((a) => `worn_um at ${number(a, 4)} deg`)],
      rows: figures.speed_hz.map((hz, i) => [hz, this.x[i], ...Array.from(depth[i], (v) => v * MICRO)]),
    }));
  }

  drawSpectrum() {
    const { figures, frequency, spectrum } = this.outcome;
    const together = Math.ceil(frequency.length / MOST_ROWS);
    const count = Math.floor(frequency.length / together);
    const middle = Array.from({ length: count }, (_, k) => (frequency[k * together] + frequency[(k + 1) * together - 1]) / 2);
    const z = middle.map((_, k) => spectrum.map((row) => row.subarray(k * together, (k + 1) * together).reduce((a, b) => Math.max(a, b)) * MICRO));
    const top = Math.ceil(Math.log10(z.flat().reduce((a, b) => Math.max(a, b), 1e-9)));
    const highest = frequency.at(-1);
    const natural = figures.natural_hz[0].map((_, j) => ({
      x: this.x, y: figures.natural_hz.map((row) => row[j]), mode: "lines", name: "natural frequencies", legendgroup: "natural", showlegend: j === 0,
      line: { color: SERIES[0], width: 1.3, dash: "dash" },
    }));
    const at = figures.speed_hz.map((_, i) => i).filter((i) => figures.stable[i] === false && figures.chatter_hz[i] !== null);
    const chatter = { x: at.map((i) => this.x[i]), y: at.map((i) => figures.chatter_hz[i]), mode: "markers", name: "chatter (exact core)", marker: RING(colour("unstable-exact")) };
    const { traces, annotations } = this.orders(highest);
    const ticks = Array.from({ length: DECADES + 1 }, (_, i) => top - DECADES + i);
    this.spectrum.draw([
      {
        type: "heatmap", x: this.x, y: middle, z: z.map((row) => row.map((v) => Math.max(Math.log10(v || 1e-300), top - DECADES))),
        zmin: top - DECADES, zmax: top, colorscale: [[0, colour("paper")], [1, colour("ink")]],
        colorbar: { ...bar("amplitude [µm]"), tickvals: ticks, ticktext: ticks.map((t) => String(Number((10 ** t).toPrecision(3)))) },
      },
      ...traces, ...natural, chatter,
    ], { ...KEY_ABOVE, annotations, shapes: this.unstable(1.01, 1.05, 1), xaxis: this.axis, yaxis: { title: { text: "frequency [Hz]" }, range: [0, highest] } },
    `Natural frequencies at the slowest speed: ${figures.natural_hz[0].map((hz) => number(hz)).join(", ")} Hz.`,
    () => ({
      header: [...this.header, ...middle.map((hz) => `amplitude_um at ${number(hz, 5)} Hz`)],
      rows: figures.speed_hz.map((hz, i) => [hz, this.x[i], ...z.map((row) => row[i])]),
    }));
  }

  /** Engine orders with their numbers at the right. */
  orders(highest) {
    const speeds = this.outcome.figures.speed_hz;
    const many = Math.floor((0.97 * highest) / speeds.at(-1)); // a number further up would leave the chart
    const every = Math.max(1, Math.ceil(many / MOST_ORDERS));
    const numbers = [];
    for (let k = every; k <= many; k += every) numbers.push(k);
    const [first, last] = [speeds[0], speeds.at(-1)];
    return {
      traces: numbers.map((k, i) => ({
        x: [first, last].map((hz) => this.unit.of(hz)), y: [k * first, k * last], mode: "lines", name: "engine orders", legendgroup: "orders", showlegend: i === 0,
        line: { color: SERIES[0], width: 0.8, dash: "dot" },
      })),
      annotations: numbers.map((k) => ({
        x: this.unit.of(last), y: k * last, text: `EO ${k}`, showarrow: false, xanchor: "right", yanchor: "bottom", font: { size: 10, color: colour("link") }, bgcolor: colour("paper"), borderpad: 0,
      })),
    };
  }

  drawDeepest() {
    const { figures, nodes } = this.outcome;
    const peak = (i) => figures.peak_m[i][figures.tip_nodes.indexOf(nodes[this.j])] * MICRO;
    const worn = figures.deepest_m.map((row) => row[this.j] * MICRO);
    const moved = figures.speed_hz.map((_, i) => peak(i));
    const through = figures.speed_hz.map((_, i) => i).filter((i) => figures.worn_through[i]);
    const line = (y, name, at, dash) => ({ x: this.x, y, name, mode: "lines+markers", line: { color: SERIES[at], width: 1.4, dash }, marker: { size: 4, color: SERIES[at], symbol: at ? "diamond" : "circle" } });
    const traces = [line(worn, "deepest wear", 0, "solid"), line(moved, "largest displacement", 3, "dash"), this.unstableKey];
    if (through.length) traces.push({ x: through.map((i) => this.x[i]), y: through.map((i) => worn[i]), mode: "markers", name: "worn through, stopped there", marker: { symbol: "triangle-down", size: 10, color: colour("ink") } });
    this.deepest.draw(traces, { ...KEY_ABOVE, shapes: this.unstable(0, 1, 0.3), xaxis: this.axis, yaxis: { title: { text: "[µm]" }, rangemode: "tozero" } },
      `Under ${nodes[this.j]}: deepest wear ${number(Math.max(...worn), 3)} µm, largest displacement ${number(Math.max(...moved), 3)} µm.`,
      { header: [...this.header, "deepest_um", "peak_um", "worn_through"], rows: this.x.map((x, i) => [figures.speed_hz[i], x, worn[i], moved[i], figures.worn_through[i]]) });
  }

  drawLobes() {
    const { figures, nodes } = this.outcome;
    const count = figures.wear_lobes.map((row) => row[this.j]);
    const size = figures.lobe_amplitude_m.map((row) => row[this.j] * MICRO);
    const most = Math.max(...size, 1e-12);
    const expected = figures.chatter_hz.map((hz, i) => (figures.stable[i] === false && hz !== null ? hz / figures.speed_hz[i] : null));
    const traces = [
      { x: this.x, y: expected, mode: "markers", name: "chatter frequency over rotor speed (exact core)", marker: RING(colour("unstable-exact")) },
      { x: this.x, y: count, mode: "markers", name: "simulated wear lobes (larger: deeper)", marker: { color: SERIES[0], size: size.map((v) => 4 + 8 * Math.sqrt(v / most)) } },
    ];
    this.lobes.draw(traces, { ...KEY_ABOVE, shapes: this.unstable(0, 1, 0.2), xaxis: this.axis, yaxis: { title: { text: "lobes" }, rangemode: "tozero" } },
      `Under ${nodes[this.j]}: ${Math.min(...count)} to ${Math.max(...count)} lobes.`,
      { header: [...this.header, "wear_lobes", "lobe_amplitude_um", "chatter_over_speed_exact"], rows: this.x.map((x, i) => [figures.speed_hz[i], x, count[i], size[i], expected[i]]) });
  }

  scale() {
    return [[0, colour("paper")], [0.55, SERIES[0]], [1, colour("ink")]];
  }
}

const RING = (color) => ({ symbol: "circle-open", size: 8, color, line: { width: 1.6, color } });

const bar = (text) => ({ title: { text, side: "right" }, thickness: 14, outlinewidth: 0, xpad: 4 });

/** Half a step beyond the first and the last speed. */
function ends(x) {
  const half = x.length > 1 ? (x.at(-1) - x[0]) / (x.length - 1) / 2 : 1;
  return [x[0] - half, x.at(-1) + half];
}
