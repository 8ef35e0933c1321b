/** How the casing comes near the tip: closing in evenly, or pressed oval. */

import { fresh, h } from "../dom.js";
import { Field } from "../field.js";

const MICRO = 1e6;
/** Ways that casings go, in metres; what suits which question is said in the hints. */
const WAYS = {
  even: { clearance_m: 1e-5, ovalisation_m: 0, lobes: 2, feed_per_revolution_m: 1e-5 },
  oval: { clearance_m: 1e-4, ovalisation_m: 2e-4, lobes: 2, feed_per_revolution_m: 0 },
};

export class CasingFields {
  /** @param {"even"|"oval"} way that the fields begin with */
  constructor(way) {
    const own = () => { this.way.value = this.wayOf(); };
    this.fields = {
      clearance_m: new Field({ label: "Clearance", unit: "µm", factor: MICRO, change: own, hint: "Gap between tip at rest and round, new liner." }),
      ovalisation_m: new Field({
        label: "Ovalisation", unit: "µm", factor: MICRO, min: 0, change: own,
        hint: "Amplitude; it grows over the first five revolutions. 0 for a round casing.",
      }),
      lobes: new Field({ label: "Lobes of the ovalisation", whole: true, min: 1, change: own, hint: "Times the casing comes near in a revolution." }),
      feed_per_revolution_m: new Field({
        label: "Feed per revolution", unit: "µm", factor: MICRO, min: 0, change: own, hint: "What the casing closes in by all round.",
      }),
    };
    const id = fresh("way");
    this.way = h(
      "select", { id, onchange: () => this.take(this.way.value) },
      h("option", { value: "even" }, "closes in evenly: contact is kept"),
      h("option", { value: "oval" }, "pressed oval: the tip comes and goes"),
      h("option", { value: "own" }, "as given below"),
    );
    this.element = h(
      "div", {},
      h("div", { class: "field" }, h("label", { for: id }, "The casing"), this.way),
      h("div", { class: "fields" }, Object.values(this.fields).map((field) => field.element)),
    );
    this.take(way);
  }

  /** Fill in one of the ways. */
  take(way) {
    for (const [name, value] of Object.entries(WAYS[way] ?? {})) {
      this.fields[name].value = value;
      this.fields[name].accept();
    }
    this.way.value = way;
  }

  wayOf() {
    const same = (way) => Object.entries(way).every(([name, value]) => Math.abs(this.fields[name].value - value) < 1e-12);
    return Object.keys(WAYS).find((name) => same(WAYS[name])) ?? "own";
  }

  /** As it is sent. */
  get value() {
    return Object.fromEntries(Object.entries(this.fields).map(([name, field]) => [name, field.value]));
  }

  /** In a few words, for the job's name. */
  get words() {
    const { ovalisation_m: oval, lobes, feed_per_revolution_m: feed } = this.value;
    const parts = [];
    if (oval) parts.push(`oval ${Number((oval * MICRO).toPrecision(4))} µm × ${lobes}`);
    if (feed) parts.push(`feed ${Number((feed * MICRO).toPrecision(4))} µm`);
    return parts.join(", ") || "round casing";
  }
}
