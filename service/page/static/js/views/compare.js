/** Two or more designs or contacts side by side: which is safer, where they differ, what would gain margin. */

import { askBoundary, askMap, evenly, evenlyTimed } from "../answers.js";
import { BoundariesChart, DifferenceChart, InfluencesChart } from "../charts/comparison_charts.js";
import { saveTable } from "../charts/chart.js";
import { Design } from "../design/design.js";
import { fill, fresh, h, say } from "../dom.js";
import { number, percent, stiffness } from "../format.js";
import { Problem, Unreachable, ask, events } from "../service.js";
import { unstableShareAt } from "./explorer_findings.js";
import { Influences } from "./compare_influences.js";

/** Speeds of a boundary; with arcs of contact each takes some 20 ms of the exact core. */
const SPEEDS = { permanent: 300, arcs: 61 };
const GRID = [160, 120];

export class CompareView {
  /** @param {import("../app.js").App} app */
  constructor(app) {
    this.app = app;
    this.boundaries = new BoundariesChart();
    this.difference = new DifferenceChart();
    this.influences = new Influences(app, new InfluencesChart());
    this.verdict = h("p", { class: "verdict", role: "status" });
    this.problem = h("div", { role: "alert" });
    this.table = h("div", { class: "scroll", tabIndex: 0, role: "region", "aria-label": "Designs compared" });
    this.shares = h("ul", { class: "key", "aria-label": "Key of the difference map" });
    this.pair = h("div", { class: "row" });
    this.known = new Map();
    this.element = h("section", { class: "compare", "aria-labelledby": "compare-title" },
      h("h2", { id: "compare-title" }, "Compare"),
      this.#adding(), this.problem,
      h("div", { class: "findings" }, this.verdict), this.table,
      h("div", { class: "halves" }, this.boundaries.element, h("div", {}, this.pair, this.difference.element, this.shares)),
      this.influences.element);
    app.onChange((what) => {
      if (!this.shown) return;
      if (what === "designs") this.#ask();
      else if (what === "unit" || what === "theme") this.#draw();
    });
    events.addEventListener("back", () => this.shown && this.#ask());
  }

  #adding() {
    const blade = h("select", { id: fresh("add") });
    const contact = h("select", { id: fresh("add") },
      [["both", "both edges"], ["first", "leading edge"], ["last", "trailing edge"], ["same", "as in the explorer"]].map(([value, text]) => h("option", { value }, text)));
    this.blades = blade;
    this.ranges = h("select", { id: fresh("add"), onchange: () => {
      this.rangeChosen = true;
      this.#ask();
    } },
      h("option", { value: "own" }, "each blade’s own (30 to 105 % of its design speed)"), h("option", { value: "shared" }, "that of the explorer"));
    const add = () => {
      const made = new Design(this.#choices()[blade.selectedIndex].base, { profile: this.#choices()[blade.selectedIndex].profile });
      const touching = { both: [0, -1], first: [0], last: [-1] }[contact.value];
      if (touching) {
        const names = touching.map((i) => made.nodes.at(i));
        made.weights = Object.fromEntries(made.nodes.map((node) => [node, names.includes(node) ? 1 : 0]));
      } else {
        const { weights, arcs } = this.app.active;
        if (made.nodes.some((node) => weights[node] > 0)) made.weights = Object.fromEntries(made.nodes.map((node) => [node, weights[node] ?? 0]));
        made.arcs = structuredClone(arcs);
      }
      this.app.designs.push(made);
      say(`${made.title} added`);
      this.app.changed("designs");
    };
    return h("div", { class: "row no-print" },
      h("label", { for: blade.id }, "Add"), blade, h("label", { for: contact.id }, "touching with"), contact,
      h("button", { type: "button", class: "primary", onclick: add }, "Add to the comparison"),
      h("label", { for: this.ranges.id }, "Speeds"), this.ranges);
  }

  /** Blades that can be added: shipped ones, and those of the designs there are. */
  #choices() {
    const { blades } = this.app.examples;
    const own = this.app.designs.filter(({ base }) => !Object.values(blades).includes(base));
    const known = [...new Map(own.map((design) => [design.label, design])).values()];
    return [
      ...Object.values(blades).map((base) => ({ base, profile: null })),
      ...known.map(({ base, profile }) => ({ base, profile })),
    ];
  }

  show() {
    this.shown = true;
    this.#ask();
  }

  hide() {
    this.shown = false;
    this.asking?.abort();
  }

  /** Rotor speeds that a design is looked at over, Hz; null where its modal data do not reach them at all. */
  #rangeOf(design) {
    if (this.ranges.value === "own") return design.usualRange();
    const [least, most] = design.coveredRange();
    const { low_hz, high_hz } = this.app.range;
    const [low, high] = [Math.max(low_hz, least), Math.min(high_hz, most)];
    return low < high * 0.999 ? [low, high] : null;
  }

  async #ask() {
    const { distinct: designs, examples } = this.app;
    this.asking?.abort();
    this.asking = new AbortController();
    const { signal } = this.asking;
    fill(this.problem);
    fill(this.blades, this.#choices().map(({ base }) => h("option", {}, Object.values(examples.blades).includes(base) ? base.name : `${base.name} (loaded)`)));
    // Different blades run at different speeds; one blade changed is looked at where it was in the explorer.
    if (!this.rangeChosen) this.ranges.value = new Set(designs.map(({ base }) => base)).size > 1 ? "own" : "shared";
    this.found = [];
    this.#draw();
    for (const design of designs) {
      const range = this.#rangeOf(design);
      if (!range || !design.touches) {
        this.found.push({ design, range, why: range ? "no node touches" : "its modal data do not reach these speeds" });
        continue;
      }
      try {
        // One design after the other: each uses what cores there are.
        const answer = await this.#answerOf(design, range, signal);
        if (signal.aborted) return;
        this.found.push({ design, range, ...answer });
      } catch (error) {
        if (error.name === "AbortError" || error instanceof Unreachable) return;
        if (!(error instanceof Problem)) throw error;
        this.found.push({ design, range, why: `${error.field} = ${error.value}: ${error.remedy}` });
      }
      this.#draw();
    }
    this.#draw();
  }

  async #answerOf(design, [low, high], signal) {
    const { blade, contact } = design;
    const { ke_max, ke_liner } = this.app.range;
    const name = JSON.stringify([blade, contact, low, high, ke_max, ke_liner]);
    if (this.known.has(name)) return this.known.get(name);
    const speeds = contact.arcs ? SPEEDS.arcs : SPEEDS.permanent;
    const boundary = await askBoundary({ blade, contact, speed_hz: evenlyTimed(low, high, speeds), ke_max, policy: "exact" }, signal);
    // With arcs the exact edges in speed would take minutes: there the share is that of the boundary's speeds.
    const liner = ke_liner && !contact.arcs ? { ke_liner } : {};
    const { lobes, unstable_share } = await ask("v1/lobes", { blade, contact, speed_range_hz: [low, high], ke_max, count: 1, ...liner }, { signal });
    const grid = { speed_hz: evenly(low, high, GRID[0]), ke: evenly(0, ke_max, GRID[1]) };
    const map = await askMap({ blade, contact, ...grid, policy: "auto" }, signal);
    const damping = ke_liner && !contact.arcs ? await ask("v1/damping", { blade, contact, speed_range_hz: [low, high], ke: ke_liner }, { signal }) : null;
    const answer = { boundary, worst: lobes[0] ?? null, map, damping, unstable: unstable_share ?? (ke_liner ? unstableShareAt(boundary, ke_liner) : null) };
    this.known.set(name, answer);
    return answer;
  }

  #draw() {
    const { range, unit } = this.app;
    const whole = this.found.filter(({ boundary }) => boundary);
    const waiting = this.app.distinct.length - this.found.length;
    fill(this.verdict, this.#verdict(whole, waiting));
    fill(this.table, this.#rows());
    if (whole.length) {
      const span = { ...range, low_hz: Math.min(...whole.map((one) => one.range[0])), high_hz: Math.max(...whole.map((one) => one.range[1])) };
      this.boundaries.show(whole, span, unit);
    }
    this.#drawDifference(whole);
    this.influences.show(whole, waiting > 0);
  }

  #verdict(whole, waiting) {
    const { ke_liner: ke } = this.app.range;
    if (waiting) return `Asking the exact core: ${waiting} to go…`;
    if (whole.length < 2) return "One design so far: add another above, or keep one in the explorer and change it.";
    if (!ke) return "Give the liner’s Kₑ in the explorer to compare margins.";
    const least = ({ worst }) => worst?.tip.ke ?? Infinity;
    const order = [...whole].sort((a, b) => least(b) - least(a));
    const [best, worst] = [order[0], order.at(-1)];
    if (least(best) === least(worst)) return `None of them has a lobe below ${stiffness(this.app.range.ke_max)}: look at larger Kₑ.`;
    const told = (one) => (least(one) > ke ? `stays stable at ${stiffness(ke)} at every speed` : `chatters at ${stiffness(ke)} in ${percent(one.unstable)} of its speeds`);
    return [h("strong", {}, `Safest: ${best.design.title}`), ` (${told(best)}). `, h("strong", {}, `Least safe: ${worst.design.title}`), ` (${told(worst)}).`];
  }

  #rows() {
    const { unit, range } = this.app;
    const heading = (text, n = true) => h("th", { scope: "col", class: n ? "n" : "" }, text);
    const liner = range.ke_liner;
    const row = (design, i) => {
      const one = this.found.find((found) => found.design === design);
      const { worst, damping, why, unstable } = one ?? {};
      const active = design.sameness === this.app.active.sameness;
      const edit = h("button", { type: "button", class: "small", "aria-label": `Open ${design.title} in the explorer`, onclick: () => {
        this.app.open(design);
        this.app.go("explorer");
      } }, active ? "In the explorer" : "Explore");
      const remove = h("button", { type: "button", class: "small", "aria-label": `Remove ${design.title}`, disabled: this.app.distinct.length < 2, onclick: () => this.app.remove(design) }, "Remove");
      const name = h("th", { scope: "row" }, `${i + 1}  ${design.title}`);
      const actions = h("td", { class: "no-print" }, edit, " ", remove);
      if (why) return h("tr", {}, name, h("td", { colspan: 7 }, why), actions);
      const cell = (text) => h("td", { class: "n" }, one ? text : "…");
      const over = `> ${number(range.ke_max)}`;
      return h("tr", {}, name,
        cell(worst ? number(worst.tip.ke) : over),
        cell(!liner ? "–" : worst ? margin(worst.tip.ke / liner - 1) : "none found"),
        cell(worst ? number(unit.of(worst.tip.speed_hz)) : "–"), cell(worst ? worst.mode : "–"), cell(worst ? number(worst.tip.chatter_hz) : "–"),
        cell(unstable === null ? "–" : percent(unstable)),
        cell(damping ? `× ${number(damping.factor, 3)}` : "–"), actions);
    };
    const headings = ["Smallest Kₑ [N/m]", "Margin", `Worst speed [${unit.symbol}]`, "Mode", "Chatter [Hz]", "Unstable speeds", "Damping needed"];
    return [
      h("table", {},
        h("caption", {}, liner ? `Designs at the liner’s Kₑ of ${stiffness(liner)}, by the exact core ` : "Designs, by the exact core ", h("button", { type: "button", class: "small no-print", onclick: () => this.#save() }, "CSV")),
        h("thead", {}, h("tr", {}, heading("Design", false), headings.map((text) => heading(text)), h("td", { class: "no-print" }))),
        h("tbody", {}, this.app.distinct.map(row))),
    ];
  }

  #save() {
    saveTable({
      header: ["design", "smallest_ke_n_per_m", "worst_speed_hz", "mode", "chatter_hz", "unstable_share_at_liner", "damping_factor_needed", "from_hz", "to_hz"],
      rows: this.found.map(({ design, range, worst, unstable, damping }) => [
        design.title, worst?.tip.ke, worst?.tip.speed_hz, worst?.mode, worst?.tip.chatter_hz, unstable, damping?.factor, range?.[0], range?.[1],
      ]),
    }, "comparison.csv");
  }

  /** Of two designs over speeds that both have. */
  #drawDifference(whole) {
    if (whole.length < 2) {
      fill(this.pair);
      fill(this.shares);
      this.difference.clear(this.found.length < this.app.distinct.length ? "Asking the exact core…" : "Two designs are needed.");
      return;
    }
    const [a, b] = [this.first ?? 0, this.second ?? 1].map((i, place) => whole[i] ?? whole[place]);
    const choice = (chosen, set) => {
      const id = fresh("pair");
      return [h("label", { for: id, class: "hidden" }, "Design of the difference map"), h("select", { id, onchange: (event) => {
        set(event.target.selectedIndex);
        this.#drawDifference(whole);
      } }, whole.map(({ design }) => h("option", { selected: design === chosen.design }, `${this.app.distinct.indexOf(design) + 1}  ${design.title}`)))];
    };
    fill(this.pair, whole.length > 2 ? [choice(a, (i) => { this.first = i; }), "against", choice(b, (i) => { this.second = i; })] : null);
    this.#difference(a, b);
  }

  async #difference(a, b) {
    const [low, high] = [Math.max(a.range[0], b.range[0]), Math.min(a.range[1], b.range[1])];
    const { range, unit } = this.app;
    const names = [a, b].map(({ design }) => `design ${this.app.distinct.indexOf(design) + 1}`);
    if (low >= high) {
      fill(this.shares);
      return this.difference.clear("The two have no rotor speed in common.");
    }
    try {
      const grid = { speed_hz: evenly(low, high, GRID[0]), ke: evenly(0, range.ke_max, GRID[1]) };
      const same = ({ range: own }) => own[0] === low && own[1] === high;
      const mapOf = async (one) => (same(one) ? one.map : askMap({ blade: one.design.blade, contact: one.design.contact, ...grid, policy: "auto" }, this.asking.signal));
      const [first, second] = [await mapOf(a), await mapOf(b)];
      await this.difference.show(first, second, names, { ...range, low_hz: low, high_hz: high }, unit);
      fill(this.shares, this.difference.shares.map(([paint, text]) => {
        const patch = h("span", { class: "patch", "aria-hidden": "true" });
        patch.style.background = paint;
        return h("li", {}, patch, text);
      }));
    } catch (error) {
      if (error.name !== "AbortError" && !(error instanceof Unreachable) && !(error instanceof Problem)) throw error;
      if (error instanceof Problem) fill(this.problem, h("p", { class: "problem" }, `${error.field} = ${error.value}: ${error.remedy}`));
    }
  }
}

const margin = (share) => `${share >= 0 ? "+" : "−"}${percent(Math.abs(share))}`;
