/** The service behind the page: its /v1 calls, its problems, the key, and whether it answers at all. */

const ROOT = new URL("../", document.baseURI);
const KEY = "rubscreen.key";

/** What a problem document (RFC 9457) says. */
export class Problem extends Error {
  constructor(status, document) {
    super(document.detail ?? document.title ?? `status ${status}`);
    this.status = status;
    this.title = document.title ?? "The request failed";
    this.field = document.field ?? "";
    this.value = document.value ?? "";
    this.remedy = document.remedy ?? "";
    /** Why a model is not promoted, one text each. */
    this.reasons = document.reasons ?? [];
  }
}

/** Nobody answered. */
export class Unreachable extends Error {}

/**
 * Tells what happens between page and service: "away" when nobody answers, "back" when somebody does again or
 * another key was given, "locked" (detail: the problem) when a key is asked for.
 */
export const events = new EventTarget();
const tell = (name, detail) => events.dispatchEvent(new CustomEvent(name, { detail }));

export const key = {
  get: () => sessionStorage.getItem(KEY),
  set(text) {
    if (text) sessionStorage.setItem(KEY, text);
    else sessionStorage.removeItem(KEY);
    tell("back");
  },
};

/** Address of a path of the service, wherever a proxy has put it. */
export const address = (path) => new URL(path.replace(/^\//, ""), ROOT);

/**
 * The response to a request; a problem is thrown.
 * @param {string} path e.g. "v1/map"
 * @param {{method?: string, body?: any, accept?: string, signal?: AbortSignal, headers?: Object}} [how]
 *        a body is sent as JSON, unless it is a Blob or bytes with a Content-Type among the headers
 * @throws {Problem|Unreachable|DOMException} the last when `signal` was aborted
 */
export async function request(path, { method, body, accept, signal, headers } = {}) {
  const raw = body instanceof Blob || body instanceof Uint8Array;
  const sent = { Accept: accept ?? "application/json", ...headers };
  if (body !== undefined && !raw) sent["Content-Type"] = "application/json";
  if (key.get()) sent.Authorization = `Bearer ${key.get()}`;
  let response;
  try {
    response = await fetch(address(path), {
      method: method ?? (body === undefined ? "GET" : "POST"),
      headers: sent,
      body: body === undefined || raw ? body : JSON.stringify(body),
      signal,
      cache: "no-store",
    });
  } catch (error) {
    if (error.name === "AbortError") throw error;
    watch();
    throw new Unreachable("the service does not answer");
  }
  if (response.ok) return response;
  const told = await response.json().catch(() => ({}));
  const problem = new Problem(response.status, told);
  if (response.status === 401) tell("locked", problem);
  throw problem;
}

/** The JSON that answers a request; see `request`. */
export const ask = async (path, body, how = {}) => (await request(path, { body, ...how })).json();

let watching = false;
/** Ask whether the service is there until it is. */
async function watch() {
  if (watching) return;
  watching = true;
  tell("away");
  for (;;) {
    await new Promise((next) => setTimeout(next, 700));
    const answer = await fetch(address("readyz"), { cache: "no-store" }).catch(() => null);
    if (answer?.ok) break;
  }
  watching = false;
  tell("back");
}

/**
 * Server-sent events of a job, with the key in a header, which EventSource cannot send.
 * @yields {{event: string, data: any}}
 */
export async function* stream(path, signal) {
  const response = await request(path, { accept: "text/event-stream", signal });
  const reader = response.body.pipeThrough(new TextDecoderStream()).getReader();
  let text = "";
  for (;;) {
    const { done, value } = await reader.read();
    if (done) return;
    text += value.replaceAll("\r\n", "\n");
    for (let end = text.indexOf("\n\n"); end >= 0; end = text.indexOf("\n\n")) {
      const lines = text.slice(0, end).split("\n");
      text = text.slice(end + 2);
      const data = lines.filter((line) => line.startsWith("data:")).map((line) => line.slice(5).trim());
      if (!data.length) continue;
      const event = lines.find((line) => line.startsWith("event:"))?.slice(6).trim() ?? "message";
      yield { event, data: JSON.parse(data.join("\n")) };
    }
  }
}

/**
 * A job to its end, told at every change. Goes on after the service was away.
 * @param {string} path of the job, e.g. "v1/screenings/abc"
 * @param {(job: Object) => void} onChange
 */
export async function follow(path, onChange, signal) {
  for (;;) {
    try {
      for await (const { data } of stream(`${path}/events`, signal)) onChange(data);
      const job = await ask(path, undefined, { signal });
      onChange(job);
      if (["done", "failed", "cancelled"].includes(job.state)) return job;
    } catch (error) {
      if (error.name === "AbortError" || error instanceof Problem) throw error;
      watch();
      await new Promise((next) => events.addEventListener("back", next, { once: true }));
    }
    await new Promise((next) => setTimeout(next, 300));
  }
}

/** A picture or file that needs the key, as an address that this page alone may show. */
export async function objectUrl(path, accept, signal) {
  return URL.createObjectURL(await (await request(path, { accept, signal })).blob());
}
