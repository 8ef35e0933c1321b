/** Figures of a model's card, whatever version wrote it. */

const CLASSES = { permanent: "permanent contact", arcs: "arcs of contact", smooth: "smooth engagement" };
/** The rate that the service answers under unless it is asked for another. */
const USUAL_ALPHA = 5e-4;

/** A class of contact for people. */
export const inWords = (contact) => CLASSES[contact] ?? contact;

/** Evaluation by class of contact; an older card has that of permanent contact alone. */
export function evaluations(card) {
  const found = card.evaluation ?? {};
  if (found.auto) return { permanent: found };
  return Object.fromEntries(Object.keys(CLASSES).filter((name) => found[name]).map((name) => [name, found[name]]));
}

export const certificates = (card) => card.certificates ?? [];

/** The line of a class's certificate that is used unless another rate is asked for; else its strictest. */
export function usualLine(card, contact) {
  const table = certificates(card).find((one) => one.contact === contact)?.table ?? [];
  return table.find((line) => line.alpha === USUAL_ALPHA) ?? [...table].sort((a, b) => a.alpha - b.alpha)[0];
}

/** Rounds of labels with what had then to be verified, by class; [] where the card keeps none. */
export function rounds(card) {
  return (card.dataset?.rounds ?? []).filter((round) => round.labels && round.verified_share);
}

/**
 * What models are compared by, of the classes of contact that any of them knows.
 * @returns {{title: string, of: (card: Object) => number|undefined, less: boolean|null}[]} `less`: the less the
 *          better; null where neither is
 */
export function keyFigures(contacts) {
  const each = (contact) => [
    { title: `Verified exactly, ${inWords(contact)}`, of: (card) => usualLine(card, contact)?.verified_share, less: true },
    { title: `False stable with verification, ${inWords(contact)}`, of: (card) => rate(evaluations(card)[contact]?.auto), less: true },
    { title: `False stable without, ${inWords(contact)}`, of: (card) => rate(evaluations(card)[contact]?.alone), less: true },
    { title: `Median error of the boundary, ${inWords(contact)}`, of: (card) => evaluations(card)[contact]?.median_boundary_error, less: true },
  ];
  return contacts.flatMap(each);
}

/** Of those called stable, how many were not. */
export const rate = (counts) => (counts?.answered_stable ? counts.false_stable / counts.answered_stable : undefined);
/** Of those called unstable, how many were not. */
export const otherRate = (counts) => (counts?.answered_unstable ? counts.false_unstable / counts.answered_unstable : undefined);
