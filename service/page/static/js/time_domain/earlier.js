/** Simulations that the service keeps, newest first, to be opened again. */

import { fill, h } from "../dom.js";
import { percent } from "../format.js";
import { Problem, ask } from "../service.js";

const FEW = 10;

export class EarlierList {
  /** @param {(id: string) => void} open */
  constructor(open) {
    this.open = open;
    this.body = h("tbody");
    this.more = h("button", { type: "button", class: "small", hidden: true, onclick: () => this.load(this.next) }, "Older ones");
    this.none = h("p", { class: "hint" }, "None yet.");
    this.fault = h("p", { class: "problem", role: "alert", hidden: true });
    const column = (text) => h("th", { scope: "col" }, text);
    this.table = h(
      "table", { hidden: true }, h("caption", { class: "hidden" }, "Earlier simulations"),
      h("thead", {}, h("tr", {}, ["Simulation", "Asked for (UTC)", "State", "Look"].map(column))), this.body,
    );
    this.element = h("details", { class: "earlier no-print" }, h("summary", {}, "Earlier simulations"), this.none, h("div", { class: "scroll" }, this.table), this.more, this.fault);
    this.chosen = null;
    this.jobs = [];
  }

  /** Ask for the newest, or for those that follow. */
  async load(next = null) {
    this.fault.hidden = true;
    try {
      const page = await ask(next ?? `v1/simulations?limit=${FEW}`);
      this.jobs = next ? [...this.jobs, ...page.jobs] : page.jobs;
      this.next = page.next;
      this.draw();
    } catch (error) {
      if (!(error instanceof Problem) || error.status === 401) return;
      this.fault.hidden = false;
      this.fault.textContent = `${error.title}: ${error.message}`;
    }
  }

  /** Mark the one that is looked at. */
  mark(id) {
    this.chosen = id;
    this.draw();
  }

  /** A job is further than the list says. */
  update(job) {
    const at = this.jobs.findIndex(({ id }) => id === job.id);
    if (at >= 0) this.jobs[at] = job;
    else this.jobs.unshift(job);
    this.draw();
  }

  draw() {
    const row = (job) => {
      const name = job.name ?? job.id.slice(0, 8);
      const state = job.state === "running" ? `running, ${percent(job.progress.share, 2)}` : job.state;
      return h(
        "tr", { class: job.id === this.chosen ? "chosen" : "" },
        h("th", { scope: "row" }, name), h("td", { class: "when" }, job.created_at.slice(0, 16).replace("T", " ")), h("td", {}, state),
        h("td", {}, h("button", { type: "button", class: "small", "aria-label": `Open ${name}`, onclick: () => this.open(job.id) }, "Open")),
      );
    };
    // Drawn only when it says something else: whoever stands on a button stays there.
    const now = JSON.stringify([this.chosen, this.jobs.map(({ id, name, state, progress }) => [id, name, state, state === "running" && progress.share])]);
    if (now === this.drawn) return;
    this.drawn = now;
    const focused = [...this.body.querySelectorAll("button")].indexOf(document.activeElement);
    fill(this.body, this.jobs.map(row));
    if (focused >= 0) this.body.querySelectorAll("button")[focused]?.focus();
    this.none.hidden = this.jobs.length > 0;
    this.table.hidden = !this.jobs.length;
    this.more.hidden = !this.next;
  }
}
