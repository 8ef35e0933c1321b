/** Campbell diagram: natural frequencies and engine orders over rotor speed, with where the lobes chatter. */

import { number } from "../format.js";
import { Chart, DASHES, SERIES, colour } from "./chart.js";
import { Crosshair } from "./crosshair.js";

export class CampbellChart extends Chart {
  constructor({ height = 500 } = {}) {
    super({ title: "Campbell diagram", name: "campbell_diagram", height });
    this.cross = new Crosshair(this.plot);
    this.parts = {};
  }

  /** Parts that are given take the place of those before: campbell, lobes, range, unit, chosen. */
  show(parts) {
    Object.assign(this.parts, parts);
    const { campbell, lobes, range, unit, chosen } = this.parts;
    if (!campbell) return Promise.resolve();
    const x = campbell.speed_hz.map((hz) => unit.of(hz));
    const modes = campbell.frequency_hz[0].length;
    const column = (j) => campbell.frequency_hz.map((row) => row[j]);
    const top = 1.08 * Math.max(...column(modes - 1));
    const lobe = chosen === null || chosen === undefined ? null : lobes?.[chosen];
    const near = lobe ? [Math.floor(lobe.tip.lobes_per_revolution), Math.ceil(lobe.tip.lobes_per_revolution)] : [];
    const orders = [...new Set([...campbell.engine_orders, ...near])];
    const traces = [
      ...orders.map((order) => orderLine(order, range, unit, near.includes(order))),
      ...Array.from({ length: modes }, (_, j) => ({
        type: "scatter", mode: "lines", x, y: column(j),
        line: { color: SERIES[j % SERIES.length], dash: DASHES[j % DASHES.length], width: lobe?.mode === j + 1 ? 4 : 2 },
      })),
      crossings(campbell, unit),
      ...chatter(lobes, unit, chosen),
    ];
    const layout = {
      uirevision: `${range.low_hz} ${range.high_hz} ${unit.name}`,
      xaxis: { title: { text: unit.title }, range: [unit.of(range.low_hz), unit.of(range.high_hz)] },
      yaxis: { title: { text: "Frequency [Hz]" }, range: [0, top] },
      annotations: [
        ...Array.from({ length: modes }, (_, j) => ({
          x: x[0], xanchor: "left", y: column(j)[0], yanchor: "bottom", showarrow: false,
          text: `mode ${j + 1}`, font: { color: colour("ink"), size: 12 }, bgcolor: colour("paper"), opacity: 0.85,
        })),
        ...orders.filter((order) => order % 2 === 0 || near.includes(order)).map((order) => orderName(order, range, unit, top)),
      ],
    };
    this.note.textContent = lobe
      ? `Lobe ${chosen + 1}: mode ${lobe.mode} chatters at ${number(lobe.tip.chatter_hz)} Hz with ` +
        `${number(lobe.tip.lobes_per_revolution)} wear lobes round the casing, between engine orders ${near.join(" and ")}.`
      : "Dots are where the lobes chatter; ○ are where engine orders meet a mode. Choose a lobe in the table to see its mode and orders.";
    const range_ = `${number(column(0)[0])} to ${number(column(0).at(-1))} Hz`;
    return this.draw(traces, layout, `${modes} modes, the first from ${range_}; engine orders 1 to ${Math.max(...orders)}.`, {
      header: ["speed_hz", ...Array.from({ length: modes }, (_, j) => `mode_${j + 1}_hz`)],
      rows: campbell.speed_hz.map((hz, i) => [hz, ...campbell.frequency_hz[i]]),
    });
  }

  /** Natural frequencies at a speed, by linear interpolation of what is drawn, Hz. */
  frequenciesAt(speed_hz) {
    const { campbell } = this.parts;
    if (!campbell) return null;
    const { speed_hz: speeds, frequency_hz: rows } = campbell;
    const last = speeds.length - 1;
    const at = Math.max(0, Math.min(last, ((speed_hz - speeds[0]) / (speeds[last] - speeds[0])) * last));
    const [low, share] = [Math.min(Math.floor(at), last - 1), at - Math.min(Math.floor(at), last - 1)];
    return rows[low].map((value, j) => value + share * (rows[low + 1][j] - value));
  }
}

function orderLine(order, range, unit, near) {
  return {
    type: "scatter", mode: "lines", x: [unit.of(range.low_hz), unit.of(range.high_hz)],
    y: [order * range.low_hz, order * range.high_hz],
    line: { color: near ? colour("cursor") : colour("line"), width: near ? 2.5 : 1 },
  };
}

/** At the end of the order's line that is inside the diagram. */
function orderName(order, range, unit, top) {
  const leaves = order * range.high_hz > top;
  const hz = leaves ? top / order : range.high_hz;
  return {
    x: unit.of(hz), y: leaves ? top : order * range.high_hz, xanchor: "right", yanchor: leaves ? "top" : "bottom",
    showarrow: false, text: `${order}`, font: { size: 10, color: colour("soft") }, visible: hz > range.low_hz * 1.02,
  };
}

function crossings(campbell, unit) {
  return {
    type: "scatter", mode: "markers", x: campbell.crossings.map((c) => unit.of(c.speed_hz)),
    y: campbell.crossings.map((c) => c.frequency_hz),
    marker: { symbol: "circle-open", size: 7, color: colour("ink") },
  };
}

function chatter(lobes, unit, chosen) {
  if (!lobes) return [];
  return [{
    type: "scatter", mode: "markers", x: lobes.map(({ tip }) => unit.of(tip.speed_hz)),
    y: lobes.map(({ tip }) => tip.chatter_hz),
    marker: {
      size: lobes.map((_, i) => (i === chosen ? 14 : 6)),
      color: lobes.map(({ mode }, i) => (i === chosen ? colour("cursor") : SERIES[(mode - 1) % SERIES.length])),
      line: { color: colour("paper"), width: 1 },
    },
  }];
}
