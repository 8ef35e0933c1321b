/** One plain sentence: does the simulation grow or settle, and does the exact core agree? */

import { number, percent } from "../format.js";

const micro = (metres) => `${number(metres * 1e6, 3)} µm`;
const signed = (value) => (value === null || value === undefined ? "–" : `${value >= 0 ? "+" : ""}${number(value, 3)}`);

/** ln |μ| in words: "+0.0859 (9 % a revolution)". */
export const growthWords = (growth) =>
  growth === null || growth === undefined ? "–" : `${signed(growth)} (${growth >= 0 ? "+" : ""}${percent(Math.expm1(growth), 2)} a revolution)`;

/** What the exact core says, as words in a sentence. */
export function exactWords(stable) {
  if (stable === null || stable === undefined) return "the exact core did not decide";
  return stable ? "permanent contact is stable" : "permanent contact is unstable";
}

/**
 * @param {Object} fitted of growth.js, or null  @param {Object} end of growth.js
 * @param {boolean|null} stable of the exact core  @param {boolean} through whether the liner was worn through
 * @returns {{text: string, look: "good"|"warning"|"note", agrees: boolean|null}}
 */
export function verdict(fitted, end, stable, through, revolutions) {
  const parts = fitted ? keptSentences(fitted, end, stable) : looseSentences(end, stable);
  if (through) parts.push(`The liner was worn through in revolution ${revolutions}, and the simulation ended there.`);
  const agrees = agreement(fitted, stable);
  const harmless = agrees === true && fitted.growth < 0;
  return { text: parts.join(" "), look: harmless && !through ? "good" : "warning", agrees };
}

/** Whether fit and exact core say the same; null where either does not say. */
export function agreement(fitted, stable) {
  if (!fitted || stable === null || stable === undefined || Math.abs(fitted.growth) <= fitted.uncertainty) return null;
  return fitted.growth < 0 === stable;
}

function keptSentences(fitted, end, stable) {
  const { growth, uncertainty, first, last, kept } = fitted;
  const agrees = agreement(fitted, stable);
  const rate = percent(Math.abs(Math.expm1(growth)), 2);
  const does = Math.abs(growth) <= uncertainty ? "neither grows nor dies away beyond what the fit can tell" : growth > 0 ? `grows by ${rate} a revolution` : `dies away by ${rate} a revolution`;
  const core = { true: "and the exact core agrees", false: "but the exact core says otherwise", null: "the exact core answers" }[agrees];
  const parts = [`The simulated vibration ${does} (revolutions ${first + 1} to ${last + 1}), ${core}: ${exactWords(stable)}.`];
  const left = kept[1] + 1 < end.count;
  if (left && end.peak > kept[1]) {
    const after = { grows: "and still grows at the end", settles: "and then dies down", "goes on": "and goes on to the end" }[end.way];
    parts.push(`From revolution ${kept[1] + 2} on the tip no longer cuts all the way round: the vibration is strongest in revolution ${end.peak + 1} ${after}.`);
  }
  return parts;
}

function looseSentences(end, stable) {
  const does = {
    grows: `still grows at the end, where it changes by ${micro(end.last)} from one revolution to the next`,
    settles: end.most > 0 ? `settles: its change from one revolution to the next falls from ${micro(end.most)} (revolution ${end.peak + 1}) to ${micro(end.last)}` : "does not move: the tip never touches",
    "goes on": `goes on, changing by about ${micro(end.last)} from one revolution to the next`,
  }[end.way];
  const core = stable === null || stable === undefined ? "The exact core did not decide." : `The exact core: ${exactWords(stable)}.`;
  return [
    `The simulated vibration ${does}. ${core}`,
    "The two answer different questions here: the tip comes and goes. To hold them together, let the casing close in evenly, with revolutions enough that the liner is cut.",
  ];
}
