/** A design: a blade as it was loaded, what has been changed of it, and the contact at its tip. */

/** Operating range assumed: from ground idle to a little overspeed, as the service itself takes it. */
const IDLE_SHARE = 0.3;
const OVERSPEED_SHARE = 1.05;
const [LOWEST_RATIO, HIGHEST_RATIO] = [0.05, 0.45];
const SHAPES = ["mode_shape", "mode_shape_radial", "mode_shape_tangential"];

let made = 0;

export class Design {
  /**
   * @param {Object} base blade file (rubscreen/blade/1), checked by the service
   * @param {{profile?: Object, weights?: Object, arcs?: number[][]|null, label?: string}} [more]
   */
  constructor(base, { profile = null, weights, arcs = null, label } = {}) {
    this.id = ++made;
    this.base = base;
    this.profile = profile;
    this.label = label ?? base.name;
    this.weights = weights ?? defaultWeights(base);
    this.arcs = arcs;
    /** The profile built with other thickness or lean; null while the base is what is shown. */
    this.shape = { thickness: 1, lean_deg: 0 };
    this.shapedBase = null;
    this.reset();
  }

  /** Undo every change of damping, frequencies and amplitudes. */
  reset() {
    const n = this.modes;
    this.damping = 1;
    this.frequency = Array(n).fill(1);
    this.amplitude = Array(n).fill(1);
  }

  get modes() {
    return this.base.states[0].frequency_hz.length;
  }

  get nodes() {
    return this.base.tip_nodes;
  }

  get firstHz() {
    return Math.min(...this.base.states[0].frequency_hz);
  }

  /** Damping ratio of each mode, changes included. */
  get dampingRatio() {
    const given = this.base.damping_ratio;
    return Array.from({ length: this.modes }, (_, j) => (Array.isArray(given) ? given[j] : given) * this.damping);
  }

  get changed() {
    return this.damping !== 1 || [...this.frequency, ...this.amplitude].some((factor) => factor !== 1) || this.reshaped;
  }

  get reshaped() {
    return this.shape.thickness !== 1 || this.shape.lean_deg !== 0;
  }

  /** The blade file with every change, as it is sent. */
  get blade() {
    const base = this.shapedBase ?? this.base;
    if (!this.changed) return base;
    const scaled = (rows, factor) => rows.map((row, j) => row.map((value) => value * factor[j]));
    return {
      ...base,
      damping_ratio: this.dampingRatio,
      states: base.states.map((state) => ({
        ...state,
        frequency_hz: state.frequency_hz.map((value, j) => value * this.frequency[j]),
        ...Object.fromEntries(
          SHAPES.filter((key) => state[key]).map((key) => [key, scaled(state[key], this.amplitude)]),
        ),
      })),
    };
  }

  /** The contact as it is sent. */
  get contact() {
    const weights = Object.fromEntries(Object.entries(this.weights).filter(([, weight]) => weight > 0));
    return this.arcs ? { weights, arcs: sortedArcs(this.arcs) } : { weights };
  }

  get touches() {
    return Object.values(this.weights).some((weight) => weight > 0);
  }

  /** Contact in words: "LE + TE, two arcs". */
  get contactName() {
    const touching = Object.entries(this.weights).filter(([, weight]) => weight > 0);
    const names = touching.map(([node, weight]) => (weight === 1 ? node : `${weight} × ${node}`));
    const where = touching.length === this.nodes.length && touching.length > 3 ? "all nodes" : names.join(" + ");
    if (!this.arcs) return where || "no node";
    const share = this.arcs.reduce((sum, [start, end]) => sum + end - start, 0);
    return `${where}, ${this.arcs.length} arc${this.arcs.length > 1 ? "s" : ""} (${Math.round(100 * share)} %)`;
  }

  /** Changes in words: "damping × 1.5"; "" for none. */
  get changeName() {
    const parts = [];
    const times = (factor) => `× ${Number(factor.toFixed(3))}`;
    if (this.damping !== 1) parts.push(`damping ${times(this.damping)}`);
    this.frequency.forEach((factor, j) => factor !== 1 && parts.push(`f${j + 1} ${times(factor)}`));
    this.amplitude.forEach((factor, j) => factor !== 1 && parts.push(`amplitude ${j + 1} ${times(factor)}`));
    if (this.shape.thickness !== 1) parts.push(`thickness ${times(this.shape.thickness)}`);
    if (this.shape.lean_deg !== 0) parts.push(`lean ${this.shape.lean_deg > 0 ? "+" : "−"}${Math.abs(this.shape.lean_deg)}°`);
    return parts.join(", ");
  }

  /** Equal for designs that are the same in every figure. */
  get sameness() {
    return JSON.stringify([this.blade, this.contact]);
  }

  /** What tables and keys call it. */
  get title() {
    return [this.label, this.contactName, this.changeName].filter(Boolean).join(" · ");
  }

  /** Rotor speeds to look at unless told otherwise, Hz. */
  usualRange() {
    const states = this.base.states.map((state) => state.speed_hz);
    const [least, most] = states.length > 1 ? [Math.min(...states), Math.max(...states)] : [0, Infinity];
    const design = this.base.design_speed_hz;
    const low = design ? IDLE_SHARE * design : LOWEST_RATIO * this.firstHz;
    const high = design ? OVERSPEED_SHARE * design : HIGHEST_RATIO * this.firstHz;
    return [Math.max(low, least), Math.min(high, most)];
  }

  /** Rotor speeds that the modal data cover, Hz. */
  coveredRange() {
    const states = this.base.states.map((state) => state.speed_hz);
    return states.length > 1 ? [Math.min(...states), Math.max(...states)] : [0, Infinity];
  }

  /** Take over where another design touches, as far as this blade has nodes of those names. */
  touchAs(other) {
    const touching = Object.entries(other.weights).filter(([, weight]) => weight > 0);
    if (touching.length && touching.every(([node]) => this.nodes.includes(node))) {
      this.weights = Object.fromEntries(this.nodes.map((node) => [node, other.weights[node] ?? 0]));
    }
    this.arcs = structuredClone(other.arcs);
  }

  copy() {
    const twin = new Design(this.base, { profile: this.profile, weights: { ...this.weights }, label: this.label });
    twin.take(this.toState());
    twin.shapedBase = this.shapedBase;
    return twin;
  }

  /** For a link; the blade and profile themselves are put beside, once each. */
  toState() {
    const { label, weights, arcs, damping, frequency, amplitude, shape } = this;
    return structuredClone({ label, weights, arcs, damping, frequency, amplitude, shape });
  }

  take(state) {
    Object.assign(this, structuredClone(state));
    return this;
  }
}

function defaultWeights(base) {
  const nodes = base.tip_nodes;
  const ends = nodes.length > 1 ? [nodes[0], nodes.at(-1)] : nodes;
  return Object.fromEntries(nodes.map((node) => [node, ends.includes(node) ? 1 : 0]));
}

/** Arcs by rising start, in revolutions, the first start within [0, 1). */
export const sortedArcs = (arcs) => [...arcs].sort((a, b) => a[0] - b[0]);
