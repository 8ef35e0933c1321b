/** What can be taken away of a screening: its ranking as a table, and the report. */

import { download } from "../charts/chart.js";
import { h, say } from "../dom.js";
import { ask, objectUrl } from "../service.js";

const TABLES = [["CSV", "text/csv", "csv"], ["Parquet", "application/vnd.apache.parquet", "parquet"]];
// An address is needed only until the browser has begun to read what stands there.
const KEEP_MS = 30_000;
const MOST_ROWS = 1000;

/** @param {string} id of the screening  @param {(error: Error|null) => void} told  @returns {Node[]} */
export function downloadButtons(id, told) {
  const base = `v1/screenings/${id}`;
  const file = (suffix) => `screening-${id.slice(0, 8)}.${suffix}`;
  const button = (text, label, run) => {
    const made = h("button", { type: "button", class: "small", "aria-label": label, onclick: async () => {
      made.disabled = true;
      told(null);
      try {
        await run();
        say(`${label}: done`);
      } catch (error) {
        told(error);
      } finally {
        made.disabled = false;
      }
    } }, text);
    return made;
  };
  const save = (url, name) => {
    download(url, name);
    setTimeout(() => URL.revokeObjectURL(url), KEEP_MS);
  };
  return [
    h("span", {}, "Ranking:"),
    TABLES.map(([text, form, suffix]) => button(text, `Save the ranking as ${text}`, async () => save(await objectUrl(`${base}/results`, form), file(suffix)))),
    button("JSON", "Save the ranking as JSON", async () => {
      const text = JSON.stringify(await wholeRanking(base), null, 1);
      save(URL.createObjectURL(new Blob([text], { type: "application/json" })), file("json"));
    }),
    h("span", {}, "Report to print:"),
    button("Open", "Open the report in a new tab", () => openReport(`${base}/report`)),
    button("Save", "Save the report as HTML", async () => save(await objectUrl(`${base}/report`, "text/html"), file("html"))),
  ];
}

/** Every page of the results as one document. */
async function wholeRanking(base) {
  let page = await ask(`${base}/results?limit=${MOST_ROWS}`);
  const whole = { ...page, next: null };
  while (page.next) {
    page = await ask(page.next);
    whole.results = whole.results.concat(page.results);
  }
  return whole;
}

async function openReport(path) {
  // Opened at once, while the browser still knows that somebody asked for it; filled when the report is there.
  const tab = window.open("", "_blank");
  if (!tab) throw new Error("The browser keeps this page from opening a tab: save the report instead.");
  tab.document.title = "The report is being made…";
  try {
    const url = await objectUrl(path, "text/html");
    tab.location.replace(url);
    setTimeout(() => URL.revokeObjectURL(url), KEEP_MS);
  } catch (error) {
    tab.close();
    throw error;
  }
}
