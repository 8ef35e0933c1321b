/**
 * A profile's blade with other thickness or lean, at once: modal data between blades that the service has built
 * from a coarse mesh, their change put on top of the blade from the mesh that was asked for. What is shown so is
 * an estimate, and a blade built at the very shape takes its place.
 */

import { ask } from "../service.js";

/** The coarse mesh: frequencies within a percent of a fine one, and their changes by much less. */
const COARSE = { chord: 8, span: 10, thickness: 1 };
const REACH = { thickness: [0.9, 1.1], lean_deg: [-4, 4] };
const NOMINAL = { thickness: 1, lean_deg: 0 };
const KEYS = ["mode_shape", "mode_shape_radial", "mode_shape_tangential"];

export class ProfileShapes {
  /** @param {Object} profile rubscreen/profile/1 */
  constructor(profile) {
    this.profile = profile;
    this.coarse = null;
    this.sides = {};
  }

  /** The blade of the profile as it stands. */
  static async build(profile, shape_change, signal) {
    const body = { profile, verify: false, ...(shape_change ? { shape_change } : {}) };
    return ask("v1/blades", body, { signal });
  }

  static coarseOf(profile) {
    return { ...profile, mesh: COARSE };
  }

  /** Build the blades between which is interpolated. @param {(done: number, total: number) => void} progress */
  async prepare(progress, signal) {
    const steps = Object.entries(REACH).flatMap(([name, ends]) => ends.map((value) => [name, value]));
    const coarse = ProfileShapes.coarseOf(this.profile);
    this.coarse = (await ProfileShapes.build(coarse, null, signal)).blade;
    progress(1, steps.length + 1);
    for (const [i, [name, value]] of steps.entries()) {
      const { blade } = await ProfileShapes.build(coarse, { [name]: value }, signal);
      (this.sides[name] ??= []).push({ value, blade: alignedTo(this.coarse, blade) });
      progress(i + 2, steps.length + 1);
    }
    this.ready = true;
  }

  /**
   * The blade at a shape, estimated: a parabola in each parameter through its two sides and the middle, of
   * ω² and of the mode shapes, added up over the parameters.
   * @param {Object} base blade of the profile as it stands, from the mesh that was asked for
   */
  estimate(base, shape) {
    const like = alignedTo(base, this.coarse);
    const turned = (side) => alignedTo(like, side);
    const states = base.states.map((state, i) => {
      const square = state.frequency_hz.map((f) => f ** 2);
      const shapes = Object.fromEntries(KEYS.filter((key) => state[key]).map((key) => [key, structuredClone(state[key])]));
      for (const [name, sides] of Object.entries(this.sides)) {
        const [low, high] = sides.map(({ value, blade }) => ({ value, state: turned(blade).states[i] }));
        const weights = lagrange(shape[name], low.value, NOMINAL[name], high.value);
        const middle = like.states[i];
        square.forEach((_, j) => {
          // As a share of the coarse blade's, for a coarse mesh is a little too stiff throughout.
          const changed = weights[0] * low.state.frequency_hz[j] ** 2 + weights[1] * middle.frequency_hz[j] ** 2 + weights[2] * high.state.frequency_hz[j] ** 2;
          square[j] *= changed / middle.frequency_hz[j] ** 2;
        });
        for (const key of Object.keys(shapes)) {
          shapes[key].forEach((row, j) => row.forEach((_, k) => {
            row[k] += weights[0] * low.state[key][j][k] + (weights[1] - 1) * middle[key][j][k] + weights[2] * high.state[key][j][k];
          }));
        }
      }
      return { ...state, frequency_hz: square.map(Math.sqrt), ...shapes };
    });
    return { ...base, states };
  }
}

/** Weights of the parabola through three values, at x. */
const lagrange = (x, a, b, c) => [
  ((x - b) * (x - c)) / ((a - b) * (a - c)), ((x - a) * (x - c)) / ((b - a) * (b - c)), ((x - a) * (x - b)) / ((c - a) * (c - b)),
];

/** `blade` with its modes signed like those of `like`: a mode shape's sign means nothing. */
function alignedTo(like, blade) {
  const states = blade.states.map((state, i) => {
    const other = like.states[i] ?? like.states.at(-1);
    const signs = state.mode_shape.map((row, j) => (row.reduce((sum, v, k) => sum + v * other.mode_shape[j][k], 0) < 0 ? -1 : 1));
    const turned = KEYS.filter((key) => state[key]).map((key) => [key, state[key].map((row, j) => row.map((v) => v * signs[j]))]);
    return { ...state, ...Object.fromEntries(turned) };
  });
  return { ...blade, states };
}
