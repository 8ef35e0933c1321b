/** Charts of several designs: boundaries over one another, the difference of two maps, bars of influences. */

import { number, stiffness } from "../format.js";
import { verdictName } from "./map_chart.js";
import { Chart, DASHES, SERIES, colour, escaped } from "./chart.js";

/** First crossings of every design over one another, the liner's K_e across them. */
export class BoundariesChart extends Chart {
  constructor() {
    super({ title: "Exact boundaries", name: "boundaries", height: 420 });
  }

  /** @param {{design, boundary}[]} found  */
  show(found, range, unit) {
    const traces = found.map(({ design, boundary }, i) => ({
      type: "scatter", mode: "lines", name: escaped(`${i + 1}  ${design.title}`), connectgaps: false,
      x: boundary.speed_hz.map((hz) => unit.of(hz)), y: boundary.critical_ke,
      line: { color: SERIES[i % SERIES.length], dash: DASHES[i % DASHES.length], width: 2 },
    }));
    const liner = range.ke_liner
      ? [{ type: "line", xref: "paper", x0: 0, x1: 1, y0: range.ke_liner, y1: range.ke_liner, line: { color: colour("link"), width: 2, dash: "dash" } }] : [];
    const layout = {
      xaxis: { title: { text: unit.title }, range: [unit.of(range.low_hz), unit.of(range.high_hz)] },
      yaxis: { title: { text: "Critical Kₑ [N/m]" }, range: [0, range.ke_max] },
      shapes: liner, showlegend: true, legend: { orientation: "h", y: -0.22, x: 0 },
      margin: { l: 64, r: 16, t: 12, b: 110 },
    };
    const told = found.map(({ design, boundary }) => `${design.title}: least ${stiffness(least(boundary.critical_ke))} on this grid`).join("; ");
    const { speed_hz } = found[0].boundary;
    return this.draw(traces, layout, `${told}.`, {
      header: ["speed_hz", ...found.map(({ design }) => `critical_ke ${design.title} [N/m]`)],
      rows: speed_hz.map((hz, i) => [hz, ...found.map(({ boundary }) => boundary.critical_ke[i])]),
    });
  }
}

const least = (values) => Math.min(...values.filter((value) => value !== null));

/** Where two designs differ: both stable, both unstable, the first alone, the second alone. */
export class DifferenceChart extends Chart {
  constructor() {
    super({ title: "Difference of two maps", name: "difference_map", height: 420 });
  }

  show(first, second, names, range, unit) {
    const width = first.speed_hz.length;
    const kinds = [0, 0, 0, 0];
    let decided = 0;
    const z = first.ke.map((_, i) => Array.from({ length: width }, (__, j) => {
      const [a, b] = [first.stable[i * width + j], second.stable[i * width + j]];
      if (Number.isNaN(a) || Number.isNaN(b)) return null;
      const kind = a ? (b ? 0 : 1) : b ? 2 : 3;
      kinds[kind] += 1;
      decided += 1;
      return kind;
    }));
    const colours = [colour("stable"), SERIES[1], SERIES[0], colour("unsure")];
    const steps = colours.flatMap((paint, i) => [[i / 4, paint], [(i + 1) / 4, paint]]);
    const trace = { type: "heatmap", z, x: first.speed_hz.map((hz) => unit.of(hz)), y: first.ke, zmin: -0.5, zmax: 3.5, colorscale: steps, showscale: false, hoverinfo: "none" };
    const share = (kind) => `${number((100 * kinds[kind]) / decided, 3)} %`;
    this.note.textContent = "";
    this.shares = [
      [colours[0], `both stable: ${share(0)}`], [colours[1], `${names[0]} stable, ${names[1]} not: ${share(1)}`],
      [colours[2], `${names[1]} stable, ${names[0]} not: ${share(2)}`], [colours[3], `both unstable: ${share(3)}`],
    ];
    const layout = {
      xaxis: { title: { text: unit.title }, range: [unit.of(range.low_hz), unit.of(range.high_hz)] },
      yaxis: { title: { text: "Cutting stiffness Kₑ [N/m]" }, range: [0, range.ke_max] },
    };
    return this.draw([trace], layout, this.shares.map(([, text]) => text).join("; "), () => ({
      header: ["speed_hz", "ke_n_per_m", names[0], names[1]],
      rows: first.ke.flatMap((ke, i) => first.speed_hz.map((hz, j) => [hz, ke, verdictName(first.stable[i * width + j]), verdictName(second.stable[i * width + j])])),
    }));
  }
}

/** d ln K_e / d ln parameter at a design's deepest lobe, the strongest influences first. */
export class InfluencesChart extends Chart {
  constructor() {
    super({ title: "What moves the smallest Kₑ", name: "sensitivities", height: 420 });
  }

  /** @param {{parameter: string, relative: number, needed: number|null}[]} bars */
  show(bars, title) {
    const shown = [...bars].reverse();
    const trace = {
      type: "bar", orientation: "h", x: shown.map(({ relative }) => relative), y: shown.map(({ parameter }) => escaped(parameter)),
      marker: { color: shown.map(({ relative }) => (relative >= 0 ? SERIES[0] : SERIES[1])) },
      text: shown.map(({ relative }) => number(relative, 3)), textposition: "outside", cliponaxis: false,
    };
    const reach = 1.25 * Math.max(...bars.map(({ relative }) => Math.abs(relative)));
    const layout = {
      xaxis: { title: { text: "Change of Kₑ in % for 1 % more of the parameter" }, range: [-reach, reach], zeroline: true, zerolinecolor: colour("ink") },
      yaxis: { automargin: true, showgrid: false },
    };
    this.note.textContent = title;
    return this.draw([trace], layout, bars.slice(0, 3).map(({ parameter, relative }) => `${parameter} ${number(relative, 3)}`).join(", "), {
      header: ["parameter", "dlnke_dlnp", "change_needed"], rows: bars.map((bar) => [bar.parameter, bar.relative, bar.needed]),
    });
  }
}
