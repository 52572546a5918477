// The public REST API, and nothing else: what the page can do, any client can.

import { h } from "./dom.js";

/** An answer that is a problem document (RFC 9457). */
export class Problem extends Error {
  constructor(document, retryAfter = 0) {
    super(document.detail ?? document.title);
    this.document = document;
    this.retryAfter = retryAfter; // s; 0 where there is no sense in asking again
  }
}

const KEY = "waywright.key";

/** Return the key that the service was given, if it wants one. */
const key = () => sessionStorage.getItem(KEY);
export const isKeyed = () => Boolean(key());

function headersOf(body, accept) {
  const headers = { Accept: accept };
  if (body !== undefined) headers["Content-Type"] = "application/json";
  if (isKeyed()) headers["X-API-Key"] = key();
  return headers;
}

async function fetched(path, { body, accept = "application/json", signal } = {}) {
  const request = { method: body === undefined ? "GET" : "POST", headers: headersOf(body, accept), signal };
  if (body !== undefined) request.body = JSON.stringify(body);
  let response;
  try {
    response = await fetch(path, request);
  } catch (error) {
    if (error.name === "AbortError") throw error;
    throw new Problem({ type: "/errors/unreachable", title: "The service does not answer", detail: "The service does not answer. Is it running?" });
  }
  if (response.ok) return response;
  const text = await response.text();
  let document;
  try {
    document = JSON.parse(text);
  } catch {
    document = { title: `The answer was ${response.status}`, detail: text.slice(0, 200), status: response.status };
  }
  if (response.status === 401) askForKey();
  throw new Problem(document, Number(response.headers.get("Retry-After") ?? 0));
}

/** Return the JSON answer of a path, and the milliseconds that the service spent (`Server-Timing`). */
export async function call(path, asked) {
  const response = await fetched(path, asked);
  const timing = response.headers.get("Server-Timing") ?? "";
  const spent = [...timing.matchAll(/dur=([\d.eE+-]+)/g)].reduce((sum, found) => sum + Number(found[1]), 0);
  try {
    return { data: await response.json(), spent };
  } catch (error) {
    if (error.name === "AbortError") throw error;
    throw new Problem({ title: "The answer broke off", detail: "The answer broke off before its end." });
  }
}

/** Return the answer in another format, as a blob. */
export const download = async (path, asked) => (await fetched(path, asked)).blob();

function askForKey() {
  const opener = document.getElementById("key");
  opener.hidden = false;
  opener.click();
}

/** Let the button ask for the API key, which is kept until the browser's tab is closed; `then` is called with a new one. */
export function keyButton(opener, then) {
  opener.hidden = !isKeyed();
  opener.onclick = () => {
    if (document.querySelector("dialog[open]")) return;
    const field = h("input", { type: "password", autocomplete: "off", value: key() ?? "" });
    const dialog = h(
      "dialog",
      { onclose: () => dialog.remove() },
      h(
        "form",
        {
          method: "dialog",
          onsubmit: () => {
            sessionStorage.setItem(KEY, field.value.trim());
            then();
          },
        },
        h("label", {}, "API key of this service (X-API-Key); forgotten when this tab is closed", field),
        h("button", { type: "submit" }, "Use it"),
      ),
    );
    document.body.append(dialog);
    dialog.showModal();
  };
}

/**
 * Return a function that runs `job(argument, signal)` for the newest argument only.
 *
 * One runs at a time, so that answers come in order while somebody drags; of those that are asked for meanwhile only
 * the last is run. A job that holds up a newer one for longer than `patience` milliseconds is broken off.
 */
export function newest(job, patience = 1000) {
  let waiting = null;
  let running = null;
  async function run(argument) {
    running = new AbortController();
    try {
      await job(argument, running.signal);
    } catch (error) {
      if (error.name !== "AbortError") throw error;
    } finally {
      running = null;
      if (waiting) {
        const [next] = waiting;
        waiting = null;
        run(next);
      }
    }
  }
  return (argument) => {
    if (!running) return void run(argument);
    if (!waiting) {
      const held = running;
      setTimeout(() => held.abort(), patience);
    }
    waiting = [argument];
  };
}
