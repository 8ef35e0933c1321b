/** The answer in words: safe or not at the liner's K_e, where it is worst, in which mode, what would mend it. */

import { unstableShare } from "../charts/map_chart.js";
import { fill, h } from "../dom.js";
import { number, percent, stiffness } from "../format.js";

/** A factor on damping this near to 1 is none. */
const ENOUGH = 5e-3;
/** Share of the range of speeds. */
const NEAR_THE_END = 0.01;

export class Findings {
  /** @param {import("../app.js").App} app  @param {{onDamping: (factor: number) => void, onSearch: () => void}} does */
  constructor(app, { onDamping, onSearch }) {
    this.app = app;
    this.onSearch = onSearch;
    this.onDamping = onDamping;
    this.known = {};
    this.verdict = h("p", { class: "verdict" });
    this.details = h("ul", { class: "found" });
    this.state = h("p", { class: "note" });
    this.problem = h("div", { role: "alert" });
    this.element = h("section", { class: "findings", "aria-label": "Answer" }, this.verdict, this.details, this.problem, this.state);
  }

  /** What is given takes the place of what was known: map, boundary, lobes, unstable, damping, outside, problem, busy. */
  show(found) {
    Object.assign(this.known, found);
    const { problem, outside } = this.known;
    fill(this.problem, problem && h("p", { class: "problem" },
      problem.field ? [h("strong", {}, `${problem.title}. `), `${problem.field} = ${problem.value}: ${problem.remedy}`] : problem.message));
    fill(this.verdict, ...this.#verdict());
    fill(this.details, this.#worst(), this.#mend());
    fill(this.state, this.#source(outside));
  }

  #verdict() {
    const { boundary, lobes } = this.known;
    const { ke_liner: ke } = this.app.range;
    const title = h("strong", { class: "design-title" }, this.app.active.title);
    if (!ke) return [title, " Give the liner’s Kₑ for a verdict."];
    if (!boundary) return [title, " …"];
    const { unstable } = this.known;
    const share = unstable ? percent(unstable.unstable_share) : `about ${percent(unstableShareAt(boundary, ke), 2)}`;
    // A lobe's tip may lie between the speeds of the boundary.
    const least = lobes?.[0]?.tip.ke ?? Math.min(...boundary.critical_ke.filter((value) => value !== null));
    if (least <= ke) {
      return [title, h("span", { class: "badge bad" }, "✕ chatters"), ` at the liner’s Kₑ of ${stiffness(ke)}: ${share} of the speed range is unstable.`];
    }
    if (!lobes) {
      return [title, h("span", { class: "badge" }, "so far stable"), ` at the liner’s Kₑ of ${stiffness(ke)}: nothing comes below it at the ${boundary.speed_hz.length} speeds asked so far; lobes between them are being searched for…`];
    }
    const margin = Number.isFinite(least) ? `the smallest destabilising Kₑ is ${percent(least / ke - 1)} above it` : `nothing below ${stiffness(this.app.range.ke_max)} destabilises it`;
    return [title, h("span", { class: "badge fine" }, "✓ stable"), ` at the liner’s Kₑ of ${stiffness(ke)} over the whole speed range: ${margin}.`];
  }

  #worst() {
    const { lobes } = this.known;
    const { unit, range } = this.app;
    if (!lobes) return null;
    if (!lobes.length) return h("li", {}, `No lobe comes below ${stiffness(range.ke_max)} in this range.`);
    const { tip, mode } = lobes[0];
    return h("li", {}, "Worst speed: ", h("strong", {}, unit.write(tip.speed_hz)), ", where ", h("strong", {}, stiffness(tip.ke)),
      " is enough; ", h("strong", {}, `mode ${mode}`), ` chatters at ${number(tip.chatter_hz)} Hz with ${number(tip.lobes_per_revolution)} wear lobes round the casing${this.#atAnEnd(tip.speed_hz)}.`);
  }

  /** Lobes grow deeper towards low speed: a worst speed at the end of the range says that beyond it is worse. */
  #atAnEnd(speed_hz) {
    const { low_hz, high_hz } = this.app.range;
    return (speed_hz - low_hz) / (high_hz - low_hz) < NEAR_THE_END ? ". It is at the low end of the range: below it there may be worse" : "";
  }

  #mend() {
    const { damping, lobes, searching } = this.known;
    const { active: design, range } = this.app;
    if (!damping) {
      if (!lobes || !design.arcs || !range.ke_liner) return null;
      const search = h("button", { type: "button", class: "small", disabled: Boolean(searching), onclick: this.onSearch },
        searching ? "Searching…" : "Find the damping it needs");
      return h("li", {}, search, " by the exact core; with arcs of contact this takes up to a minute.");
    }
    const ratios = damping.damping_ratio;
    const written = Math.max(...ratios) / Math.min(...ratios) < 1.001 ? `ξ = ${number(ratios[0], 3)}` : `ξ from ${number(Math.min(...ratios), 3)} to ${number(Math.max(...ratios), 3)}`;
    const apply = h("button", { type: "button", class: "small", onclick: () => this.onDamping(damping.factor) }, "Try it");
    if (Math.abs(damping.factor - 1) < ENOUGH) {
      return h("li", {}, "Its damping, ", h("strong", {}, written), `, is just enough to be stable at ${stiffness(range.ke_liner)} at every speed.`);
    }
    if (damping.factor > 1) {
      return h("li", {}, `To be stable at ${stiffness(range.ke_liner)} at every speed it would need `, h("strong", {}, written),
        `, ${number(damping.factor, 3)} times its damping. `, apply);
    }
    return h("li", {}, `It would still be stable at ${stiffness(range.ke_liner)} with ${written}, ${number(damping.factor, 3)} times its damping. `, apply);
  }

  #source(outside) {
    const { map, live, busy, boundary } = this.known;
    if (!map && !boundary) return busy ? "Asking…" : null;
    const parts = [];
    if (outside) parts.push(`Outside what the surrogate was trained for (${outside.field} = ${outside.value}): the exact core answers, which takes longer.`);
    if (map) {
      parts.push(live
        ? `Map by the surrogate, model ${map.model}: ${percent(unstableShare(map))} of its area unstable; being verified by the exact core…`
        : `Map of ${map.speed_hz.length} × ${map.ke.length} points: ${percent(unstableShare(map))} of its area unstable, ${percent(map.exactShare)} of it answered by the exact core${map.model ? `, the rest by model ${map.model}` : ""}.`);
    }
    if (boundary) {
      const errors = boundary.error_estimate.filter((value, i) => value !== null && boundary.critical_ke[i] !== null);
      parts.push(`Boundary exact at ${boundary.speed_hz.length} speeds${errors.length ? `, error at most ${number(Math.max(...errors), 2)} of Kₑ` : ""}.`);
    }
    if (busy) parts.push("The exact core is at work…");
    return parts.join(" ");
  }
}

/** Share of the speed range in which a stiffness lies inside an interval of instability. */
export function unstableShareAt(boundary, ke) {
  const { speed_hz: speeds, unstable_ke: intervals } = boundary;
  const inside = intervals.map((found) => (found ?? []).some(([low, high]) => low <= ke && ke <= high));
  let [unstable, all] = [0, 0];
  for (let i = 1; i < speeds.length; i += 1) {
    const width = speeds[i] - speeds[i - 1];
    all += width;
    unstable += width * 0.5 * (Number(inside[i]) + Number(inside[i - 1]));
  }
  return all ? unstable / all : NaN;
}
