/** Elements without markup: nothing a blade's name holds can become HTML. */

/**
 * An element. Properties beginning with "on" are listeners, those that contain "-" or are "role", "for" and
 * the like are attributes, the others are set as properties.
 * @param {string} tag
 * @param {Object} [given]
 * @param {...(Node|string|number|null|undefined|Array)} children
 */
export function h(tag, given = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(given)) {
    if (value === undefined || value === null) continue;
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (name === "class") made.className = value;
    else if (name === "data") Object.assign(made.dataset, value);
    else if (name.includes("-") || ATTRIBUTES.has(name)) made.setAttribute(name, value);
    else made[name] = value;
  }
  made.append(...children.flat(Infinity).filter((child) => child !== null && child !== undefined && child !== false));
  return made;
}

const ATTRIBUTES = new Set(["role", "for", "list", "form", "colspan", "rowspan", "scope", "open"]);
const SVG = "http://www.w3.org/2000/svg";

/** An SVG element; everything given is an attribute, listeners excepted. */
export function s(tag, given = {}, ...children) {
  const made = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(given)) {
    if (value === undefined || value === null) continue;
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else made.setAttribute(name, value);
  }
  made.append(...children.flat(Infinity).filter((child) => child !== null && child !== undefined));
  return made;
}

/** Put these in place of what an element holds. */
export function fill(element, ...children) {
  element.replaceChildren(
    ...children.flat(Infinity).filter((child) => child !== null && child !== undefined && child !== false),
  );
  return element;
}

let numbers = 0;
/** An identifier that no other element has. */
export const fresh = (stem) => `${stem}-${++numbers}`;

/** Say something to who listens to the page instead of looking at it. */
export function say(text) {
  document.getElementById("said").textContent = text;
}

/** `run` once calls have stopped for `ms`. */
export function settled(ms, run) {
  let timer = 0;
  const later = (...args) => {
    clearTimeout(timer);
    timer = setTimeout(() => run(...args), ms);
  };
  later.cancel = () => clearTimeout(timer);
  return later;
}
