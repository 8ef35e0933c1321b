/** One design: what it is, where it touches, what may be changed, and its stability as all of that moves. */

import { Answers } from "../answers.js";
import { CampbellChart } from "../charts/campbell_chart.js";
import { MapChart } from "../charts/map_chart.js";
import { BladePicker } from "../design/blade_picker.js";
import { CasingRing } from "../design/casing_ring.js";
import { RangeFields } from "../design/range_fields.js";
import { ShapeChanges } from "../design/shape_changes.js";
import { Sliders } from "../design/sliders.js";
import { TipPicture } from "../design/tip_picture.js";
import { fill, h, say, settled } from "../dom.js";
import { events } from "../service.js";
import { Findings } from "./explorer_findings.js";
import { LobeTable } from "./explorer_lobes.js";
import { PointReading } from "./explorer_point.js";

export class ExplorerView {
  /** @param {import("../app.js").App} app */
  constructor(app) {
    this.app = app;
    this.answers = new Answers();
    this.map = new MapChart();
    this.campbell = new CampbellChart();
    this.findings = new Findings(app, { onDamping: (factor) => this.#damp(factor), onSearch: () => this.answers.searchDamping() });
    this.point = new PointReading(app, { clear: () => this.#choose(null), modesAt: (speed_hz) => this.campbell.frequenciesAt(speed_hz) });
    this.lobes = new LobeTable((index) => this.#chooseLobe(index));
    this.picker = new BladePicker(app, (design) => {
      if (design === app.active) return app.changed("design");
      design.touchAs(app.active);
      return app.replace(design);
    });
    this.tip = new TipPicture(() => this.#changed());
    this.ring = new CasingRing(() => this.#changed());
    this.sliders = new Sliders((event) => this.#slid(event));
    this.shapes = new ShapeChanges(app, () => this.#ask());
    this.range = new RangeFields(app, () => this.#changed("range"));
    this.kept = h("p", { class: "note" });
    this.element = this.#lay();
    this.chosen = null;
    this.pointAgain = settled(120, () => this.shown && this.point.show(app.point));
    this.#connect();
    app.onChange((what) => this.#appChanged(what));
    // What is said of the map is of the design before, if nobody answers for this one.
    events.addEventListener("away", () => this.shown && this.findings.show({ map: null }));
    events.addEventListener("back", () => this.shown && this.#ask());
  }

  #lay() {
    const part = (title, ...content) => h("fieldset", {}, h("legend", {}, title), ...content);
    return h("section", { class: "explorer", "aria-labelledby": "explorer-title" },
      h("h2", { id: "explorer-title", class: "hidden" }, "Explorer"),
      h("div", { class: "controls" },
        part("Blade", this.picker.element),
        part("Speeds and stiffnesses", this.range.element),
        part("Contact at the tip", this.tip.element),
        part("Contact round the casing", this.ring.element),
        part("What if", this.sliders.element, this.shapes.element),
        h("div", { class: "actions" },
          h("button", { type: "button", onclick: () => {
            say(this.app.keep() ? "Kept for comparison" : "Kept already");
          } }, "Keep for comparison"),
          h("button", { type: "button", onclick: () => this.app.go("compare") }, "Compare")),
        this.kept),
      h("div", { class: "answers" },
        this.findings.element,
        h("div", { class: "beside" }, this.map.element, this.campbell.element),
        h("div", { class: "beside below" }, this.point.element, this.lobes.element)));
  }

  #connect() {
    const { answers, map, campbell } = this;
    answers.on("map", async ({ map: found, live, since, drawn }) => {
      // What belonged to the design before does not stay beside the map of this one.
      const stale = live && this.#moved ? { boundary: null, lobes: null } : {};
      const reframed = this.#framed !== (this.#framed = this.#frameName());
      if (reframed || !live || !(await map.showLive(found))) await map.show({ map: found, ...this.#frame(), ...stale });
      map.element.classList.remove("stale");
      if (live) this.#moved = false;
      drawn();
      measured(live ? "map on screen" : "verified map on screen", since);
      this.findings.show({ map: found, live });
    });
    answers.on("boundary", async ({ boundary, since, fine }) => {
      this.boundary = { ...boundary, ke_max: this.app.range.ke_max };
      // A slow live map of the same design comes later at times, and is then no reason to take this away.
      const stale = this.#moved ? { lobes: null } : {};
      this.#moved = false;
      await map.show({ boundary: this.boundary, ...this.#frame(), ...stale });
      measured(fine ? "finer boundary on screen" : "exact boundary on screen", since);
      this.findings.show({ boundary: this.boundary });
    });
    answers.on("campbell", (found) => {
      campbell.element.classList.remove("stale");
      campbell.show({ campbell: found, ...this.#frame() });
    });
    answers.on("lobes", (found) => this.#showLobes(found));
    answers.on("unstable", (unstable) => this.findings.show({ unstable }));
    answers.on("damping", (damping) => this.findings.show({ damping }));
    answers.on("searching", (searching) => this.findings.show({ searching }));
    answers.on("outside", (outside) => this.findings.show({ outside }));
    answers.on("problem", (problem) => this.findings.show({ problem }));
    answers.on("busy", (busy) => this.findings.show({ busy }));
    map.element.addEventListener("cursor", ({ detail }) => this.#cursor(detail));
    map.element.addEventListener("choose", ({ detail }) => this.#choose(detail));
  }

  #frame() {
    const { range, unit, point, active } = this.app;
    this.map.about = this.campbell.about = active.title;
    return { range, unit, point, chosen: this.chosen };
  }

  #framed = "";

  #frameName() {
    const { range, unit, point } = this.app;
    return JSON.stringify([range, unit.name, unit.factor, point]);
  }

  show() {
    this.shown = true;
    this.#fill();
    this.#ask();
    this.point.show(this.app.point);
  }

  hide() {
    this.shown = false;
    this.answers.stop();
  }

  #fill() {
    const { active: design } = this.app;
    this.picker.show(design);
    this.tip.show(design);
    this.ring.show(design);
    this.sliders.show(design);
    this.shapes.show(design);
    this.range.show();
    this.#kept();
  }

  #kept() {
    const { designs, distinct, active } = this.app;
    const others = distinct.filter((design) => design !== active && (design.sameness !== active.sameness || designs.length > distinct.length));
    this.kept.textContent = others.length ? `Kept: ${others.map((design) => design.title).join("; ")}.` : "";
  }

  #appChanged(what) {
    if (!this.shown) return;
    if (what === "designs" || what === "design") {
      this.#fill();
      this.map.parts.range && this.map.show(this.#frame());
      this.#ask();
    } else if (what === "unit" || what === "theme") {
      this.range.show();
      this.map.parts.range && this.map.show(this.#frame());
      this.campbell.show(this.#frame());
      this.lobes.show(this.map.parts.lobes ?? null, this.app.unit, this.chosen);
      this.findings.show({});
      this.point.show(this.app.point);
    }
  }

  #changed(what) {
    if (what === "range") this.app.changed("range");
    this.#ask();
  }

  #moved = false;

  #ask() {
    const { active: design, range } = this.app;
    // What is on screen is of the design before, until answers for this one come.
    for (const element of [this.map.element, this.campbell.element]) element.classList.add("stale");
    this.lobes.show(null);
    this.pointAgain();
    if (!design.touches) {
      this.answers.stop();
      this.map.show({ map: null, boundary: null, lobes: null, ...this.#frame() });
      return this.findings.show({ map: null, boundary: null, lobes: null, unstable: null, damping: null, busy: false, problem: new Error("No node touches the casing: choose one at the tip.") });
    }
    this.#moved = true;
    this.app.changed("moved");
    this.chosen = null;
    this.findings.show({ boundary: null, lobes: null, unstable: null, damping: null, problem: null });
    return this.answers.ask({ blade: design.blade, contact: design.contact, range: { ...range } });
  }

  #slid({ shape, live }) {
    if (shape) return this.shapes.moved(this.app.active, live);
    return this.#ask();
  }

  #damp(factor) {
    const design = this.app.active;
    design.damping *= factor;
    this.sliders.show(design);
    say(`Damping set to ${factor.toPrecision(3)} times what it was`);
    this.#ask();
  }

  #showLobes(found) {
    this.map.show({ lobes: found, ...this.#frame() });
    this.campbell.show({ lobes: found, ...this.#frame() });
    this.lobes.show(found, this.app.unit, this.chosen);
    this.findings.show({ lobes: found });
  }

  #chooseLobe(index) {
    this.chosen = this.chosen === index ? null : index;
    this.map.show(this.#frame());
    this.campbell.show(this.#frame());
    this.lobes.show(this.map.parts.lobes, this.app.unit, this.chosen);
  }

  #cursor(place) {
    if (place) {
      this.campbell.cross.show(this.app.unit.of(place.speed_hz));
      this.point.hover(place, this.map.read(place));
    } else {
      this.campbell.cross.hide();
      this.point.leave();
    }
  }

  #choose(place) {
    this.app.point = place && { speed_hz: place.speed_hz, ke: place.ke };
    this.app.changed("point");
    this.map.show(this.#frame());
    this.point.show(this.app.point);
  }
}

/** For whoever measures: from the change of the input to the frame that shows its answer (User Timing). */
function measured(name, since) {
  requestAnimationFrame(() => performance.measure(`rubscreen: ${name}`, { start: since }));
}
