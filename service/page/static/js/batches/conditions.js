/** Under which contacts and over which rotor speeds the blades are screened. */

import { fresh, h } from "../dom.js";
import { Field } from "../field.js";

export class ContactChoice {
  /** @param {App} app */
  constructor(app) {
    this.app = app;
    const name = fresh("contact");
    this.usual = radio(name, "Leading edge, trailing edge and both, of each blade", true);
    this.own = radio(name, "", false);
    this.element = h("fieldset", {}, h("legend", {}, "Contacts"), this.usual.element, this.own.element,
      h("p", { class: "hint" }, "With the second, blades without nodes of these names cannot be screened."));
    this.designsChanged();
  }

  designsChanged() {
    const design = this.app.active;
    this.own.text.textContent = design ? `That of “${design.label}” in the explorer: ${design.contactName}` : "That of the explorer";
    this.own.input.disabled = !design?.touches;
    if (this.own.input.disabled) this.usual.input.checked = true;
  }

  /** Part of the request. */
  get asked() {
    if (this.usual.input.checked) return {};
    const { contact, contactName } = this.app.active;
    return { contacts: [{ ...contact, name: contactName }] };
  }
}

export class SpeedChoice {
  /** @param {App} app */
  constructor(app) {
    this.app = app;
    const name = fresh("speeds");
    this.own = radio(name, "Each blade's own operating range", true);
    this.one = radio(name, "The same for all", false);
    const choose = () => { this.one.input.checked = true; };
    this.low = new Field({ label: "from", min: 0, change: choose });
    this.high = new Field({ label: "to", min: 0, change: choose });
    this.low.value = app.range.low_hz;
    this.high.value = app.range.high_hz;
    this.element = h("fieldset", {}, h("legend", {}, "Rotor speeds"), this.own.element, this.one.element,
      h("div", { class: "fields indented" }, this.low.element, this.high.element));
    this.showUnit();
  }

  /** Show the speeds in the unit the reader has chosen; the range of the explorer until another is typed. */
  showUnit() {
    const { unit, range } = this.app;
    for (const [field, hz] of [[this.low, range.low_hz], [this.high, range.high_hz]]) {
      if (!field.touched) field.value = hz;
      field.show(unit.factor, unit.symbol);
    }
  }

  /** Part of the request: in Hz, or over each blade's own first frequency. */
  get asked() {
    if (this.own.input.checked) return {};
    const { unit } = this.app;
    const hz = [this.low.value, this.high.value];
    return unit.name === "ratio" ? { speed_range_ratio: hz.map((one) => one && unit.of(one)) } : { speed_range_hz: hz };
  }

  get fields() {
    const both = (name) => ({ [name]: this.low, [`${name}[0]`]: this.low, [`${name}[1]`]: this.high });
    return { ...both("speed_range_hz"), ...both("speed_range_ratio") };
  }
}

function radio(name, label, checked) {
  const input = h("input", { type: "radio", name, checked });
  const text = h("span", {}, label);
  return { input, text, element: h("p", { class: "choice" }, h("label", {}, input, " ", text)) };
}
