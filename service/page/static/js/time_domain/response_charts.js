/** Charts of one speed: motion, force, growth, energy, spectrum, and what is left of the liner. */

import { Chart, DASHES, SERIES, colour, escaped } from "../charts/chart.js";
import { number } from "../format.js";
import { growthWords } from "./verdict.js";

const MICRO = 1e6;
const MILLI = 1e3;
const STRETCHES = 1500; // as many as can be told apart across a screen

const KEY_ABOVE = { showlegend: true, legend: { orientation: "h", traceorder: "normal", x: 0, y: 1.02, yanchor: "bottom" }, margin: { l: 64, r: 16, t: 34, b: 48 } };

export class ResponseCharts {
  constructor() {
    const chart = (name, title, note) => {
      const made = new Chart({ title, name: `rub-${name}`, height: 300 });
      made.note.textContent = note;
      return made;
    };
    this.growth = chart("growth", "Growth of the vibration",
      "Change of the tip's motion from one revolution to the next (RMS): what repeats each revolution cancels. A straight line is growth at a constant rate; the exact core's is the slope to compare.");
    this.moved = chart("displacement", "Tip displacement", "Of each contact node in the contact direction, outward positive: least and largest in each short stretch of time.");
    this.near = chart("displacement-near", "Two revolutions about the largest displacement", "The same, each sample.");
    this.force = chart("force", "Contact force", "What the liner presses with on each contact node, least and largest of each stretch. Contact is one-sided: it never pulls, and 0 is a tip off the liner.");
    this.spectrum = chart("spectrum", "Spectrum at the end", "Amplitude of the first contact node's vibration over the last revolutions (20 at most), beside the natural frequencies and the exact core's chatter.");
    this.profile = chart("worn-profile", "Worn liner round the casing", "Depth cut away under each contact node, unrolled: the grey below is the liner that is left. What is worn once stays worn.");
    this.energy = chart("energy", "Energy account", "What the contact has put into the blade, what damping and friction have taken, and what the blade holds: contact that feeds the blade is what chatter lives on.");
    this.all = [this.growth, this.moved, this.profile, this.force, this.near, this.spectrum, this.energy];
  }

  /** @param {Outcome} outcome  @param {{change, fitted, end}} motion of growth.js */
  draw(outcome, motion) {
    this.outcome = outcome;
    this.motion = motion;
    this.drawGrowth();
    this.drawBands(this.moved, "displacement", "tip displacement [µm]", MICRO);
    this.drawBands(this.force, "force", "contact force [N]", 1);
    this.drawNear();
    this.drawSpectrum();
    this.drawProfile();
    this.drawEnergy();
  }

  redraw() {
    if (this.outcome) this.draw(this.outcome, this.motion);
  }

  drawGrowth() {
    const { change, fitted } = this.motion;
    const turns = Array.from(change, (_, q) => q + 1);
    const exact = this.outcome.figures.growth_per_revolution[0];
    const traces = [{
      x: turns, y: Array.from(change, (value) => value * MICRO || null), name: "simulation", mode: "lines+markers",
      line: { color: SERIES[0], width: 1 }, marker: { color: SERIES[0], size: 4 },
    }];
    let said = "No growth is fitted: contact was not kept long enough.";
    if (fitted) {
      const along = [fitted.first, fitted.last];
      const slope = (growth, name, at, dash) => ({
        x: along.map((q) => q + 1), y: along.map((q) => Math.exp(fitted.level + growth * (q - fitted.first)) * MICRO), name, mode: "lines",
        line: { color: SERIES[at], width: 3, dash },
      });
      traces.push(slope(fitted.growth, "fitted while contact is kept", 1, "solid"));
      if (exact !== null) traces.push(slope(exact, "slope by the exact core", 2, "dash"));
      said = `Fitted: ${growthWords(fitted.growth)}; exact core: ${growthWords(exact)}.`;
    }
    this.growth.draw(traces, {
      ...KEY_ABOVE, xaxis: { title: { text: "revolution" } }, yaxis: { title: { text: "change in a revolution [µm]" }, ...decades(...ends(change)) },
    }, said, { header: ["revolution", "change_um"], rows: turns.map((turn, q) => [turn, change[q] * MICRO]) });
  }

  drawBands(chart, what, title, factor) {
    const { response, nodes } = this.outcome;
    const found = nodes.map((_, j) => stretches(response, response[what][j]));
    const traces = nodes.flatMap((node, j) => {
      const { turns, low, high } = found[j];
      const edge = { x: turns, mode: "lines", line: { color: SERIES[j % SERIES.length], width: 0.6 }, legendgroup: node };
      return [
        { ...edge, y: low.map((v) => v * factor), showlegend: false },
        { ...edge, y: high.map((v) => v * factor), name: escaped(node), fill: "tonexty", fillcolor: `${SERIES[j % SERIES.length]}66` },
      ];
    });
    const peak = found.map(({ low, high }) => Math.max(...high.map(Math.abs), ...low.map(Math.abs)) * factor);
    chart.draw(traces, { ...KEY_ABOVE, xaxis: { title: { text: "revolutions" } }, yaxis: { title: { text: title } } },
      nodes.map((node, j) => `${node}: at most ${number(peak[j], 3)}`).join("; "),
      () => ({
        header: ["revolutions", ...nodes.flatMap((node) => [`${node} least ${title}`, `${node} largest ${title}`])],
        rows: found[0].turns.map((turn, i) => [turn, ...found.flatMap(({ low, high }) => [low[i] * factor, high[i] * factor])]),
      }));
  }

  drawNear() {
    const { response, nodes } = this.outcome;
    const many = Math.min(2 * response.perRevolution, response.samples);
    const from = Math.min(Math.max(largest(response) - response.perRevolution, 0), response.samples - many);
    const x = Array.from({ length: many }, (_, i) => response.turn(from + i));
    const y = response.displacement.map((all) => Array.from(all.subarray(from, from + many), (v) => v * MICRO));
    const traces = nodes.map((node, j) => ({ x, y: y[j], name: escaped(node), mode: "lines", line: { color: SERIES[j % SERIES.length], dash: DASHES[j % DASHES.length], width: 1.2 } }));
    this.near.draw(traces, { ...KEY_ABOVE, xaxis: { title: { text: "revolutions" } }, yaxis: { title: { text: "tip displacement [µm]" } } },
      `Revolutions ${number(x[0], 4)} to ${number(x.at(-1), 4)}.`,
      () => ({ header: ["revolutions", ...nodes.map((node) => `${node} displacement_um`)], rows: x.map((turn, i) => [turn, ...y.map((column) => column[i])]) }));
  }

  drawSpectrum() {
    const { figures, frequency, spectrum: [row] } = this.outcome;
    const y = Array.from(row, (v) => v * MICRO);
    const top = Math.max(...y);
    const natural = figures.natural_hz[0];
    const chatter = figures.chatter_hz[0];
    const vertical = (hz, name, look) => ({ x: [hz, hz], y: [top * 1e-6, top * 2], name, mode: "lines", line: look });
    const traces = [
      ...natural.map((hz, j) => ({ ...vertical(hz, "natural frequencies", { color: colour("soft"), width: 1, dash: "dot" }), showlegend: j === 0, legendgroup: "natural" })),
      { x: Array.from(frequency), y, name: "simulation", mode: "lines", line: { color: SERIES[0], width: 1 } },
    ];
    if (chatter !== null) traces.push(vertical(chatter, figures.stable[0] === false ? "chatter, exact core" : "least damped, exact core", { color: SERIES[1], width: 1.6, dash: "dash" }));
    this.spectrum.draw(traces, {
      ...KEY_ABOVE, xaxis: { title: { text: "frequency [Hz]" }, range: [0, frequency.at(-1)] },
      yaxis: { title: { text: "amplitude [µm]" }, ...decades(top * 1e-5, top) },
    }, `Strongest at ${number(figures.strongest_hz[0])} Hz.`,
    { header: ["frequency_hz", "amplitude_um"], rows: Array.from(frequency, (hz, i) => [hz, y[i]]) });
  }

  drawProfile() {
    const { nodes, angle, figures } = this.outcome;
    const degrees = Array.from(angle, (a) => (a * 180) / Math.PI);
    const depth = nodes.map((_, j) => Array.from(this.outcome.worn(0, j), (v) => v * MICRO));
    const [least, deepest] = [Math.min, Math.max].map((pick) => depth.flat().reduce((a, b) => pick(a, b)));
    // Of a liner cut evenly the lobes would not be seen from its old surface down.
    const top = least > 0.5 * deepest ? least - 0.4 * (deepest - least) : 0;
    const bottom = deepest > 0 ? deepest + 0.12 * (deepest - top) : 1;
    const most = depth[0].map((_, i) => Math.max(...depth.map((d) => d[i])));
    const traces = [
      { x: degrees, y: most, mode: "lines", line: { width: 0 }, showlegend: false },
      { x: degrees, y: degrees.map(() => bottom), mode: "lines", line: { width: 0 }, fill: "tonexty", fillcolor: colour("grid"), showlegend: false },
      ...nodes.map((node, j) => ({ x: degrees, y: depth[j], name: escaped(node), mode: "lines", line: { color: SERIES[j % SERIES.length], dash: DASHES[j % DASHES.length], width: 1.2 } })),
    ];
    this.profile.draw(traces, {
      ...KEY_ABOVE, xaxis: { title: { text: "angle round the casing [°]" }, range: [0, 360], tick0: 0, dtick: 45 }, yaxis: { title: { text: "worn depth [µm]" }, range: [bottom, top] },
    }, nodes.map((node, j) => `${node}: ${figures.wear_lobes[0][j]} lobes, deepest ${number(figures.deepest_m[0][j] * MICRO, 3)} µm`).join("; "),
    () => ({ header: ["angle_deg", ...nodes.map((node) => `${node} worn_um`)], rows: degrees.map((a, i) => [a, ...depth.map((d) => d[i])]) }));
  }

  drawEnergy() {
    const { response: r } = this.outcome;
    const turns = Array.from(r.energy, (_, q) => q + 1);
    const kinds = [["work of contact", r.contact, 1], ["lost to damping", r.damping, -1], ["lost to friction", r.friction, -1], ["held by the blade", r.energy, 1]];
    const shown = kinds.filter(([, values]) => values.some((v) => v !== 0));
    const traces = shown.map(([name, values, sign], i) => ({
      x: turns, y: Array.from(values, (v) => sign * v * MILLI), name, mode: "lines", line: { color: SERIES[i], dash: DASHES[i], width: 1.6 },
    }));
    this.energy.draw(traces, { ...KEY_ABOVE, xaxis: { title: { text: "revolutions" } }, yaxis: { title: { text: "energy [mJ]" } } },
      shown.map(([name, values, sign]) => `${name}: ${number(sign * values.at(-1) * MILLI, 3)} mJ`).join("; "),
      { header: ["revolution", ...kinds.map(([name]) => `${name} [mJ]`)], rows: turns.map((turn, q) => [turn, ...kinds.map(([, values, sign]) => sign * values[q] * MILLI)]) });
  }
}

/** A logarithmic axis; superscripts are characters, since plotly.js would style its own against the page's policy. */
function decades(low, high) {
  const [from, to] = high > 0 ? [Math.log10(low) - 0.2, Math.log10(high) + 0.2] : [-6, 0];
  const every = Math.max(1, Math.ceil((to - from) / 8));
  const powers = [];
  for (let power = Math.ceil(from / every) * every; power <= to; power += every) powers.push(power);
  return { type: "log", range: [from, to], tickvals: powers.map((power) => 10 ** power), ticktext: powers.map(powerOfTen) };
}

const powerOfTen = (power) => (Math.abs(power) < 3 ? String(Number((10 ** power).toPrecision(1))) : `10${String(power).replace(/[-0-9]/g, (c) => (c === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[c]))}`);

/** Least and largest change, µm, of those that are. */
function ends(change) {
  const some = Array.from(change, (value) => value * MICRO).filter((value) => value > 0);
  return some.length ? [Math.min(...some), Math.max(...some)] : [0, 0];
}

/** Least and largest of each stretch of time. */
function stretches(response, values) {
  const together = Math.max(1, Math.ceil(values.length / STRETCHES));
  const [turns, low, high] = [[], [], []];
  for (let i = 0; i < values.length; i += together) {
    const part = values.subarray(i, i + together);
    turns.push(response.turn(i + part.length - 1));
    low.push(part.reduce((a, b) => Math.min(a, b)));
    high.push(part.reduce((a, b) => Math.max(a, b)));
  }
  return { turns, low, high };
}

/** Sample of the largest displacement. */
function largest({ displacement }) {
  let [best, at] = [-1, 0];
  for (const x of displacement) x.forEach((v, i) => Math.abs(v) > best && ([best, at] = [Math.abs(v), i]));
  return at;
}
