/** What is shown where a request was refused. */

import { h } from "./dom.js";
import { Problem, Unreachable } from "./service.js";

/**
 * The problem in words, for an element of class "problem".
 * @param {Error} error
 * @returns {Array<Node|string>}
 */
export function inWords(error) {
  if (error instanceof Unreachable) return ["The service does not answer. It is asked again as soon as it does."];
  if (!(error instanceof Problem)) return [error.message];
  const where = error.field ? [h("code", {}, error.field), ` = ${error.value}: ${error.remedy}`] : [error.message];
  return [h("strong", {}, `${error.title}. `), ...where];
}

/** The same as an element that is read out at once. */
export const problemNote = (error) => h("p", { class: "problem", role: "alert" }, inWords(error));

/** Whether an error needs no words: it was asked for, or the banner says it already. */
export const isSilent = (error) => error.name === "AbortError" || error instanceof Unreachable;
