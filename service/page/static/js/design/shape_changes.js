/** Thickness and lean of a profile: an estimate while a slider moves, a built blade when it rests. */

import { fill, h } from "../dom.js";
import { Problem } from "../service.js";
import { ProfileShapes } from "./profile_shapes.js";

/** A slider at rest for so long is built, ms. */
const REST = 900;

export class ShapeChanges {
  /** @param {import("../app.js").App} app  @param {() => void} onBlade when the design's blade is another */
  constructor(app, onBlade) {
    this.app = app;
    this.onBlade = onBlade;
    this.element = h("div", { role: "status" });
    this.known = new Map();
    this.building = new AbortController();
  }

  show(design) {
    if (!design.profile) fill(this.element);
    else if (!design.reshaped) this.#say("Move thickness or lean: a slider at rest is built by finite elements.");
  }

  #say(text, kind = "note") {
    fill(this.element, h("p", { class: kind }, text));
  }

  /** A slider of the shape was moved. */
  async moved(design) {
    clearTimeout(this.timer);
    this.building.abort();
    this.building = new AbortController();
    const { signal } = this.building;
    if (!design.reshaped) {
      design.shapedBase = null;
      this.show(design);
      return this.onBlade();
    }
    try {
      const shapes = await this.#shapesOf(design);
      if (signal.aborted) return undefined;
      design.shapedBase = shapes.estimate(design.base, design.shape);
      this.#say("Estimated between built blades; built at this shape as soon as the slider rests.", "warning");
      this.timer = setTimeout(() => this.#build(design, signal), REST);
      return this.onBlade();
    } catch (error) {
      return this.#failed(error);
    }
  }

  async #shapesOf(design) {
    const key = JSON.stringify(design.profile);
    if (!this.known.has(key)) {
      const shapes = new ProfileShapes(design.profile);
      const ready = shapes.prepare((done, total) => this.#say(`Learning how the shape moves the modes: ${done} of ${total} blades built…`)).then(() => shapes);
      this.known.set(key, ready);
      ready.catch(() => this.known.delete(key));
    }
    return this.known.get(key);
  }

  async #build(design, signal) {
    this.#say("Building the blade at this shape by finite elements…");
    try {
      const { blade, build } = await ProfileShapes.build(design.profile, design.shape, signal);
      if (signal.aborted) return;
      design.shapedBase = { ...blade, name: design.base.name };
      this.#say(`Built at this shape: mesh of ${build.mesh_nodes.toLocaleString("en-US")} nodes, ${build.seconds.toFixed(1)} s.`, "good");
      this.onBlade();
    } catch (error) {
      this.#failed(error);
    }
  }

  #failed(error) {
    if (error.name === "AbortError") return;
    if (!(error instanceof Problem)) throw error;
    this.#say(`This shape cannot be built: ${error.field} = ${error.value}: ${error.remedy}`, "problem");
  }
}
