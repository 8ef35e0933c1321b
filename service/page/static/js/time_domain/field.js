/** A number to be typed: label, unit, what it means, and the problem the service has with it. */

import { fill, fresh, h } from "../dom.js";

export class Field {
  /**
   * @param {{label: string, unit?: string, hint?: string, factor?: number, min?: number|null, whole?: boolean,
   *          empty?: string, change?: () => void}} given `factor` times the number in SI is what is shown;
   *        `empty` says what leaving it empty means, where it may be
   */
  constructor({ label, unit = "", hint = "", factor = 1, min = null, whole = false, empty = "", change }) {
    const id = fresh("field");
    this.factor = factor;
    this.unit = h("span", { class: "unit" }, unit);
    this.input = h("input", {
      id, type: "number", step: whole ? "1" : "any", min: min ?? undefined, inputMode: whole ? "numeric" : "decimal",
      placeholder: empty, "aria-describedby": `${id}-hint ${id}-fault`,
    });
    this.fault = h("p", { class: "problem", role: "alert", id: `${id}-fault`, hidden: true });
    this.element = h(
      "div", { class: "field" },
      h("label", { for: id }, label), h("span", { class: "entry" }, this.input, " ", this.unit),
      h("p", { class: "hint", id: `${id}-hint` }, hint), this.fault,
    );
    this.touched = false;
    this.input.addEventListener("input", () => {
      this.touched = true;
      this.exact = null;
      this.accept();
      change?.();
    });
  }

  /** In SI units; null where nothing usable stands. What was put there is given back to the last digit. */
  get value() {
    if (this.exact !== null && this.exact !== undefined) return this.exact;
    const number = this.input.valueAsNumber;
    return Number.isFinite(number) ? number / this.factor : null;
  }

  /** Put a number there, in SI units; null empties it. */
  set value(si) {
    this.exact = si;
    this.input.value = si === null ? "" : String(Number((si * this.factor).toPrecision(6)));
  }

  /** Show the same number in another unit. */
  show(factor, unit) {
    const si = this.value;
    this.factor = factor;
    this.unit.textContent = unit;
    if (si !== null) this.value = si;
  }

  /** Say what is wrong with it. */
  refuse(...text) {
    this.fault.hidden = false;
    fill(this.fault, ...text);
    this.input.setAttribute("aria-invalid", "true");
    for (let at = this.element.parentElement; at; at = at.parentElement) if (at.tagName === "DETAILS") at.open = true;
    this.input.focus();
  }

  accept() {
    this.fault.hidden = true;
    fill(this.fault);
    this.input.removeAttribute("aria-invalid");
  }
}
