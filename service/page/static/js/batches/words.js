/** Words and times of screenings. */

import { h } from "../dom.js";

const OVER = ["done", "failed", "cancelled"];
const STATES = {
  queued: "waiting for its turn", running: "running", waiting: "on hold", done: "done", failed: "failed", cancelled: "cancelled",
};

export const isOver = (job) => OVER.includes(job.state);
export const nameOf = (job) => job.name ?? `Screening ${job.id.slice(0, 8)}`;

/** "running, 12 of 40 blades, about 3 min left" */
export function stateInWords(job) {
  const parts = [STATES[job.state] ?? job.state];
  const { done, total, remaining_s: left } = job.progress;
  if (job.waiting_for) parts.push(`waits for ${job.waiting_for}`);
  if (total) parts.push(isOver(job) && done === total ? counted(total, "blade") : `${done} of ${counted(total, "blade")}`);
  if (job.not_screened) parts.push(`${job.not_screened} not screened`);
  if (!isOver(job) && left !== null) parts.push(`about ${duration(left)} left`);
  return parts.join(", ");
}

export const counted = (count, thing) => `${count.toLocaleString("en-US")} ${thing}${count === 1 ? "" : "s"}`;

/** A time one can wait for: "40 s", "3 min", "2 h 10 min". */
export function duration(seconds) {
  if (seconds < 90) return `${Math.max(1, Math.round(seconds))} s`;
  const minutes = Math.round(seconds / 60);
  return minutes < 90 ? `${minutes} min` : `${Math.floor(minutes / 60)} h ${minutes % 60} min`;
}

const DAY = new Intl.DateTimeFormat("en-GB", { day: "numeric", month: "short", year: "numeric" });
const TIME = new Intl.DateTimeFormat("en-GB", { hour: "2-digit", minute: "2-digit" });

/** A moment in the reader's own time; hovering shows it in UTC. */
export function moment(iso) {
  if (!iso) return h("span", {}, "–");
  const at = new Date(iso);
  const today = at.toDateString() === new Date().toDateString();
  return h("time", { dateTime: iso, title: `${iso} (UTC)` }, `${today ? "today" : DAY.format(at)} ${TIME.format(at)}`);
}

/** How long a job ran; "" where that cannot be said. */
export function ranFor(job) {
  if (!job.started_at || !job.finished_at) return "";
  return duration((new Date(job.finished_at) - new Date(job.started_at)) / 1000);
}

/** A contact's verdict at the liner, told apart without colour too. */
export function verdictMark(verdict) {
  const [sign, kind] = { stable: ["✓", "met"], "unstable at some speed": ["✗", "missed"] }[verdict] ?? ["?", "unsure"];
  return verdict ? h("span", { class: `verdict ${kind}` }, h("span", { "aria-hidden": "true" }, sign), h("span", {}, verdict)) : "–";
}
