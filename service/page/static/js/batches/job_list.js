/** The screenings there are, newest first. */

import { fill, fresh, h } from "../dom.js";
import { inWords, isSilent } from "../problem_note.js";
import { ask } from "../service.js";
import { isOver, moment, nameOf, stateInWords } from "./words.js";

const MANY = 30;
// While one is under way, and while none is.
const LOOK_EVERY_S = { busy: 2, quiet: 15 };
const KINDS = [["", "all"], ["queued,running,waiting", "under way"], ["done", "done"], ["failed,cancelled", "failed or cancelled"]];

export class JobList {
  /** @param {(id: string) => void} onOpen */
  constructor(onOpen) {
    this.onOpen = onOpen;
    this.jobs = new Map();
    this.items = new Map();
    this.open = null;
    this.older = null;
    const id = fresh("jobs");
    this.kind = h("select", { id, onchange: () => this.restart() }, KINDS.map(([value, text]) => h("option", { value }, text)));
    this.list = h("ul", { class: "jobs", "aria-label": "Screenings, newest first" });
    this.none = h("p", { class: "hint", hidden: true }, "There are none yet.");
    this.more = h("button", { type: "button", class: "small", hidden: true, onclick: () => this.showOlder() }, "Show older ones");
    this.fault = h("p", { class: "problem", role: "alert", hidden: true });
    this.element = h("div", {}, h("p", { class: "row" }, h("label", { for: id }, "Show"), this.kind), this.fault, this.none, this.list, this.more);
  }

  /** Look now, and again from time to time, until `stop`. */
  start() {
    this.stop();
    const stopped = (this.abort = new AbortController()).signal;
    const turn = async () => {
      await this.refresh(stopped);
      if (stopped.aborted) return;
      const busy = [...this.jobs.values()].some((job) => !isOver(job));
      this.timer = setTimeout(turn, 1000 * (busy ? LOOK_EVERY_S.busy : LOOK_EVERY_S.quiet));
    };
    turn();
  }

  stop() {
    this.abort?.abort();
    clearTimeout(this.timer);
  }

  restart() {
    this.jobs.clear();
    this.older = null;
    this.start();
  }

  async refresh(signal) {
    await this.load(`v1/screenings?limit=${MANY}${this.kind.value ? `&state=${this.kind.value}` : ""}`, signal);
  }

  async showOlder() {
    await this.load(this.older, this.abort.signal, true);
  }

  async load(path, signal, isOlder = false) {
    try {
      const { jobs, next } = await ask(path, undefined, { signal });
      const first = this.jobs.size === 0;
      jobs.forEach((job) => this.jobs.set(job.id, job));
      // A look at the newest says nothing of where the oldest shown is.
      if (isOlder || first || this.jobs.size <= MANY) this.older = next;
      this.fault.hidden = true;
      this.show();
    } catch (error) {
      if (isSilent(error) || error.status === 401) return;
      this.fault.hidden = false;
      fill(this.fault, inWords(error));
    }
  }

  /** What is known of one of them now. */
  put(job) {
    this.jobs.set(job.id, job);
    this.show();
  }

  mark(id) {
    this.open = id;
    this.show();
  }

  show() {
    const sorted = [...this.jobs.values()].sort((a, b) => (a.created_at < b.created_at ? 1 : -1));
    for (const job of sorted) this.item(job);
    const wanted = sorted.map((job) => this.items.get(job.id).element);
    // Only where something is new: putting a button anew would take the focus from it.
    if (wanted.some((element, i) => this.list.children[i] !== element) || this.list.children.length !== wanted.length) fill(this.list, wanted);
    this.none.hidden = sorted.length > 0;
    this.none.textContent = this.kind.value ? "There are none of this kind." : "There are none yet.";
    this.more.hidden = !this.older;
  }

  item(job) {
    if (!this.items.has(job.id)) {
      const [name, state, bar, about] = [h("strong"), h("span", { class: "state" }), h("progress", { max: 1, "aria-hidden": "true" }), h("span", { class: "hint" })];
      const button = h("button", { type: "button", class: "job", onclick: () => this.onOpen(job.id) }, name, state, bar, about);
      this.items.set(job.id, { element: h("li", {}, button), button, name, state, bar, about });
    }
    const { button, name, state, bar, about } = this.items.get(job.id);
    name.textContent = nameOf(job);
    state.textContent = stateInWords(job);
    state.dataset.state = job.state;
    bar.value = job.progress.share;
    bar.hidden = isOver(job);
    fill(about, moment(job.created_at), job.owner ? `, ${job.owner}` : "");
    if (job.id === this.open) button.setAttribute("aria-current", "true");
    else button.removeAttribute("aria-current");
  }
}
