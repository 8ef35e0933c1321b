/** One screening: how far it is, what it found, and what can be taken away of it. */

import { fill, fresh, h, say } from "../dom.js";
import { inWords, isSilent } from "../problem_note.js";
import { ask, events, follow } from "../service.js";
import { downloadButtons } from "./downloads.js";
import { Ranking } from "./ranking.js";
import { isOver, moment, nameOf, ranFor, stateInWords } from "./words.js";

export class JobView {
  /** @param {App} app  @param {(job: Object) => void} onChange */
  constructor(app, onChange) {
    this.app = app;
    this.onChange = onChange;
    this.id = null;
    this.job = null;
    const title = fresh("job");
    this.title = h("h2", { id: title, tabIndex: -1 });
    this.about = h("p", { class: "hint" });
    this.bar = h("progress", { max: 1, value: 0, "aria-labelledby": title });
    this.state = h("p", { class: "state" });
    const button = (text, run) => h("button", { type: "button", onclick: run, hidden: true }, text);
    this.cancel = button("Cancel", () => this.change("", "DELETE"));
    this.retry = button("Run again", () => this.change("/retry", "POST"));
    this.fault = h("p", { class: "problem", role: "alert", hidden: true });
    this.ranking = new Ranking(app);
    this.taken = h("div", { class: "row no-print", role: "group", "aria-label": "Downloads" });
    this.element = h("div", { class: "job-view" }, this.title, this.about,
      h("div", { class: "row progress" }, this.bar, this.state, this.cancel, this.retry),
      this.fault, this.taken, this.ranking.element);
    // Another key may be given, or the service started again, after a refusal.
    events.addEventListener("back", () => this.stopped && this.element.isConnected && this.follow());
  }

  /** Show a screening, and go on looking at it. */
  open(id) {
    if (id !== this.id) {
      this.id = id;
      this.job = null;
      fill(this.title, "Screening…");
      fill(this.about);
      fill(this.state);
      this.refuse(null);
      fill(this.taken, downloadButtons(id, (error) => this.refuse(error)));
      this.taken.hidden = true;
      this.ranking.begin(id);
    }
    this.follow();
  }

  async follow() {
    this.close();
    const { signal } = (this.abort = new AbortController());
    this.stopped = false;
    try {
      await follow(`v1/screenings/${this.id}`, (job) => signal.aborted || this.update(job), signal);
    } catch (error) {
      if (signal.aborted) return;
      this.stopped = true;
      if (!this.job) fill(this.title, "This screening cannot be shown");
      this.refuse(error);
    }
  }

  /** Look no longer; the job goes on in the service. */
  close() {
    this.abort?.abort();
  }

  update(job) {
    const before = this.job;
    this.job = job;
    const over = isOver(job);
    fill(this.title, nameOf(job));
    fill(this.about, "asked for ", moment(job.created_at), job.owner ? ` by ${job.owner}` : "", `, priority ${job.priority}`,
      job.attempt > 1 ? `, attempt ${job.attempt}` : "", over && ranFor(job) ? `, ran for ${ranFor(job)}` : "");
    this.bar.value = job.progress.share;
    this.bar.hidden = over;
    this.state.textContent = stateInWords(job);
    this.state.dataset.state = job.state;
    const may = this.app.may("submit");
    this.cancel.hidden = over || !may;
    this.retry.hidden = !over || !may;
    this.retry.textContent = job.state === "done" ? "Run again" : "Run the rest";
    this.taken.hidden = !job.progress.done;
    this.fault.hidden = !job.error;
    if (job.error) fill(this.fault, h("strong", {}, "It failed. "), h("code", {}, job.error.field), ` = ${job.error.value}: ${job.error.remedy}`);
    if (before?.state !== job.state) say(`${nameOf(job)}: ${stateInWords(job)}`);
    if (before?.state !== job.state || before?.progress.done !== job.progress.done) this.ranking.refresh();
    this.onChange(job);
  }

  async change(path, method) {
    this.refuse(null);
    try {
      this.update(await ask(`v1/screenings/${this.id}${path}`, undefined, { method }));
      this.follow();
    } catch (error) {
      this.refuse(error);
    }
  }

  refuse(error) {
    this.fault.hidden = !error || isSilent(error);
    fill(this.fault, error ? inWords(error) : []);
  }
}
