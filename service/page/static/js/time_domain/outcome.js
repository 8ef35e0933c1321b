/** What came of a simulation: its figures (JSON) and its arrays (npz), by names and in SI units. */

import { readNpz, rows } from "../npz.js";
import { ask, request } from "../service.js";

/**
 * The results of a job, those there are so far where it runs.
 * @throws {Problem} also where there are none yet
 */
export async function outcomeOf(id, signal) {
  const path = `v1/simulations/${id}/results`;
  const [figures, response] = await Promise.all([ask(path, undefined, { signal }), request(path, { accept: "application/x-npz", signal })]);
  return new Outcome(figures, await readNpz(await response.arrayBuffer()));
}

export class Outcome {
  constructor(figures, arrays) {
    /** As the service gives them: see SimulationReply of the REST interface. */
    this.figures = figures;
    this.arrays = arrays;
    this.response = arrays.response_time_s ? new Response(this) : null;
  }

  /** Whether it says no less than another of the same job: answers may overtake each other. */
  after(other) {
    return !other || this.figures.complete || (!other.figures.complete && this.figures.speed_hz.length >= other.figures.speed_hz.length);
  }

  /** Names of the contact nodes. */
  get nodes() {
    return this.figures.contact_nodes;
  }

  /** Angles that worn depths are kept at, rad. */
  get angle() {
    return this.arrays.angle_rad.values;
  }

  /** Worn depth [m] of contact node j at speed i, over `angle`. */
  worn(i, j) {
    const { shape: [, nodes, angles], values } = this.arrays.worn_m;
    const at = (i * nodes + j) * angles;
    return values.subarray(at, at + angles);
  }

  /** Amplitudes [m] of the first contact node over `frequency`, one row a speed. */
  get spectrum() {
    return rows(this.arrays.spectrum_m);
  }

  get frequency() {
    return this.arrays.frequency_hz.values;
  }
}

/** The motion at one speed, sampled the same number of times each revolution. */
export class Response {
  constructor({ figures, arrays }) {
    this.perRevolution = Number(arrays.response_samples_per_revolution.values[0]);
    const { shape: [samples, nodes], values } = arrays.response_displacement_m;
    // What would have come after the liner was worn through stands there as zeros.
    let end = samples;
    if (figures.worn_through[0]) while (end > this.perRevolution && values.subarray((end - 1) * nodes, end * nodes).every((value) => value === 0)) end -= 1;
    this.samples = end;
    /** Whole ones; the energy account has the last one begun, too. */
    this.revolutions = Math.floor(end / this.perRevolution);
    this.speedHz = figures.speed_hz[0];
    this.displacement = figures.contact_nodes.map((node) => column(values, nodes, figures.tip_nodes.indexOf(node)).subarray(0, end));
    this.force = figures.contact_nodes.map((_, j) => column(arrays.response_force_n.values, figures.contact_nodes.length, j).subarray(0, end));
    this.energy = arrays.response_energy_j.values;
    this.damping = arrays.response_damping_j.values;
    this.contact = arrays.response_contact_j.values;
    this.friction = arrays.response_friction_j.values;
    this.cutDepth = cutDepths(arrays.worn_volume_m3.values, arrays.worn_m.values);
  }

  /** Revolutions gone by at a sample: 0.5 is half a turn. */
  turn(sample) {
    return (sample + 1) / this.perRevolution;
  }
}

/** Mean depth [m] cut in each revolution: volumes [m³] by the end of each go with the depths in the end. */
function cutDepths(volume, worn) {
  const whole = volume.reduce((most, value) => (value > most ? value : most), 0);
  const depth = worn.reduce((sum, value) => sum + value, 0) / worn.length;
  return Float64Array.from(volume, (value, q) => (whole > 0 ? ((value - (q ? volume[q - 1] : 0)) * depth) / whole : 0));
}

const column = (values, width, j) => Float64Array.from({ length: values.length / width }, (_, i) => values[i * width + j]);
