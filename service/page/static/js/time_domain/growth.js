/**
 * Growth of the simulated vibration, to be held against the exact core's.
 *
 * What repeats each revolution, as the deflection by an oval casing does, is no vibration of its own: so the
 * motion's change from one revolution to the next, x(t) − x(t − τ), is looked at. Of a motion with Floquet
 * multiplier μ it is multiplied by |μ| each revolution, as the motion itself is. The exact core answers for
 * permanent contact and for small motions: only revolutions in which every contact node cut the liner at every
 * angle are fitted.
 */

const FEWEST = 6; // revolutions, as the service's own fit of growth has it
const FAINTEST = 1e-9; // of the largest displacement: below, rounding is looked at
const SPECTRUM_REVOLUTIONS = 8;
const LAST = 10; // revolutions that tell how it ends
const STEADY = 0.005; // ln of the change a revolution, that counts as neither growing nor dying away

/**
 * RMS of x(t) − x(t − τ) over each revolution and all contact nodes.
 * @param {Response} response
 * @returns {Float64Array} m; of the first revolution there is none: NaN
 */
export function changes({ displacement, perRevolution: n, revolutions }) {
  const out = new Float64Array(revolutions).fill(NaN);
  for (let q = 1; q < revolutions; q += 1) {
    let sum = 0;
    for (const x of displacement) for (let i = q * n; i < (q + 1) * n; i += 1) sum += (x[i] - x[i - n]) ** 2;
    out[q] = Math.sqrt(sum / (n * displacement.length));
  }
  return out;
}

/**
 * The longest run of revolutions, [first, past the last], in which each contact node was on the liner and cut it
 * at every angle: forces above 0, and a motion that changes by less than the depth cut in that revolution.
 */
export function keptContact(response) {
  const { force, displacement, perRevolution: n, revolutions, cutDepth } = response;
  const small = (x, q) => {
    for (let i = q * n; i < (q + 1) * n; i += 1) if (!(Math.abs(x[i] - x[i - n]) < cutDepth[q])) return false;
    return true;
  };
  let best = [0, 0];
  let first = 1;
  for (let q = 1; q <= revolutions; q += 1) {
    const kept = q < revolutions && displacement.every((x) => small(x, q)) && force.every((f) => f.subarray(q * n, (q + 1) * n).every((value) => value > 0));
    if (kept) continue;
    if (q - first > best[1] - best[0]) best = [first, q];
    first = q + 1;
  }
  return best;
}

/**
 * The growth while contact is kept; null where it is not kept long enough.
 * @returns {{first: number, last: number, kept: number[], growth: number, uncertainty: number, level: number, hz: number}|null}
 *          `first` and `last` revolution fitted, from 0; `growth` ln |μ|; `level` ln of the change [m] in `first`
 *          by the fit
 */
export function fittedGrowth(response, change, highestHz) {
  const [start, stop] = keptContact(response);
  const floor = FAINTEST * response.displacement.reduce((most, x) => x.reduce((a, b) => Math.max(a, Math.abs(b)), most), 0);
  let end = stop;
  for (let q = start; q < end; q += 1) if (!(change[q] > floor)) end = q;
  // The first touch rings in every mode: the last half shows the one that lasts.
  const begin = Math.max(start, end - Math.max(FEWEST, Math.ceil((end - start) / 2)));
  if (end - begin < FEWEST) return null;
  const logs = Array.from(change.subarray(begin, end), Math.log);
  const { slope, level } = line(logs);
  const half = Math.floor(logs.length / 2);
  const parts = [logs.slice(0, -half), logs.slice(half)].map((part) => Math.abs(line(part).slope - slope));
  return {
    first: begin, last: end - 1, kept: [start, stop - 1], growth: slope, uncertainty: Math.max(...parts), level,
    hz: frequency(response, end, Math.min(SPECTRUM_REVOLUTIONS, end - begin), highestHz),
  };
}

/** Least squares; level at 0. */
function line(y) {
  const [n, mid] = [y.length, (y.length - 1) / 2];
  const mean = y.reduce((a, b) => a + b, 0) / n;
  let [top, bottom] = [0, 0];
  y.forEach((value, i) => {
    top += (i - mid) * (value - mean);
    bottom += (i - mid) ** 2;
  });
  return { slope: top / bottom, level: mean - (top / bottom) * mid };
}

/** Strongest frequency of the first contact node's changes in so many revolutions before `end`, Hz. */
function frequency({ displacement: [x], perRevolution: n, speedHz }, end, many, highestHz) {
  const size = many * n;
  const from = end * n - size;
  const signal = Float64Array.from({ length: size }, (_, i) =>
    (x[from + i] - x[from + i - n]) * Math.sin((Math.PI * (i + 0.5)) / size) ** 2); // Hann's window
  const step = 1 / (2 * many); // of the rotor speed: half a line of the spectrum
  const amplitudes = [];
  for (let order = step; order * speedHz < highestHz && order < n / 2; order += step) amplitudes.push(amplitude(signal, (2 * Math.PI * order) / n));
  const k = amplitudes.indexOf(Math.max(...amplitudes));
  const [a, b, c] = [k - 1, k, k + 1].map((i) => amplitudes[i] ?? 0);
  const aside = a - 2 * b + c === 0 ? 0 : (0.5 * (a - c)) / (a - 2 * b + c);
  return (k + 1 + aside) * step * speedHz;
}

/** |Σ x e^(−i angle k)|, by Goertzel's recurrence. */
function amplitude(signal, angle) {
  const twice = 2 * Math.cos(angle);
  let [s1, s2] = [0, 0];
  for (let i = 0; i < signal.length; i += 1) [s1, s2] = [signal[i] + twice * s1 - s2, s1];
  return Math.sqrt(Math.max(s1 * s1 + s2 * s2 - twice * s1 * s2, 0));
}

/**
 * How the simulation ends.
 * @returns {{way: "grows"|"settles"|"goes on", slope: number, peak: number, most: number, last: number}}
 *          `peak` the revolution (from 0) of the largest change, `most` and `last` changes [m]
 */
export function ending(change) {
  const all = Array.from(change).slice(1);
  const part = all.slice(-LAST);
  const slope = part.length > 1 ? line(part.map((value) => Math.log(Math.max(value, 1e-300)))).slope : 0;
  const most = Math.max(...all);
  const way = !(most > 0) || slope < -STEADY ? "settles" : slope > STEADY ? "grows" : "goes on";
  return { way, slope, peak: all.indexOf(most) + 1, most, last: all.at(-1) };
}
