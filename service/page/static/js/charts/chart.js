/** What every chart has: colours of the theme, a title, a description, export as PNG, SVG and CSV. */

import { fill, h, say } from "../dom.js";

/** Colours that stay apart for the colour-blind (Okabe and Ito 2008), in either theme. */
export const SERIES = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8c8c8c"];
/** Dashes go with the colours, so that lines also differ in print. */
export const DASHES = ["solid", "dash", "dot", "dashdot", "longdash", "longdashdot", "solid"];

/** A colour of the page's style sheet. */
export const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

const CONFIG = { displayModeBar: false, displaylogo: false, doubleClick: "reset", scrollZoom: false };

export class Chart {
  /**
   * @param {{title: string, name: string, height?: number}} given `name` is that of exported files
   */
  constructor({ title, name, height = 440 }) {
    this.name = name;
    /** Of what design, in words: in the title of pictures and the names of files. */
    this.about = "";
    this.title = title;
    this.height = height;
    this.plot = h("div", { class: "plot", role: "img", "aria-label": `${title}. Nothing drawn yet.` });
    this.plot.style.height = `${height}px`;
    this.note = h("p", { class: "note" });
    this.heading = h("h3", {}, title);
    const button = (text, run, what) =>
      h("button", { type: "button", class: "small", onclick: run, "aria-label": `${title}: ${what}` }, text);
    this.tools = h(
      "div",
      { class: "chart-tools", role: "group", "aria-label": `Export ${title}` },
      button("PNG", () => this.save("png"), "save as PNG"),
      button("SVG", () => this.save("svg"), "save as SVG"),
      button("CSV", () => this.saveCsv(), "save the figures as CSV"),
    );
    this.element = h(
      "figure",
      { class: "chart" },
      h("figcaption", {}, this.heading, this.tools),
      this.plot,
      this.note,
    );
    this.drawn = false;
    this.csv = null;
    this.queue = Promise.resolve();
  }

  /** The layout that all charts share. */
  layout(more) {
    const axis = {
      gridcolor: colour("grid"),
      linecolor: colour("ink"),
      zeroline: false,
      showline: true,
      mirror: true,
      ticks: "outside",
      automargin: true,
    };
    const { xaxis, yaxis, ...rest } = more;
    return {
      font: { family: "system-ui, 'Segoe UI', 'DejaVu Sans', Arial, sans-serif", size: 13, color: colour("ink") },
      paper_bgcolor: colour("paper"),
      plot_bgcolor: colour("paper"),
      margin: { l: 64, r: 16, t: 12, b: 48 },
      showlegend: false,
      hovermode: false,
      dragmode: "zoom",
      autosize: true,
      height: this.height,
      xaxis: { ...axis, ...xaxis },
      yaxis: { ...axis, ...yaxis },
      ...rest,
    };
  }

  /**
   * Draw, in place of what was drawn before.
   * @param {Object[]} traces  @param {Object} layout  as plotly.js has them
   * @param {string} description for who does not see the chart
   * @param {{header: string[], rows: Array[]}|(() => {header, rows})} csv
   */
  draw(traces, layout, description, csv) {
    this.csv = csv;
    this.last = { traces, layout, description, csv };
    this.plot.setAttribute("aria-label", `${this.title}. ${description}`);
    // One after the other: plotly.js does not take a second drawing while the first is at work.
    this.queue = this.queue.then(async () => {
      if (!this.element.isConnected && this.drawn) return;
      if (!this.drawn) fill(this.plot);
      await Plotly.react(this.plot, traces, this.layout(layout), { ...CONFIG, responsive: true });
      this.drawn = true;
    });
    return this.queue;
  }

  /** Once more, as when the theme has changed; a chart whose colours are in its traces draws itself. */
  redraw() {
    if (this.last) this.draw(this.last.traces, this.last.layout, this.last.description, this.last.csv);
  }

  /** Take the drawing away; a message may stand in its place. */
  clear(message = "") {
    this.last = null;
    this.csv = null;
    this.queue = this.queue.then(() => {
      Plotly.purge(this.plot);
      fill(this.plot, message && h("p", { class: "empty" }, message));
      this.drawn = false;
    });
    this.plot.setAttribute("aria-label", `${this.title}. ${message || "Nothing drawn."}`);
  }

  /** Name of a file, without its ending: letters, digits and what every file system takes. */
  #file() {
    const words = [this.name, this.about].join(" ").replaceAll("×", "x").replaceAll("%", "percent");
    return words.normalize("NFKD").replace(/[^A-Za-z0-9.+_-]+/g, "_").replace(/^_+|_+$/g, "").slice(0, 120);
  }

  async save(format) {
    if (!this.last) return;
    const { clientWidth: width, clientHeight: height } = this.plot;
    const text = { ...this.layout(this.last.layout), title: { text: escaped([this.title, this.about].filter(Boolean).join(": ")), x: 0.02, font: { size: 14 } } };
    text.margin = { ...text.margin, t: 44 };
    const url = await Plotly.toImage(
      { data: this.plot.data, layout: { ...this.plot.layout, ...text, xaxis: this.plot.layout.xaxis, yaxis: this.plot.layout.yaxis } },
      { format, width, height: height + 32, scale: format === "png" ? 2 : 1 },
    );
    download(url, `${this.#file()}.${format}`);
    say(`${this.title} saved as ${format.toUpperCase()}`);
  }

  saveCsv() {
    const table = typeof this.csv === "function" ? this.csv() : this.csv;
    if (!table) return;
    saveTable(table, `${this.#file()}.csv`);
    say(`Figures of ${this.title} saved as CSV`);
  }
}

/** Text for plotly.js, which reads some markup. */
export const escaped = (text) => text.replaceAll("&", "&amp;").replaceAll("<", "&lt;").replaceAll(">", "&gt;");

/** Save a table as CSV (RFC 4180). */
export function saveTable({ header, rows }, name) {
  const cell = (value) => {
    const text = value === null || value === undefined || Number.isNaN(value) ? "" : String(value);
    // A spreadsheet would run what begins so.
    const safe = typeof value === "string" && /^[=+\-@\t\r]/.test(text) ? `'${text}` : text;
    return /[",\r\n]/.test(safe) ? `"${safe.replaceAll('"', '""')}"` : safe;
  };
  const lines = [header, ...rows].map((row) => row.map(cell).join(","));
  const url = URL.createObjectURL(new Blob([lines.join("\r\n"), "\r\n"], { type: "text/csv" }));
  download(url, name);
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}

export function download(url, name) {
  const link = h("a", { href: url, download: name });
  document.body.append(link);
  link.click();
  link.remove();
}
