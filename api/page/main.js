// The frame of the page: tabs, theme, key. A tab is a module with id, title and mount(panel).

import { button, h, say } from "./dom.js";
import { call, keyButton } from "./service.js";
import { change, current, restored, watch } from "./state.js";
import { copyLink } from "./take.js";
import * as plan from "./plan.js";
import * as compare from "./compare.js";
import * as judge from "./judge.js";

/** The tabs in order; another one is another module here. */
const TABS = [plan, compare, judge];

/** The named case that is shown first: two axes, so that there is a picture of the path too. */
const FIRST = "gantry_in_its_frame";

function tabs() {
  const list = document.querySelector("[role=tablist]");
  const main = document.querySelector("main");
  for (const tab of TABS) {
    const open = () => change({ tab: tab.id });
    list.append(button(tab.title, open, { role: "tab", id: `tab-${tab.id}`, "aria-controls": `panel-${tab.id}` }));
    main.append(h("section", { role: "tabpanel", id: `panel-${tab.id}`, hidden: true, "aria-labelledby": `tab-${tab.id}` }));
  }
  list.addEventListener("keydown", (event) => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!step) return;
    const at = TABS.findIndex((tab) => tab.id === current().tab);
    const next = TABS[(at + step + TABS.length) % TABS.length];
    change({ tab: next.id });
    document.getElementById(`tab-${next.id}`).focus();
  });
}

const mounted = new Set();

/** Show the chosen tab; it is built when it is shown first. */
function showTab(catalogue) {
  for (const tab of TABS) {
    const chosen = tab.id === current().tab;
    const opener = document.getElementById(`tab-${tab.id}`);
    opener.setAttribute("aria-selected", chosen);
    opener.tabIndex = chosen ? 0 : -1;
    const panel = document.getElementById(`panel-${tab.id}`);
    panel.hidden = !chosen;
    if (!chosen || mounted.has(tab)) continue;
    mounted.add(tab);
    tab.mount(panel, catalogue);
  }
}

function theme() {
  document.getElementById("theme").onclick = () => {
    const root = document.documentElement.dataset;
    root.theme = root.theme === "dark" ? "light" : "dark";
    localStorage.setItem("waywright.theme", root.theme);
    change({}, "theme");
  };
}

/** Take what an address holds; it is told, since the page may write a newer one at any time. */
function restore(part) {
  const { found, wrong } = restored(part);
  if (wrong) say(`The link is not taken: ${wrong}`);
  if (found.tab && !TABS.some((tab) => tab.id === found.tab)) delete found.tab;
  if (Object.keys(found).length) change(found, "address");
}

/** Return an answer of the service, however long it is busy or warms up. */
async function patiently(path) {
  try {
    return await call(path);
  } catch (error) {
    if (!error.retryAfter) throw error;
    say(error.message);
    await new Promise((resolve) => setTimeout(resolve, 1000 * error.retryAfter));
    return patiently(path);
  }
}

async function start() {
  theme();
  document.getElementById("link").onclick = copyLink;
  const again = () => location.reload();
  keyButton(document.getElementById("key"), again);
  const [methods, cases, openapi] = await Promise.all(["v1/methods", "v1/cases", "openapi.json"].map(patiently));
  const catalogue = { methods: methods.data, cases: cases.data, schemas: openapi.data.components.schemas };
  const first = catalogue.cases.find((row) => row.name === FIRST) ?? catalogue.cases[0];
  change({ request: structuredClone(first.request) }, "start");
  restore(location.hash);
  tabs();
  showTab(catalogue);
  watch((parts) => parts.includes("tab") && showTab(catalogue));
  addEventListener("hashchange", (event) => restore(new URL(event.newURL).hash));
  document.documentElement.dataset.ready = "yes";
}

/** Say what keeps the page from working, at its top. */
function failed(error) {
  document.querySelector("main").prepend(h("p", { class: "failed", role: "alert" }, error.message));
}

start().catch(failed);
