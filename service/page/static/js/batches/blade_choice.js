/** Which blades are screened: the designs kept in the explorer, shipped examples, files. */

import { fill, h } from "../dom.js";
import { BladeFiles } from "./blade_files.js";
import { counted } from "./words.js";

const LONGEST_NAME = 200;

export class BladeChoice {
  /** @param {App} app  @param {() => void} onChange */
  constructor(app, onChange) {
    this.app = app;
    this.ticked = new Map(); // of designs, by their id
    this.files = new BladeFiles(() => this.told());
    this.onChange = onChange;
    this.designs = h("ul", { class: "ticks" });
    this.examples = h("ul", { class: "ticks" });
    this.sum = h("p", { class: "note", "aria-live": "polite" });
    this.element = h(
      "fieldset", {}, h("legend", {}, "Blades"),
      h("div", { class: "three" },
        h("div", { role: "group", "aria-label": "Designs kept in the explorer" }, h("h3", {}, "From the explorer"), this.designs),
        h("div", { role: "group", "aria-label": "Shipped examples" }, h("h3", {}, "Examples"), this.examples)),
      this.files.element, this.sum,
    );
    this.fillDesigns();
    this.fillExamples();
  }

  fillDesigns() {
    fill(this.designs, this.app.distinct.map((design) => tick(nameOf(design), this.ticked.get(design.id) ?? true, (on) => {
      this.ticked.set(design.id, on);
      this.told();
    })));
    this.told();
  }

  fillExamples() {
    const { blades, profiles } = this.app.examples;
    this.boxes = [
      ...Object.keys(blades).map((name) => [blades[name].name ?? name, () => ({ example: name })]),
      // A profile has no name that the service knows; it goes as it is, and is built there.
      ...Object.keys(profiles).map((name) => [`${profiles[name].name ?? name} (profile, built first)`, () => profiles[name]]),
    ].map(([label, entry]) => ({ item: tick(label, false, () => this.told()), entry }));
    fill(this.examples, this.boxes.map(({ item }) => item));
  }

  get chosenDesigns() {
    return this.app.distinct.filter((design) => this.ticked.get(design.id) ?? true);
  }

  get chosenExamples() {
    return (this.boxes ?? []).filter(({ item }) => item.querySelector("input").checked);
  }

  get busy() {
    return this.files.busy;
  }

  get count() {
    return this.chosenDesigns.length + this.chosenExamples.length + this.files.count;
  }

  /** Entries of `blades` in a screening's request. */
  get entries() {
    // Designs by what was changed of them: the blade file's own name is the same for all of one blade.
    const designs = this.chosenDesigns.map((design) => ({ ...design.blade, name: nameOf(design).slice(0, LONGEST_NAME) }));
    return [...designs, ...this.chosenExamples.map(({ entry }) => entry()), ...this.files.entries];
  }

  told() {
    this.sum.textContent = `${counted(this.count, "blade")} chosen${this.busy ? "; files are still being sent" : ""}.`;
    this.onChange();
  }
}

const nameOf = (design) => [design.label, design.changeName].filter(Boolean).join(" · ");

const tick = (label, on, run) =>
  h("li", {}, h("label", {}, h("input", { type: "checkbox", checked: on, onchange: (event) => run(event.target.checked) }), ` ${label}`));
