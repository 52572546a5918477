// What the page shows, in one place: the tabs read it, change it by `change`, and it is kept in the address.

import { misshapen } from "./request.js";

const LONGEST = 60_000; // characters of an address that browsers and chats still take

const state = { tab: "plan", request: null, compare: {}, judge: {} };
const watchers = new Set();
let pending = null;

/** Return the whole state; not to be changed but by `change`. */
export const current = () => state;

/** Call `watcher(parts, origin)` after each change; `parts` are the names of what changed. */
export const watch = (watcher) => watchers.add(watcher);

/** Replace parts of the state; `origin` tells watchers who did it. */
export function change(parts, origin = null) {
  Object.assign(state, parts);
  for (const watcher of watchers) watcher(Object.keys(parts), origin);
  clearTimeout(pending);
  pending = setTimeout(keep, 250);
}

/** Return the part of the address after #, which holds the state; null where it would be too long. */
export function hash() {
  const parts = { tab: state.tab };
  if (state.request) parts.request = JSON.stringify(state.request);
  for (const name of ["compare", "judge"]) {
    if (state.tab === name && Object.keys(state[name]).length) parts[name] = JSON.stringify(state[name]);
  }
  if (Object.values(parts).some((one) => one.length > LONGEST)) return null; // without coding it first
  const text = `#${new URLSearchParams(parts)}`;
  return text.length > LONGEST ? null : text;
}

/** Put the state into the address, without an entry in the history. */
function keep() {
  history.replaceState(null, "", hash() ?? `#tab=${state.tab}`);
}

/** Return what an address holds, nothing where it is not one of ours; and what is wrong with its request. */
export function restored(text) {
  const parts = new URLSearchParams(text.replace(/^#/, ""));
  const found = {};
  if (parts.has("tab")) found.tab = parts.get("tab");
  for (const name of ["request", "compare", "judge"]) {
    try {
      const value = JSON.parse(parts.get(name) ?? "null");
      if (value && typeof value === "object" && !Array.isArray(value)) found[name] = value;
    } catch {
      // an address that was cut short: the rest still counts
    }
  }
  const wrong = found.request ? misshapen(found.request) : "";
  if (wrong) delete found.request;
  if (typeof (found.judge?.text ?? "") !== "string") delete found.judge;
  return { found, wrong };
}
