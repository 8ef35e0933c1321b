/** The range of rotor speeds and stiffnesses that is looked at, and the liner's K_e. */

import { fill, fresh, h } from "../dom.js";
import { number, stiffness } from "../format.js";

const MOST_KE = 1e9;

export class RangeFields {
  /** @param {import("../app.js").App} app  @param {() => void} onChange after a value that can be used */
  constructor(app, onChange) {
    this.app = app;
    this.onChange = onChange;
    this.problem = h("p", { class: "problem", role: "alert", hidden: true });
    this.low = this.#field();
    this.high = this.#field();
    this.most = this.#field();
    this.liner = this.#field();
    this.unit = h("span");
    this.element = h("div", {},
      h("div", { class: "range-fields" },
        h("label", { for: this.low.id }, "Speeds from"), this.low, h("label", { for: this.high.id }, "to"), this.high, this.unit,
        h("label", { for: this.most.id }, "Kₑ up to"), this.most, h("span", { class: "rest" }, "N/m"),
        h("label", { for: this.liner.id }, "Liner’s Kₑ"), this.liner, h("span", { class: "rest" }, "N/m")),
      this.problem);
  }

  #field() {
    return h("input", { type: "number", id: fresh("range"), step: "any", min: 0, onchange: () => this.#read() });
  }

  show() {
    const { range, unit } = this.app;
    const rounded = (value) => Number(value.toPrecision(6));
    this.low.value = rounded(unit.of(range.low_hz));
    this.high.value = rounded(unit.of(range.high_hz));
    this.most.value = rounded(range.ke_max);
    this.liner.value = range.ke_liner === null ? "" : rounded(range.ke_liner);
    fill(this.unit, unit.symbol);
    this.#say(null);
  }

  #say(why) {
    this.problem.textContent = why ?? "";
    this.problem.hidden = !why;
  }

  #read() {
    const { range, unit, active } = this.app;
    const [low, high, most] = [this.low, this.high, this.most].map((field) => (field.value === "" ? NaN : Number(field.value)));
    const [low_hz, high_hz] = [unit.toHz(low), unit.toHz(high)];
    const liner = this.liner.value === "" ? null : Number(this.liner.value);
    const [least, reach] = active.coveredRange();
    const slack = 1e-5 * Math.min(reach, 1e6);
    if (!(low_hz > 0) || !(high_hz > 0)) return this.#say("Give two speeds above 0.");
    if (!(low_hz < high_hz)) return this.#say(`Let the first speed be below the second: ${number(low)} is not below ${number(high)}.`);
    if (low_hz < least - slack || high_hz > reach + slack) {
      return this.#say(`The modal data of this blade reach from ${unit.write(least)} to ${unit.write(reach)}: stay inside, or add a state to the blade file.`);
    }
    if (!(most > 0 && most <= MOST_KE)) return this.#say(`Give a largest Kₑ above 0, up to ${stiffness(MOST_KE)}.`);
    if (liner !== null && !(liner > 0 && liner <= most)) return this.#say(`Give a liner Kₑ above 0, up to the largest one, ${stiffness(most)}; or none.`);
    this.#say(null);
    Object.assign(range, { low_hz: Math.max(low_hz, least), high_hz: Math.min(high_hz, reach), ke_max: most, ke_liner: liner });
    return this.onChange();
  }
}
