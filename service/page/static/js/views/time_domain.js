/** Time domain: a rub of the abradable liner, simulated at a point of the map or over a range of speeds. */

import { fill, h, say } from "../dom.js";
import { SpeedUnit } from "../format.js";
import { Problem, Unreachable, ask, events, follow, request } from "../service.js";
import { EarlierList } from "../time_domain/earlier.js";
import { JobPanel, OVER } from "../time_domain/job_panel.js";
import { outcomeOf } from "../time_domain/outcome.js";
import { QuestionForm } from "../time_domain/question.js";
import { ResponseResult } from "../time_domain/response_result.js";
import { WearResult } from "../time_domain/wear_result.js";

const BETWEEN_MS = 1000; // results of a running job are not asked for more often

export class TimeView {
  constructor(app) {
    this.app = app;
    this.question = new QuestionForm(app, (body) => this.submit(body));
    this.panel = new JobPanel(app, { cancel: () => this.change("DELETE", ""), retry: () => this.change("POST", "/retry") });
    this.earlier = new EarlierList((id) => this.open(id));
    this.response = new ResponseResult();
    this.wear = new WearResult((hz) => this.lookCloser(hz));
    this.result = h("div", { class: "result" });
    this.element = h(
      "section", { "aria-label": "Time domain", class: "time-domain" }, h("h2", {}, "Time domain: what comes of a rub"),
      h("p", { class: "no-print" }, "The stability map says whether vibration starts. Here the blade rubs its liner in time: how far the tip moves, how deep the liner is cut, and whether it ends by itself."),
      this.question.element, this.earlier.element, this.panel.element, this.result,
    );
    app.onChange((what) => this.changed(what));
    events.addEventListener("back", () => this.visible && this.resume());
  }

  show() {
    this.visible = true;
    this.question.refresh();
    this.draw();
    this.resume();
  }

  hide() {
    this.visible = false;
    this.stop();
  }

  changed(what) {
    if (["design", "designs", "range", "unit", "point", "caller"].includes(what)) this.question.refresh();
    if (what === "caller" && this.panel.job) this.panel.show(this.panel.job);
    if (what === "designs" && this.visible && this.app.simulation && this.app.simulation !== this.job) this.open(this.app.simulation);
    if (what === "theme" || what === "unit") this.draw();
  }

  /** Go on with what was looked at, or with what the link names. */
  resume() {
    this.earlier.load();
    const id = this.app.simulation;
    if (id && !(this.job === id && (this.following || this.complete))) this.open(id);
  }

  stop() {
    this.stopper?.abort();
    this.busy(false);
  }

  /** Whether there is more to come. */
  busy(now) {
    this.following = now;
    this.result.setAttribute("aria-busy", now);
  }

  async submit(body) {
    // The same request once more, after nobody answered, is the same job.
    const text = JSON.stringify(body);
    if (this.asked !== text) [this.asked, this.askedKey] = [text, freshKey()];
    try {
      const job = await ask("v1/simulations", body, { headers: { "Idempotency-Key": this.askedKey } });
      this.asked = null;
      this.open(job.id, job);
    } catch (error) {
      if (error instanceof Problem) this.question.refuse(error);
      else if (error instanceof Unreachable) this.question.refuseWhole("The service does not answer, so nothing was asked of it. What you typed stays: try again when it is back.");
      else if (error.name !== "AbortError") throw error;
    }
  }

  /** Follow a job to its end, and show what there is of it. */
  async open(id, job = null) {
    this.stop();
    const stopper = new AbortController();
    this.stopper = stopper;
    if (this.job !== id) this.forget();
    Object.assign(this, { job: id, complete: false });
    this.busy(true);
    this.app.simulation = id;
    this.earlier.mark(id);
    if (job) this.told(job);
    const path = `v1/simulations/${id}`;
    try {
      const first = job ?? await ask(path, undefined, { signal: stopper.signal });
      if (!job) this.told(first);
      const last = OVER.includes(first.state) ? first : await follow(path, (now) => this.told(now), stopper.signal);
      if (last.progress.done > 0) await this.fetch(id, stopper.signal);
      this.complete = true;
    } catch (error) {
      if (error instanceof Problem) this.panel.refuse(error);
      else if (!(error instanceof Unreachable) && error.name !== "AbortError") throw error;
      // A service that is about to stop says 503 before it is away.
      if (error.status === 503) setTimeout(() => this.stopper === stopper && this.visible && this.open(id), BETWEEN_MS);
    } finally {
      if (this.stopper === stopper) this.busy(false);
    }
  }

  /** A job is further. */
  told(job) {
    this.panel.show(job);
    this.earlier.update(job);
    const due = Date.now() - (this.fetchedAt ?? 0) > BETWEEN_MS;
    if (OVER.includes(job.state) || job.progress.done < 2 || job.progress.done === this.fetchedDone || !due || this.fetching) return;
    this.fetchedDone = job.progress.done;
    this.fetch(job.id, this.stopper.signal).catch(() => {}); // the next one, or the end, says it
  }

  async fetch(id, signal) {
    this.fetching = true;
    try {
      const outcome = await outcomeOf(id, signal);
      if (this.job !== id || signal.aborted || !outcome.after(this.outcome)) return;
      this.outcome = outcome;
      this.draw();
      if (outcome.figures.complete) say(this.shown.sentence.textContent);
    } finally {
      this.fetching = false;
      this.fetchedAt = Date.now();
    }
  }

  forget() {
    Object.assign(this, { outcome: null, shown: null, fetchedAt: 0, fetchedDone: 0 });
    fill(this.result);
  }

  draw() {
    if (!this.outcome || !this.visible) return;
    const shown = this.outcome.response ? this.response : this.wear;
    if (shown !== this.shown) fill(this.result, shown.element);
    this.shown = shown;
    shown.draw(this.outcome, this.unit);
  }

  /** The reader's unit; the ratio needs f₁ of the same blade, which only the active design can give. */
  get unit() {
    const other = this.app.active?.blade.name !== this.outcome.figures.blade;
    return this.app.unitName === "ratio" && other ? new SpeedUnit("hz", 1) : this.app.unit;
  }

  async change(method, what) {
    try {
      const job = await (await request(`v1/simulations/${this.job}${what}`, { method })).json();
      if (what) {
        this.forget();
        this.open(job.id, job);
      } else this.told(job);
    } catch (error) {
      if (error instanceof Problem) this.panel.refuse(error);
      else if (!(error instanceof Unreachable)) throw error;
    }
  }

  lookCloser(hz) {
    this.question.setPoint(hz);
    say(`The speed is now ${this.app.unit.write(hz)}`);
  }
}

/** For the service to know a request again; crypto.randomUUID is missing on plain HTTP. */
const freshKey = () => Array.from(crypto.getRandomValues(new Uint8Array(16)), (byte) => byte.toString(16).padStart(2, "0")).join("");
