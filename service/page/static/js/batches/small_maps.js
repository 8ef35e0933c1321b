/** Small stability maps beside the rows of a ranking: asked for when they come into sight, two at a time. */

import { download } from "../charts/chart.js";
import { fill, h } from "../dom.js";
import { inWords } from "../problem_note.js";
import { objectUrl } from "../service.js";

const AT_A_TIME = 2;
// Pictures kept; the one that was asked for longest ago goes first.
const MOST_KEPT = 120;

export class SmallMaps {
  constructor() {
    this.urls = new Map();
    this.inSight = new Set();
    this.asked = new Map(); // places by key
    this.active = 0;
    this.observer = new IntersectionObserver((seen) => {
      for (const { target, isIntersecting } of seen) {
        if (isIntersecting) this.inSight.add(target);
        else this.inSight.delete(target);
      }
      this.go();
    }, { rootMargin: "200px" });
    this.large = new LargeMap();
  }

  /** Forget everything, and show maps of another screening. */
  begin(job) {
    this.job = job;
    this.abort?.abort();
    this.abort = new AbortController();
    for (const url of this.urls.values()) URL.revokeObjectURL(url);
    this.urls.clear();
    this.refill();
  }

  /** The rows are made anew. */
  refill() {
    this.observer.disconnect();
    this.inSight.clear();
  }

  /** The place of a row's map. @param {{blade_index: number, contact_name: string, blade: string}} row */
  place({ blade_index: index, contact_name: contact, blade }) {
    const path = `v1/screenings/${this.job}/blades/${index}/map.png?contact=${encodeURIComponent(contact)}`;
    const title = `Stability map of ${blade}, contact ${contact}`;
    const made = h("button", { type: "button", class: "small-map", data: { key: `map ${index} ${contact}` }, "aria-label": `${title}: show it large`,
      onclick: () => this.large.show(title, path, `v1/screenings/${this.job}/blades/${index}/boundaries.png`, `map-${index}-${contact}.png`) });
    made.path = path;
    if (this.urls.has(path)) this.picture(made);
    else this.observer.observe(made);
    return made;
  }

  go() {
    for (const place of this.inSight) {
      if (this.active >= AT_A_TIME) return;
      this.inSight.delete(place);
      this.observer.unobserve(place);
      this.load(place, this.abort.signal);
    }
  }

  async load(place, signal) {
    this.active += 1;
    try {
      const url = await objectUrl(place.path, "image/png", signal);
      this.urls.set(place.path, url);
      this.picture(place);
      this.forgetOldest();
    } catch (error) {
      if (error.name !== "AbortError") fill(place, h("span", { class: "hint" }, "no map"));
    } finally {
      this.active -= 1;
      this.go();
    }
  }

  picture(place) {
    fill(place, h("img", { src: this.urls.get(place.path), alt: "", onerror: () => fill(place, "show") }));
  }

  forgetOldest() {
    while (this.urls.size > MOST_KEPT) {
      const [path, url] = this.urls.entries().next().value;
      URL.revokeObjectURL(url);
      this.urls.delete(path);
    }
  }
}

/** A map as large as the window allows, with the blade's boundaries under every contact. */
class LargeMap {
  constructor() {
    this.title = h("h2");
    this.body = h("div", { class: "pictures" });
    this.element = h("dialog", { class: "large-map", "aria-label": "Stability map" }, this.title, this.body,
      h("p", { class: "actions" },
        h("button", { type: "button", onclick: () => this.url && download(this.url, this.name) }, "Save the map as PNG"),
        h("button", { type: "button", class: "primary", onclick: () => this.element.close() }, "Close")));
    this.element.addEventListener("close", () => {
      this.abort.abort();
      this.body.querySelectorAll("img").forEach((image) => URL.revokeObjectURL(image.src));
      fill(this.body);
    });
  }

  async show(title, map, boundaries, name) {
    const { signal } = (this.abort = new AbortController());
    [this.name, this.url] = [name, null];
    fill(this.title, title);
    fill(this.body, h("p", { class: "hint" }, "Being drawn…"));
    this.element.showModal();
    try {
      this.url = await objectUrl(map, "image/png", signal);
      fill(this.body, h("img", { src: this.url, alt: title }));
      const all = await objectUrl(boundaries, "image/png", signal);
      this.body.append(h("img", { src: all, alt: "Boundaries of this blade under every contact of the screening" }));
    } catch (error) {
      if (error.name !== "AbortError") fill(this.body, h("p", { class: "problem", role: "alert" }, inWords(error)));
    }
  }
}
