/** Blade files and profiles of the reader's own, sent ahead of the screening that names them. */

import { fill, fresh, h, say } from "../dom.js";
import { inWords } from "../problem_note.js";
import { Unreachable, ask, events, request } from "../service.js";
import { chosenFiles, droppedFiles } from "./dropped.js";
import { counted } from "./words.js";
import { MOST_FILES, zipOf } from "./zip.js";

const FORMS = { json: "application/json", ndjson: "application/x-ndjson", jsonl: "application/x-ndjson", zip: "application/zip" };
const ending = (name) => name.toLowerCase().split(".").at(-1);

export class BladeFiles {
  /** @param {() => void} onChange */
  constructor(onChange) {
    this.onChange = onChange;
    /** What was chosen: {name, form, blob, state: "sending"|"there"|"refused", upload, fault}. */
    this.sendings = [];
    const input = h("input", {
      type: "file", id: fresh("files"), multiple: true, accept: Object.keys(FORMS).map((end) => `.${end}`).join(","), class: "hidden",
      onchange: () => this.take(input),
    });
    const folder = h("input", { type: "file", id: fresh("folder"), webkitdirectory: true, class: "hidden", onchange: () => this.take(folder) });
    this.list = h("ul", { class: "files" });
    this.element = h(
      "div", { class: "drop" },
      h("p", {}, h("span", {}, "Drop blade files, profiles, a folder or a ZIP here, or "),
        h("label", { class: "as-button" }, "choose files", input), " ", h("label", { class: "as-button" }, "choose a folder", folder)),
      this.list,
    );
    // What could not be sent while the service was away, or with another key.
    events.addEventListener("back", () => this.sendings.filter((one) => one.state === "held").forEach((one) => this.send(one)));
  }

  /** Take what is dropped anywhere in an element. */
  takeDrops(area) {
    const over = (event) => {
      event.preventDefault();
      this.element.classList.toggle("over", event.type === "dragover");
    };
    for (const name of ["dragover", "dragleave"]) area.addEventListener(name, over);
    area.addEventListener("drop", async (event) => {
      over(event);
      if (!this.element.closest("fieldset:disabled")) this.add(await droppedFiles(event.dataTransfer));
    });
  }

  take(input) {
    this.add(chosenFiles(input));
    input.value = "";
  }

  /** Look at files, and send what can be sent. @param {{path: string, file: File}[]} files */
  async add(files) {
    const single = [];
    for (const { path, file } of files) {
      const end = ending(path);
      if (end === "json") single.push(await looked(path, file));
      else if (FORMS[end]) this.begin(path, FORMS[end], file);
      else if (files.length === 1) this.refuse(path, "give .json, .ndjson or .zip");
    }
    single.filter((one) => one.fault).forEach((one) => this.refuse(one.path, one.fault));
    const whole = single.filter((one) => !one.fault);
    if (!whole.length && !this.sendings.length) this.refuse("the folder", "there is no .json file in it");
    if (whole.length === 1) this.begin(whole[0].path, FORMS.json, whole[0].file);
    // Many travel as one archive; their names come back with the results.
    for (let first = 0; whole.length > 1 && first < whole.length; first += MOST_FILES) {
      const some = whole.slice(first, first + MOST_FILES);
      const folder = some[0].path.includes("/") ? some[0].path.split("/")[0] : "files";
      this.begin(folder, FORMS.zip, zipOf(some.map(({ path, bytes }) => ({ name: path, bytes }))));
    }
    this.show();
  }

  begin(name, form, blob) {
    const one = { name, form, blob, state: "sending", upload: null, fault: null };
    this.sendings.push(one);
    this.send(one);
  }

  refuse(name, why) {
    this.sendings.push({ name, state: "refused", fault: [why] });
    this.show();
    say(`${name}: ${why}`);
  }

  async send(one) {
    one.state = "sending";
    this.show();
    try {
      one.upload = await ask(`v1/uploads?name=${encodeURIComponent(one.name)}`, one.blob, { headers: { "Content-Type": one.form } });
      one.state = "there";
      say(`${one.name}: ${counted(one.upload.blades ?? 0, "blade")}`);
    } catch (error) {
      // Kept for later: with a key, or once the service answers.
      one.state = error instanceof Unreachable || error.status === 401 ? "held" : "refused";
      one.fault = inWords(error);
    }
    this.show();
  }

  remove(one) {
    this.sendings = this.sendings.filter((kept) => kept !== one);
    const shared = this.sendings.some((kept) => kept.upload?.id === one.upload?.id);
    // A screening made of it keeps what it needs; when it cannot be deleted it goes by itself in time.
    if (one.upload && !shared) request(`v1/uploads/${one.upload.id}`, { method: "DELETE" }).catch(() => {});
    this.show();
  }

  show() {
    fill(this.list, this.sendings.map((one) => h(
      "li", { class: one.state },
      h("strong", {}, one.name), ": ", told(one), " ",
      h("button", { type: "button", class: "small", "aria-label": `Remove ${one.name}`, onclick: () => this.remove(one) }, "Remove"),
    )));
    this.onChange();
  }

  get busy() {
    return this.sendings.some((one) => one.state === "sending" || one.state === "held");
  }

  /** How many blades they hold. */
  get count() {
    return this.there.reduce((sum, one) => sum + (one.upload.blades ?? 1), 0);
  }

  get there() {
    // The same file twice is one upload, which a screening names once.
    const whole = this.sendings.filter((one) => one.state === "there");
    return whole.filter((one, i) => whole.findIndex((other) => other.upload.id === one.upload.id) === i);
  }

  /** Entries of `blades` in a screening's request. */
  get entries() {
    return this.there.map((one) => ({ upload: one.upload.id }));
  }
}

function told(one) {
  if (one.state === "sending") return "being sent…";
  if (one.state === "held") return "waits until the service answers";
  if (one.state === "refused") return h("span", { class: "why" }, "left out: ", one.fault);
  const { blades, fault } = one.upload;
  const many = blades === null ? "sent" : counted(blades, "blade");
  return fault ? [many, h("span", { class: "why" }, `; the first that cannot be used: ${fault.field} = ${fault.value}: ${fault.remedy}`)] : many;
}

/** What a JSON file holds, or why it is none. */
async function looked(path, file) {
  const bytes = new Uint8Array(await file.arrayBuffer());
  try {
    JSON.parse(new TextDecoder("utf-8", { fatal: true }).decode(bytes));
    return { path, file, bytes };
  } catch (error) {
    return { path, fault: `this is no JSON (${error.message})` };
  }
}
