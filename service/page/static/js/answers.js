/**
 * What is asked while a design changes: at once the surrogate's map, and as soon as nothing has changed for a
 * moment the exact boundary, the map with its doubtful points re-verified, the Campbell diagram and the lobes.
 */

import { readNpz } from "./npz.js";
import { Problem, Unreachable, ask, request } from "./service.js";

const LIVE = { speeds: 120, stiffnesses: 120 };
/** Permanent contact costs milliseconds; with arcs of contact every exact speed costs some 20. */
const SETTLED = {
  permanent: { speeds: 300, stiffnesses: 150, boundary: [400], lobes: 40 },
  arcs: { speeds: 120, stiffnesses: 120, boundary: [21, 121], lobes: 6 },
};
/** Without a change for so long, the exact core is asked, ms. */
const PAUSE = 90;

export const evenly = (low, high, count) =>
  Array.from({ length: count }, (_, i) => (i === count - 1 ? high : low + ((high - low) * i) / (count - 1)));

/** Rotor speeds evenly spaced in 1/Ω, in which lobes are periodic. */
export const evenlyTimed = (low, high, count) =>
  evenly(1 / low, 1 / high, count).map((inverse, i) => (i === 0 ? low : i === count - 1 ? high : 1 / inverse));

/**
 * A map of stability.
 * @returns {Promise<{speed_hz: number[], ke: number[], stable, probability, source: string[], reason: string[],
 *   model: string, certificate: Object|null, exactShare: number}>} arrays row by row, a row a stiffness
 */
export async function askMap(question, signal) {
  // The surrogate alone gives every point the same source and reason: they need not travel.
  const alone = question.policy === "surrogate";
  const body = alone ? { ...question, fields: ["stable", "unstable_probability"] } : question;
  const response = await request("v1/map", { body, accept: "application/x-npz", signal });
  const found = await readNpz(await response.arrayBuffer());
  const count = found.stable.values.length;
  const source = alone ? new Array(count).fill("surrogate") : found.source.values;
  let exact = 0;
  for (const name of source) if (name === "exact") exact += 1;
  return {
    speed_hz: question.speed_hz,
    ke: question.ke,
    stable: found.stable.values,
    probability: found.unstable_probability.values,
    source,
    reason: alone ? new Array(count).fill("requested") : found.reason.values,
    model: found.model.values[0],
    certificate: JSON.parse(found.certificate.values[0]),
    exactShare: exact / source.length,
  };
}

export const askBoundary = (question, signal) =>
  ask("v1/boundary", question, { signal }).then((found) => ({ ...found, speed_hz: question.speed_hz }));

/**
 * Events, each with what it found as detail: "map" ({map, live, since}), "boundary" ({boundary, since, fine: whether one was shown before}),
 * "campbell", "lobes", "unstable" (the share of speeds), "damping", "searching" and "busy" (true or false), "problem" (Problem or null), "outside" (why the
 * surrogate alone does not answer, or null).
 */
export class Answers extends EventTarget {
  #question = null;
  #since = 0;
  #verified = -1;
  #drawing = false;
  #again = false;
  #timer = 0;
  #exact = new AbortController();

  #tell(name, detail) {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }

  on(name, run) {
    this.addEventListener(name, (event) => run(event.detail));
  }

  /**
   * A new question; what was asked before and is not answered is given up.
   * @param {{blade: Object, contact: Object, range: {low_hz, high_hz, ke_max, ke_liner}}} question
   */
  ask(question) {
    this.#question = question;
    this.#since = performance.now();
    this.#exact.abort();
    this.#exact = new AbortController();
    clearTimeout(this.#timer);
    this.#live();
    this.#timer = setTimeout(() => this.#settle(question, this.#exact.signal), PAUSE);
  }

  stop() {
    clearTimeout(this.#timer);
    this.#exact.abort();
  }

  /** The surrogate's map of the latest question, one at a time: a slider moves faster than maps are drawn. */
  async #live() {
    if (this.#drawing) {
      this.#again = true;
      return;
    }
    this.#drawing = true;
    do {
      this.#again = false;
      const since = this.#since;
      const { blade, contact, range } = this.#question;
      const grid = {
        speed_hz: evenly(range.low_hz, range.high_hz, LIVE.speeds),
        ke: evenly(0, range.ke_max, LIVE.stiffnesses),
      };
      try {
        const map = await askMap({ blade, contact, ...grid, policy: "surrogate" });
        this.#tell("outside", null);
        // Where the surrogate was slower than what verifies it, the better map is on screen already.
        if (this.#verified === since) continue;
        await new Promise((drawn) => this.#tell("map", { map, live: true, since, drawn }));
      } catch (error) {
        // Outside its domain the surrogate says so; what follows is exact then.
        if (error instanceof Problem) this.#tell(error.status === 422 ? "outside" : "problem", error);
        else if (!(error instanceof Unreachable)) throw error;
      }
    } while (this.#again);
    this.#drawing = false;
  }

  /** The damping that the latest question's blade needs for the liner's K_e: of itself only where it is quick. */
  async searchDamping() {
    const { signal } = this.#exact;
    const { blade, contact, range } = this.#question;
    this.#tell("searching", true);
    try {
      const body = { blade, contact, speed_range_hz: [range.low_hz, range.high_hz], ke: range.ke_liner };
      const found = await ask("v1/damping", body, { signal });
      if (!signal.aborted) this.#tell("damping", found);
    } catch (error) {
      if (error.name === "AbortError" || error instanceof Unreachable) return;
      if (!(error instanceof Problem)) throw error;
      this.#tell("problem", error);
    } finally {
      this.#tell("searching", false);
    }
  }

  async #settle({ blade, contact, range }, signal) {
    const how = contact.arcs ? SETTLED.arcs : SETTLED.permanent;
    const since = this.#since;
    const span = [range.low_hz, range.high_hz];
    this.#tell("busy", true);
    try {
      const campbell = ask("v1/campbell", { blade, speed_range_hz: span }, { signal });
      campbell.then((found) => signal.aborted || this.#tell("campbell", found), () => {});
      const [first, ...finer] = how.boundary;
      const boundaryOf = async (count, fine = false) => {
        const speed_hz = evenlyTimed(...span, count);
        const asked = { blade, contact, speed_hz, ke_max: range.ke_max, policy: "exact" };
        const boundary = await askBoundary(asked, signal);
        if (!signal.aborted) this.#tell("boundary", { boundary, since, fine });
      };
      await boundaryOf(first);
      await campbell;
      const grid = { speed_hz: evenly(...span, how.speeds), ke: evenly(0, range.ke_max, how.stiffnesses) };
      const map = askMap({ blade, contact, ...grid, policy: "auto" }, signal).then(
        (found) => {
          if (signal.aborted) return;
          this.#verified = since;
          this.#tell("map", { map: found, live: false, since, drawn: () => {} });
        },
      );
      const lobes = ask(
        "v1/lobes", { blade, contact, speed_range_hz: span, ke_max: range.ke_max, count: how.lobes }, { signal },
      ).then((found) => signal.aborted || this.#tell("lobes", found.lobes));
      await Promise.all([map, lobes, ...finer.map((count) => boundaryOf(count, true))]);
      if (!contact.arcs && range.ke_liner) {
        const { ke_max, ke_liner } = range;
        const found = await ask("v1/lobes", { blade, contact, speed_range_hz: span, ke_max, ke_liner, count: 1 }, { signal });
        if (!signal.aborted) this.#tell("unstable", found);
        await this.searchDamping();
      }
    } catch (error) {
      if (error.name === "AbortError") return;
      if (error instanceof Problem) this.#tell("problem", error);
      else if (!(error instanceof Unreachable)) throw error;
    } finally {
      if (!signal.aborted) this.#tell("busy", false);
    }
  }
}
