/** The ranking of a screening, safest first, by pages, with filters and small maps. */

import { fill, fresh, h, say } from "../dom.js";
import { number, percent, stiffness } from "../format.js";
import { inWords, isSilent } from "../problem_note.js";
import { ask } from "../service.js";
import { canExplore, explore } from "./explore.js";
import { SmallMaps } from "./small_maps.js";
import { counted, verdictMark } from "./words.js";
import { scrollable } from "../scrollable.js";

const ROWS = 50;
const VERDICTS = ["stable", "unstable at some speed", "not decided"];
const CRITERIA = { least_ke: "smallest Kₑ", least_margin: "margin", most_unstable_share: "unstable share" };

export class Ranking {
  /** @param {App} app */
  constructor(app) {
    this.app = app;
    this.maps = new SmallMaps();
    const choice = (label, texts) => {
      const select = h("select", { id: fresh("filter"), onchange: () => this.turn(0) });
      fill(select, texts.map(([value, text]) => h("option", { value }, text)));
      return { select, element: h("span", {}, h("label", { for: select.id }, `${label} `), select) };
    };
    this.contact = choice("Contact", [["", "all"]]);
    this.verdict = choice("Verdict", [["", "all"], ...VERDICTS.map((one) => [one, one])]);
    this.meets = choice("Criteria", [["", "all"], ["true", "met"], ["false", "missed"]]);
    this.filters = h("div", { class: "row no-print", role: "group", "aria-label": "Filters" },
      [this.contact, this.verdict, this.meets].map(({ element }) => element));
    this.sum = h("p", { class: "note" });
    this.fault = h("p", { class: "problem", role: "alert", hidden: true });
    this.body = h("tbody");
    this.table = scrollable("Ranking",
      h("table", { class: "ranking" }, this.head = h("thead"), this.body));
    const page = (text, label, to) => h("button", { type: "button", class: "small", "aria-label": label, onclick: () => this.turn(to()) }, text);
    this.pages = h("div", { class: "row no-print", role: "group", "aria-label": "Pages" },
      this.first = page("Safest", "First page", () => 0), this.previous = page("Previous", "Previous page", () => this.offset - ROWS),
      this.following = page("Next", "Next page", () => this.offset + ROWS), this.last = page("Riskiest", "Last page", () => ROWS * Math.floor((this.found.total - 1) / ROWS)));
    this.unscreened = h("details", { class: "unscreened", hidden: true });
    this.element = h("div", {}, this.filters, this.fault, this.sum, this.table, this.pages, this.unscreened, this.maps.large.element);
    app.onChange((what) => what === "unit" && this.found && this.show());
  }

  /** Of another screening. */
  begin(job) {
    this.job = job;
    this.offset = 0;
    this.found = null;
    this.shown = "";
    this.contacts = new Set();
    this.maps.begin(job);
    fill(this.contact.select, h("option", { value: "" }, "all"));
    this.verdict.select.value = this.meets.select.value = "";
    for (const part of [this.fault, this.table, this.pages, this.unscreened, this.filters]) part.hidden = true;
    fill(this.body);
    fill(this.sum);
  }

  turn(offset) {
    this.offset = Math.max(0, offset);
    this.refresh();
  }

  /** Ask for the page again; one question at a time, and what was asked meanwhile once more. */
  async refresh() {
    if (this.asking) {
      this.again = true;
      return;
    }
    this.asking = true;
    const { job } = this;
    try {
      const found = await ask(`v1/screenings/${job}/results?${this.query}`);
      if (job === this.job) {
        this.found = found;
        this.fault.hidden = true;
        this.show();
      }
    } catch (error) {
      if (!isSilent(error) && error.status !== 401 && job === this.job) {
        this.fault.hidden = false;
        fill(this.fault, inWords(error));
      }
    } finally {
      this.asking = false;
      if (this.again) {
        this.again = false;
        this.refresh();
      }
    }
  }

  get query() {
    const asked = { contact: this.contact.select.value, verdict: this.verdict.select.value, meets_criteria: this.meets.select.value };
    const given = Object.entries(asked).filter(([, value]) => value);
    return new URLSearchParams([["limit", ROWS], ["offset", this.offset], ...given]);
  }

  show() {
    const { results, total, complete, not_screened: left } = this.found;
    this.showFilters(results);
    const { unit } = this.app;
    const text = JSON.stringify([this.found, unit.name, unit.factor]);
    if (text === this.shown) return; // the focus stays where it is
    this.shown = text;
    const last = this.offset + results.length;
    const range = total > ROWS ? `Rows ${this.offset + 1} to ${last} of ${total.toLocaleString("en-US")}` : counted(total, "result");
    this.sum.textContent = total ? `${range}, safest first${complete ? "" : "; of what is there so far"}.` :
      complete ? "No result fits." : "There are no results yet.";
    this.table.hidden = !total;
    this.pages.hidden = total <= ROWS;
    this.first.disabled = this.previous.disabled = this.offset === 0;
    this.following.disabled = this.last.disabled = last >= total;
    const held = document.activeElement?.dataset?.key;
    this.maps.refill();
    this.head.replaceChildren(heading(unit, results));
    fill(this.body, results.map((row) => this.row(row, unit, results)));
    if (held) [...this.body.querySelectorAll("[data-key]")].find((one) => one.dataset.key === held)?.focus();
    this.showUnscreened(left);
  }

  showFilters(results) {
    const known = this.contacts.size;
    results.forEach((row) => this.contacts.add(row.contact_name));
    const { select } = this.contact;
    if (this.contacts.size !== known) {
      const chosen = select.value;
      fill(select, h("option", { value: "" }, "all"), [...this.contacts].map((name) => h("option", { value: name }, name)));
      select.value = chosen;
    }
    const has = (name) => results.some((row) => row[name] !== null);
    this.filters.hidden = !this.contacts.size;
    this.contact.element.hidden = this.contacts.size < 2;
    this.verdict.element.hidden = !has("verdict") && !this.verdict.select.value;
    this.meets.element.hidden = !has("meets_criteria") && !this.meets.select.value;
  }

  row(row, unit, results) {
    const none = row.smallest_unstable_ke === null;
    const cells = [
      h("td", { class: "n" }, String(row.rank)),
      h("td", { class: "map" }, this.maps.place(row)),
      h("th", { scope: "row" }, row.blade, h("span", { class: "hint" }, row.source), canExplore(row) && this.exploreButton(row)),
      h("td", {}, row.contact_name),
      h("td", { class: "n" }, none ? `over ${number(row.ke_max)}` : number(row.smallest_unstable_ke), row.proven ? null : h("span", { class: "hint" }, "not proven")),
      h("td", { class: "n" }, none ? "–" : number(unit.name === "ratio" ? row.speed_ratio : unit.of(row.speed_hz))),
      h("td", { class: "n" }, number(row.chatter_hz), row.wear_lobes === null ? null : h("span", { class: "hint" }, `${number(row.wear_lobes, 3)} wear lobes`)),
      has(results, "verdict") && h("td", {}, verdictMark(row.verdict), h("span", { class: "hint" }, `margin ${margin(row)}`)),
      has(results, "meets_criteria") && h("td", {}, row.meets_criteria ? mark("✓", "met", "met") : mark("✗", "missed", `missed: ${row.criteria_missed.map((one) => CRITERIA[one] ?? one).join(", ")}`)),
      h("td", { class: "n" }, percent(row.unstable_share), h("span", { class: "hint" }, `${percent(row.verified_share)} verified`)),
    ];
    return h("tr", {}, cells);
  }

  exploreButton(row) {
    const made = h("button", { type: "button", class: "small no-print", data: { key: `explore ${row.blade_index} ${row.contact_name}` },
      "aria-label": `Explore ${row.blade}, contact ${row.contact_name}`, onclick: async () => {
        made.disabled = true;
        try {
          await explore(this.app, this.job, row);
          say(`${row.blade} is in the explorer`);
        } catch (error) {
          this.fault.hidden = isSilent(error);
          fill(this.fault, inWords(error));
        } finally {
          made.disabled = false;
        }
      } }, "Explore");
    return made;
  }

  showUnscreened(left) {
    this.unscreened.hidden = !left.length;
    const open = this.unscreened.open;
    const head = h("thead", {}, h("tr", {}, ["Place", "From", "Blade", "Why not"].map((text) => h("th", { scope: "col" }, text))));
    const rows = left.map((one) => h("tr", {}, h("td", {}, String(one.index)), h("td", {}, one.source), h("td", {}, one.name || "–"), h("td", {}, one.reason)));
    fill(this.unscreened, h("summary", {}, `${counted(left.length, "blade")} not screened${left.length === 1000 ? " (the first thousand)" : ""}`),
      scrollable("Blades not screened", h("table", {}, head, h("tbody", {}, rows))));
    this.unscreened.open = open;
  }
}

const has = (results, name) => results.some((row) => row[name] !== null);

function heading(unit, results) {
  const col = (text, more = "") => h("th", { scope: "col", class: more }, text);
  return h("tr", {}, col("Rank", "n"), col("Map"), col("Blade"), col("Contact"), col("Smallest Kₑ that destabilises [N/m]", "n"), col(`at rotor speed [${unit.symbol}]`, "n"),
    col("Chatter [Hz]", "n"), has(results, "verdict") && col(`At the liner${liner(results)}`),
    has(results, "meets_criteria") && col("Criteria"), col("Unstable share of the map", "n"));
}

const liner = (results) => (results[0]?.ke_liner ? `, ${stiffness(results[0].ke_liner)}` : "");

/** Over the liner's K_e; what nothing destabilises up to ke_max has at least that of ke_max. */
function margin(row) {
  if (row.ke_liner === null) return "–";
  const at = row.margin ?? row.ke_max / row.ke_liner - 1;
  const text = `${at > 0 ? "+" : ""}${percent(at)}`.replace(" ", "\u00a0"); // the unit stays with its number
  return row.margin === null ? `over ${text}` : text;
}

const mark = (sign, kind, text) => h("span", { class: `verdict ${kind}` }, h("span", { "aria-hidden": "true" }, sign), h("span", {}, text));
