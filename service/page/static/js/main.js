/** Begins: the views and their tabs, theme, units, key, and what is said when the service does not answer. */

import { App } from "./app.js";
import { Design } from "./design/design.js";
import { fill, h, say, settled } from "./dom.js";
import { packed, unpacked } from "./link.js";
import { Problem, ask, events, key } from "./service.js";
import { BatchesView } from "./views/batches.js";
import { CompareView } from "./views/compare.js";
import { ExplorerView } from "./views/explorer.js";
import { ModelsView } from "./views/models.js";
import { TimeView } from "./views/time_domain.js";

const VIEWS = [
  ["explorer", "Explorer", ExplorerView],
  ["compare", "Compare", CompareView],
  ["time", "Time domain", TimeView],
  ["batches", "Batches", BatchesView],
  ["models", "Models", ModelsView],
];
const FIRST_BLADE = "nasa_rotor_37";
/** Where this tab keeps what it shows, so that a reload shows it again. */
const TAB = "rubscreen.state";

const app = new App();
const made = new Map();
let current = null;

const place = (id) => document.getElementById(id);

/** Show a view; it is made when it is first looked at. */
function go(name, { focus = false } = {}) {
  const [id, title, View] = VIEWS.find(([view]) => view === name) ?? VIEWS[0];
  if (!made.has(id)) made.set(id, new View(app));
  if (current && current !== made.get(id)) current.hide?.();
  current = made.get(id);
  fill(place("view"), current.element);
  for (const link of place("tabs").querySelectorAll("a")) {
    if (link.dataset.view === id) link.setAttribute("aria-current", "page");
    else link.removeAttribute("aria-current");
  }
  document.title = `rubscreen: ${title}`;
  app.viewName = id;
  current.show?.();
  if (focus) place("view").focus();
}
app.go = (name) => step(name, { focus: true });

/** Go to a view, so that the browser's back button leads back from it. */
function step(name, how) {
  if (name !== app.viewName) history.pushState({ view: name }, "", location.pathname + location.search);
  go(name, how);
  keep();
}

const keep = settled(300, () => {
  try {
    sessionStorage.setItem(TAB, JSON.stringify(app.toState(app.viewName)));
  } catch {
    // No room, or storage switched off: a reload then begins with the example.
  }
});

function makeTabs() {
  const tab = ([id, title]) =>
    h("li", {}, h("a", {
      href: `#view=${id}`, data: { view: id },
      onclick: (event) => {
        if (event.ctrlKey || event.metaKey || event.shiftKey) return; // in a tab of its own
        event.preventDefault();
        step(id);
      },
    }, title));
  fill(place("tabs"), VIEWS.map(tab));
}

function makeTheme() {
  const choice = place("theme");
  choice.value = localStorage.getItem("rubscreen.theme") ?? "auto";
  const system = matchMedia("(prefers-color-scheme: dark)");
  const apply = () => {
    const dark = choice.value === "dark" || (choice.value === "auto" && system.matches);
    document.documentElement.dataset.theme = dark ? "dark" : "light";
    app.changed("theme");
  };
  choice.addEventListener("change", () => {
    localStorage.setItem("rubscreen.theme", choice.value);
    apply();
  });
  system.addEventListener("change", apply);
  // On paper everything is light, whatever the screen was.
  addEventListener("beforeprint", () => {
    document.documentElement.dataset.theme = "light";
    app.changed("theme");
  });
  addEventListener("afterprint", apply);
  apply();
}

function makeTools() {
  place("speed-unit").addEventListener("change", (event) => {
    app.unitName = event.target.value;
    app.changed("unit");
  });
  place("copy-link").addEventListener("click", async () => {
    const link = location.href.split("#")[0] + (await packed(app.toState(app.viewName)));
    history.replaceState(null, "", link);
    const button = place("copy-link");
    const copied = await navigator.clipboard?.writeText(link).then(() => true, () => false);
    button.textContent = copied ? "Copied" : "In the address bar";
    say(copied ? "The link is in the clipboard" : "The link is in the address bar");
    setTimeout(() => { button.textContent = "Copy link"; }, 2500);
  });
}

function makeKeyDialog() {
  const dialog = place("key-dialog");
  const open = (why) => {
    place("key-why").textContent = why;
    // Another request may be refused while somebody types.
    if (dialog.open) return;
    place("key").value = "";
    dialog.showModal();
  };
  events.addEventListener("locked", ({ detail: problem }) => {
    place("give-key").hidden = false;
    const none = !key.get();
    open(none ? "Give the key that you were sent." : `The key in use was refused: ${problem.field} = ${problem.value}.`);
  });
  place("give-key").addEventListener("click", () => open("Give another key."));
  dialog.addEventListener("close", () => {
    if (dialog.returnValue === "ok" && place("key").value.trim()) key.set(place("key").value.trim());
  });
}

function watchService() {
  const banner = place("banner");
  events.addEventListener("away", () => {
    banner.textContent = "The service does not answer. What is shown stays; it is asked again until it does.";
    banner.hidden = false;
  });
  events.addEventListener("back", async () => {
    banner.hidden = true;
    await begin();
  });
}

let begun = false;
let beginning = null;
/** What has to be asked before anything can be shown; again when it could not be. */
function begin() {
  beginning ??= attempt().finally(() => { beginning = null; });
  return beginning;
}

async function attempt() {
  try {
    await app.loadExamples();
    about();
    if (begun) return;
    const view = await restored();
    begun = true;
    history.replaceState({ view }, "", location.href);
    go(view);
    keep();
  } catch (error) {
    if (!(error instanceof Problem) && error.name !== "Error") console.warn(error);
    if (error instanceof Problem && error.status !== 401) {
      fill(place("view"), h("p", { class: "problem" }, `${error.title}: ${error.message}`));
    }
  }
}

/** The state of the link that the page was opened with, what this tab showed before a reload, or the example. */
async function restored() {
  const first = !sessionStorage.getItem(TAB);
  const { hash } = location;
  try {
    const state = (await unpacked(hash)) ?? (first ? null : JSON.parse(sessionStorage.getItem(TAB)));
    if (state) {
      const view = take(state);
      return viewOf(hash) ?? view;
    }
  } catch {
    sessionStorage.removeItem(TAB);
    place("banner").textContent = "The link was cut or changed on its way: here is an example instead.";
    place("banner").hidden = false;
  }
  app.show(new Design(app.examples.blades[FIRST_BLADE]));
  return viewOf(hash) ?? "explorer";
}

/** The view that an address names, "#view=compare"; null for none. */
const viewOf = (hash) => VIEWS.find(([id]) => hash === `#view=${id}`)?.[0] ?? null;

/** Take over a state; from then on this tab keeps it, and the address no longer has to. */
function take(state) {
  const view = app.fromState(state);
  place("speed-unit").value = app.unitName;
  history.replaceState({ view }, "", location.pathname + location.search);
  return view;
}

async function about() {
  const [alive, models] = await Promise.all([ask("healthz"), ask("v1/models")]).catch(() => [null, null]);
  if (!alive) return;
  const model = models.models.find((one) => one.active);
  const key = app.caller.key_id ? `; key “${app.caller.name}”, role ${app.caller.role}` : "";
  place("about").textContent = `rubscreen ${alive.version}, model ${model?.id ?? "none"}${key}`;
}

app.onChange((what) => what === "model" && about());

makeTabs();
makeTheme();
makeTools();
makeKeyDialog();
watchService();
addEventListener("hashchange", async () => {
  if (viewOf(location.hash)) return go(viewOf(location.hash));
  const state = await unpacked(location.hash).catch(() => null);
  if (!state) return;
  const view = take(state);
  app.changed("designs");
  go(view);
});
addEventListener("popstate", ({ state }) => begun && state?.view && go(state.view));
app.onChange((what) => begun && what !== "theme" && keep());
begin();
