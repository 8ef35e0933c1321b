/** Choosing a blade: shipped ones, a file, or one dropped anywhere on the page; profiles are built. */

import { fill, h, say } from "../dom.js";
import { Problem, ask } from "../service.js";
import { Design } from "./design.js";
import { ProfileShapes } from "./profile_shapes.js";

const LARGEST = 8 * 2 ** 20; // bytes; a blade file has some ten thousand
const TITLES = { nasa_rotor_37: "NASA rotor 37", generic_compressor_blade: "Generic compressor blade", transonic_profile: "Transonic profile (built from its shape)" };

export class BladePicker {
  /** @param {import("../app.js").App} app  @param {(design: Design) => void} onBlade */
  constructor(app, onBlade) {
    this.app = app;
    this.onBlade = onBlade;
    this.choice = h("select", { id: "blade-choice", onchange: () => this.#chosen() });
    this.file = h("input", { type: "file", accept: ".json,application/json", hidden: true, id: "blade-file", onchange: () => {
      if (this.file.files[0]) this.read(this.file.files[0]);
      this.file.value = "";
    } });
    this.said = h("div", { role: "alert" });
    this.remark = h("div", {});
    this.element = h("div", {},
      h("div", { class: "row" }, h("label", { for: "blade-choice" }, "Blade"), this.choice,
        h("button", { type: "button", onclick: () => this.file.click() }, "Open a file…"), this.file),
      h("p", { class: "hint" }, "Or drop a blade file (rubscreen/blade/1) or a profile (rubscreen/profile/1) on this page."),
      this.said, this.remark);
    this.#takeDrops();
  }

  show(design) {
    fill(this.remark, design.base.states.length > 1 ? null : h("p", { class: "warning" },
      "One modal state: frequencies and mode shapes are taken as constant over speed. A rotating blade stiffens, so give states at two or more speeds for a verdict to rely on."));
    const { blades, profiles } = this.app.examples;
    const option = (value, text, selected) => h("option", { value, selected }, text);
    const example = Object.keys(blades).find((name) => blades[name] === design.base);
    const profile = Object.keys(profiles).find((name) => profiles[name].name === design.base.name);
    fill(this.choice,
      example || profile ? null : option("", `${design.label} (from a file)`, true),
      Object.keys(blades).map((name) => option(name, TITLES[name] ?? name, name === example)),
      Object.keys(profiles).map((name) => option(name, TITLES[name] ?? name, name === profile)));
  }

  #chosen() {
    const { blades, profiles } = this.app.examples;
    const name = this.choice.value;
    fill(this.said);
    if (blades[name]) this.onBlade(new Design(blades[name]));
    else if (profiles[name]) this.take(profiles[name], name);
  }

  /** Read a file that a user chose or dropped. */
  async read(file) {
    fill(this.said, h("p", { class: "note" }, `Reading ${file.name}…`));
    try {
      if (file.size > LARGEST) throw new Error(`${file.name} has ${Math.round(file.size / 2 ** 20)} MiB: a blade file has far less. Is it the right file?`);
      let document;
      try {
        document = JSON.parse(await file.text());
      } catch (error) {
        throw new Error(`${file.name} is not JSON (${error.message}). Other formats become blade files with “rubscreen blade import”.`);
      }
      await this.take(document, file.name);
    } catch (error) {
      this.#refuse(error, file.name);
    }
  }

  /** A parsed blade file or profile, checked or built by the service. */
  async take(document, source) {
    try {
      if (document?.schema === "rubscreen/profile/1") return await this.#build(document);
      const { blade, findings } = await ask("v1/blades", { blade: document });
      const warnings = findings.filter((finding) => finding.severity === "warning");
      this.onBlade(new Design(blade));
      fill(this.said, warnings.map(({ field, what, remedy }) => h("p", { class: "warning" }, `${field}: ${what}. ${remedy}`)));
      return say(`${blade.name} loaded`);
    } catch (error) {
      return this.#refuse(error, source);
    }
  }

  /** First from a coarse mesh, that takes a second; then from the one that the profile asks for. */
  async #build(profile) {
    const note = (text) => fill(this.said, h("p", { class: "note" }, text));
    note(`Building ${profile.name} by finite elements, first from a coarse mesh…`);
    const { blade } = await ProfileShapes.build(ProfileShapes.coarseOf(profile));
    const design = new Design(blade, { profile });
    this.onBlade(design);
    note("Shown from a coarse mesh; the mesh of the profile is being built…");
    const fine = await ProfileShapes.build(profile);
    if (this.app.active !== design) return fill(this.said);
    design.base = fine.blade;
    fill(this.said);
    say(`${blade.name} built`);
    return this.onBlade(design);
  }

  #refuse(error, source) {
    const text = error instanceof Problem
      ? [h("strong", {}, `${source}: ${error.title}.`), ` ${error.field} = ${error.value}: ${error.remedy}.`]
      : [h("strong", {}, "This file cannot be used. "), error.message];
    fill(this.said, h("p", { class: "problem" }, text, " What was shown before stays."));
  }

  #takeDrops() {
    const over = (event) => {
      if (!event.dataTransfer?.types.includes("Files")) return;
      event.preventDefault();
      document.body.classList.toggle("dropping", event.type === "dragover");
    };
    for (const name of ["dragover", "dragleave"]) addEventListener(name, over);
    addEventListener("drop", (event) => {
      over(event);
      // Other views take files of their own.
      if (this.element.isConnected && event.dataTransfer?.files[0]) this.read(event.dataTransfer.files[0]);
    });
  }
}
