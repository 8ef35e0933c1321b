/** The job that is looked at: its state, how far it is, cancelling it, running it again. */

import { fill, fresh, h, say } from "../dom.js";
import { number } from "../format.js";

export const OVER = ["done", "failed", "cancelled"];
const WORDS = {
  queued: "Waits for its turn", running: "Simulating", waiting: "Waits", done: "Done", failed: "Failed", cancelled: "Cancelled",
};

export class JobPanel {
  /** @param {App} app  @param {{cancel: () => void, retry: () => void}} todo */
  constructor(app, { cancel, retry }) {
    this.app = app;
    const id = fresh("job");
    this.title = h("h3", { id });
    this.state = h("p", { class: "state" });
    this.bar = h("progress", { max: 1, value: 0, "aria-labelledby": id, hidden: true });
    this.cancel = h("button", { type: "button", onclick: cancel, hidden: true }, "Cancel");
    this.retry = h("button", { type: "button", onclick: retry, hidden: true }, "Run again");
    this.fault = h("p", { class: "problem", role: "alert", hidden: true });
    this.element = h("div", { class: "job", hidden: true }, this.title, h("div", { class: "row no-print" }, this.bar, this.state, this.cancel, this.retry), this.fault);
    this.said = "";
  }

  /** Say how the job stands, aloud where its state is another. */
  show(job) {
    this.job = job;
    this.element.hidden = false;
    const over = OVER.includes(job.state);
    const { done, total, share, stage, remaining_s: left } = job.progress;
    this.title.textContent = job.name ?? `Simulation ${job.id.slice(0, 8)}`;
    const parts = [WORDS[job.state] ?? job.state];
    if (job.waiting_for) parts.push(`for ${job.waiting_for}`);
    if (total > 1) parts.push(`${done} of ${total} speeds`);
    if (!over && stage && stage !== "simulating") parts.push(stage);
    if (!over && left !== null) parts.push(`about ${number(Math.ceil(left), 3)} s left`);
    this.state.textContent = parts.join(", ");
    this.bar.value = share;
    this.bar.hidden = over;
    this.cancel.hidden = over || !this.app.may("submit");
    this.retry.hidden = !["failed", "cancelled"].includes(job.state) || !this.app.may("submit");
    this.fault.hidden = !job.error;
    fill(this.fault, job.error && `${job.error.field} = ${job.error.value}: ${job.error.remedy}`);
    if (this.said !== job.state) say(`Simulation: ${this.state.textContent}`);
    this.said = job.state;
  }

  /** Say what went wrong with asking. */
  refuse(problem) {
    this.element.hidden = false;
    this.fault.hidden = false;
    fill(this.fault, h("strong", {}, problem.title), `: ${problem.message}`);
  }
}
