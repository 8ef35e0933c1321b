/** Sliders that change a design: damping, frequency and amplitude of each mode, thickness and lean. */

import { fill, fresh, h } from "../dom.js";
import { number } from "../format.js";

/** Damping by factors of ten, to both sides. */
const DAMPING_DECADES = 1.3;
const [FREQUENCY_SHARE, AMPLITUDE_SHARE] = [0.1, 0.5];

export class Sliders {
  /** @param {(event: {live: boolean, shape: boolean}) => void} onChange while a slider moves, and when it is let go */
  constructor(onChange) {
    this.onChange = onChange;
    this.element = h("div", { class: "sliders" });
  }

  show(design) {
    this.design = design;
    const reset = h("button", { type: "button", class: "small", onclick: () => {
      design.reset();
      design.shape = { thickness: 1, lean_deg: 0 };
      design.shapedBase = null;
      this.show(design);
      this.onChange({ live: false, shape: true });
    } }, "Back to the loaded blade");
    const modes = Array.from({ length: design.modes }, (_, j) => j);
    const times = (factor) => `× ${factor.toFixed(3)}`;
    const perMode = (title, key, share, told) =>
      h("details", { open: key === "frequency" && design.frequency.some((f) => f !== 1) ? "" : null },
        h("summary", {}, title),
        modes.map((j) => this.#slider({
          label: `${title.replace(/ies$/, "y").replace(/s$/, "")}, mode ${j + 1}`, min: 1 - share, max: 1 + share, step: 0.005,
          value: design[key][j], write: (value) => told(j, value), set: (value) => { design[key][j] = value; },
        })));
    const base = design.base.states[0];
    fill(this.element,
      this.#slider({
        label: "Damping, all modes", min: -DAMPING_DECADES, max: DAMPING_DECADES, step: 0.01, value: Math.log10(design.damping), name: "damping",
        write: (value) => `ξ = ${number(design.dampingRatio[0], 3)} (× ${number(10 ** value, 3)})`,
        set: (value) => { design.damping = value === 0 ? 1 : 10 ** value; },
      }),
      perMode("Frequencies", "frequency", FREQUENCY_SHARE, (j, value) => `${number(base.frequency_hz[j] * value)} Hz (${times(value)})`),
      perMode("Amplitudes", "amplitude", AMPLITUDE_SHARE, (_, value) => times(value)),
      design.profile ? this.#shape(design) : null,
      h("div", { class: "row" }, reset));
  }

  #shape(design) {
    const part = (key, given) => this.#slider({
      ...given, value: design.shape[key], shape: true, set: (value) => { design.shape[key] = value; },
    });
    return h("div", { role: "group", "aria-label": "Shape" },
      part("thickness", { label: "Thickness, all sections", min: 0.9, max: 1.1, step: 0.005, write: (value) => times3(value) }),
      part("lean_deg", { label: "Lean", min: -4, max: 4, step: 0.1, write: (value) => `${value > 0 ? "+" : ""}${value.toFixed(1)}°` }));
  }

  #slider({ label, min, max, step, value, write, set, shape = false, name }) {
    const id = fresh("slider");
    const said = h("output", { for: id }, write(value));
    const input = h("input", {
      type: "range", id, min, max, step, value, data: { slider: name ?? label }, "aria-valuetext": write(value),
      oninput: () => {
        set(Number(input.value));
        said.textContent = write(Number(input.value));
        input.setAttribute("aria-valuetext", said.textContent);
        this.onChange({ live: true, shape });
      },
      onchange: () => this.onChange({ live: false, shape }),
    });
    return h("div", { class: "slider" }, h("label", { for: id }, label), said, input);
  }
}

const times3 = (factor) => `× ${factor.toFixed(3)}`;
