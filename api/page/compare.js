// The tab that compares: the request of the plan tab by several methods, in a table, one over the other, and as a picture.

import { drawAgainst, drawOverTime, style } from "./chart.js";
import { button, figure, fresh, h, percent } from "./dom.js";
import { LIMITED, UNITS, jointNames, misfit, put } from "./request.js";
import { FAMILIES } from "./request_form.js";
import { field } from "./schema_form.js";
import { Problem, call, newest } from "./service.js";
import { change, current, watch } from "./state.js";
import { failure } from "./summary.js";

export const id = "compare";
export const title = "Compare";

const MOST_AT_FIRST = 4;
const SQUARED = "unit²/s⁵"; // of the integral of the squared jerk

/** The columns of the table: what is sorted by, and what is read. */
const COLUMNS = [
  { name: "method", title: "Method", of: (row) => row.title },
  { name: "duration", title: "Duration (s)", of: (row) => row.duration, text: (value) => figure(value, 5) },
  ...LIMITED.map((name) => ({
    name, title: `Largest ${name}`, of: (row) => largest(row, name)[0], text: (value, row) => peak(...largest(row, name), UNITS[name]),
  })),
  { name: "squared_jerk", title: `Squared jerk (${SQUARED})`, of: (row) => row.cost.squared_jerk ?? Infinity, text: (value) => orUnbounded(value, figure) },
  { name: "path_length", title: "Path length (unit)", of: (row) => row.cost.path_length ?? Infinity, text: (value) => orUnbounded(value, figure) },
  { name: "path_deviation", title: "Off its path (unit)", of: (row) => row.certificate.path_deviation, text: (value) => (value !== null && value < 1e-9 ? "0" : figure(value, 3)) },
  { name: "gap", title: "Gap", of: (row) => row.certificate.objective?.gap ?? null, text: (value, row) => gap(row.certificate.objective) },
  { name: "compute_ms", title: "Computed in (ms)", of: (row) => row.compute_ms, text: (value) => figure(value, 3) },
  { name: "holds", title: "Holds", of: (row) => (row.certificate.holds ? "✓" : "✗ broken") },
];

const orUnbounded = (value, text) => (value === Infinity ? "unbounded" : text(value));

/** Return the largest value over the joints, and whether it is a share of a limit; infinite where it is unbounded. */
function largest({ certificate, peaks }, quantity) {
  const checks = certificate.checks.filter((check) => check.quantity === quantity);
  if (checks.length) return [Math.max(...checks.map((check) => check.ratio ?? Infinity)), true];
  return [Math.max(...peaks[quantity].map((value) => (value === null ? Infinity : Math.abs(value)))), false];
}

const peak = (value, shared, unit) => orUnbounded(value, () => (shared ? percent(value) : `${figure(value)} ${unit}`));

/** Return the distance from the bound, and of which figure: methods minimise different ones. */
function gap(objective) {
  if ((objective?.gap ?? null) === null) return "–";
  const amount = objective.lower_bound === 0 ? figure(objective.gap) : percent(Math.max(0, objective.gap));
  return [`≤ ${amount} `, h("span", { class: "unit" }, objective.name.replaceAll("_", " "))];
}

/** Return up to four methods that take the request, from each family in turn; the one planned with first. */
function suggested(methods, request) {
  const fitting = methods.filter((method) => !misfit(method, request));
  const families = [...new Set(fitting.map(({ family }) => family))].map((family) => fitting.filter((method) => method.family === family));
  const turns = Array.from({ length: fitting.length }, (_, turn) => families.map((family) => family[turn])).flat().filter(Boolean);
  const own = fitting.filter((method) => method.id === request.method);
  const chosen = [...new Set([...own, ...turns])].slice(0, MOST_AT_FIRST);
  return methods.filter((method) => chosen.includes(method)).map((method) => method.id);
}

/** Return the body of a comparison: the request by each method, with its options where it is the one planned with. */
function bodyOf({ method, options, ...request }, ids) {
  const methods = ids.map((one) => (one === method && options ? { method: one, options } : one));
  return { ...request, methods, include: ["samples"] };
}

/** Return the rows in the order asked for: refusals, and what has no such figure, last either way. */
function sorted(rows, { column, descending } = {}) {
  const found = COLUMNS.find(({ name }) => name === column);
  if (!found) return rows;
  const missing = (row) => (column !== "method" && !row.ok) || (found.of(row) ?? null) === null;
  const order = (a, b) => (a === b ? 0 : a < b ? -1 : 1) * (descending ? -1 : 1);
  return rows.toSorted((a, b) => missing(a) - missing(b) || (missing(a) ? 0 : order(found.of(a), found.of(b))));
}

export function mount(panel, catalogue) {
  const editor = h("form", { class: "editor", "aria-label": "What is compared", onsubmit: (event) => event.preventDefault() });
  const top = h("div", { class: "top-line" }, h("p", { class: "about" }, "Comparing …"));
  const time = h("div", { class: "chart tall", id: "compare-time-chart" });
  const against = h("div", { class: "chart", id: "against-chart" });
  const leftOut = h("figcaption", { class: "about" });
  const figures = h(
    "div",
    { class: "figures" },
    h("figure", { class: "figure", "aria-label": "Duration against squared jerk" }, against, leftOut),
    h("figure", { class: "figure", "aria-label": "One joint's motion over time, by each method" }, time),
  );
  const view = h("div", { class: "view comparison" }, top, figures);
  panel.append(h("div", { class: "split" }, editor, view));

  let answer = null; // the newest one, and the request that it is to
  let asked = ""; // the body that was sent last
  const set = (parts) => change({ compare: { ...current().compare, ...parts } }, "compare");

  const joint = h("select", { onchange: () => set({ joint: Number(joint.value) }) });
  const boxes = catalogue.methods.map((method) => {
    const box = h("input", { type: "checkbox", id: fresh("method"), value: method.id, onchange: () => set({ methods: boxes.filter((one) => one.box.checked).map((one) => one.method.id) }) });
    const hint = h("small", { class: "about", id: fresh("hint") });
    box.setAttribute("aria-describedby", hint.id);
    return { method, box, hint, line: h("p", { class: "inline", title: method.summary }, box, h("label", { htmlFor: box.id }, method.title, " ", hint)) };
  });
  const families = [...new Set(catalogue.methods.map(({ family }) => family))].map((family) =>
    h("fieldset", {}, h("legend", {}, FAMILIES[family] ?? family), boxes.filter(({ method }) => method.family === family).map(({ line }) => line)));
  editor.append(
    h("section", { class: "part methods" }, h("h2", {}, "Methods"), families,
      h("p", { class: "actions" }, button("Those that fit", () => set({ methods: undefined })), button("All", () => set({ methods: boxes.map(({ method }) => method.id) })))),
    h("section", { class: "part" }, h("h2", {}, "Drawn"), field({ at: "/joint", label: "joint", control: joint })),
  );

  /** Return the ids of the ticked methods in the catalogue's order: the user's choice, or those that fit. */
  function ticked() {
    const { methods } = current().compare;
    if (!Array.isArray(methods)) return suggested(catalogue.methods, current().request);
    return catalogue.methods.map((method) => method.id).filter((one) => methods.includes(one));
  }

  function refreshForm(ids) {
    const { request } = current();
    for (const { method, box, hint } of boxes) {
      box.checked = ids.includes(method.id);
      hint.textContent = misfit(method, request);
    }
    joint.replaceChildren(...jointNames(request).map((name, d) => h("option", { value: d, selected: d === current().compare.joint }, name)));
  }

  const titleOf = (one) => catalogue.methods.find((method) => method.id === one).title;

  const compare = newest(async ({ body, request }, signal) => {
    view.setAttribute("aria-busy", "true");
    try {
      const { data } = await call("v1/comparisons", { body, signal });
      answer = { request, rows: data.rows.map((row, k) => ({ ...row, title: titleOf(row.method), ...style(data.rows.slice(0, k).filter(({ ok }) => ok).length) })) };
      view.classList.remove("refused");
      await show();
    } catch (error) {
      asked = ""; // the same may be asked again
      if (!(error instanceof Problem)) throw error;
      const { errors = [] } = error.document;
      refused(failure(error.document, { left: errors.length > 1 ? errors : [] })); // a single one is the detail
      if (error.retryAfter) setTimeout(refresh, 1000 * error.retryAfter);
    } finally {
      view.removeAttribute("aria-busy");
    }
    panel.dataset.compared = Number(panel.dataset.compared ?? 0) + 1;
  });

  function refused(said) {
    view.classList.add("refused");
    top.replaceChildren(said);
  }

  /** Compare where something else is asked than the last time, else show what is there; only while the tab is seen. */
  function refresh() {
    if (current().tab !== id) return;
    const { request } = current();
    const ids = ticked();
    refreshForm(ids);
    const body = bodyOf(request, ids);
    const next = JSON.stringify(body);
    if (!ids.length) {
      asked = "";
      refused(h("p", {}, "No method is ticked. Tick those that you want to see side by side."));
    } else if (next !== asked) {
      asked = next;
      compare({ body, request });
    } else if (answer && !view.classList.contains("refused")) show();
  }

  function show() {
    top.replaceChildren(table());
    return current().tab === id ? draw() : null;
  }

  function draw() {
    if (!answer) return null;
    const { request, rows } = answer;
    const dims = request.waypoints[0].length;
    const shown = Math.min(Math.max(0, Math.trunc(Number(current().compare.joint) || 0)), dims - 1);
    const good = rows.filter((row) => row.ok);
    const motions = good.map(({ samples, title: name, colour, dash }) => ({ samples, joints: [shown], label: () => name, look: () => ({ colour, dash }) }));
    const frame = { limits: request.limits, segmentLimits: request.segment_limits, waypointTimes: request.times, dims, joints: [shown], look: style };
    const points = good.filter((row) => row.duration > 0 && row.cost.squared_jerk > 0).map(({ duration, cost, title: name, colour }) => ({ x: duration, y: cost.squared_jerk, name, colour }));
    const missing = good.filter((row) => !points.some((point) => point.name === row.title)).map((row) => row.title);
    leftOut.textContent = missing.length ? `Not in this picture, for a squared jerk of zero or without bound: ${missing.join(", ")}` : "Left is faster, lower is smoother.";
    figures.hidden = !good.length;
    if (!good.length) return null;
    const marks = request.times ? [waypointMarks(request, shown)] : [];
    const titles = ["duration (s)", `squared jerk (${SQUARED})`];
    return Promise.all([drawOverTime(time, { motions, marks, frame, view: `compare ${dims} ${shown}` }), drawAgainst(against, { points, titles, view: "compare" })]);
  }

  function table() {
    const { sort } = current().compare;
    const rows = sorted(answer.rows, sort ?? {});
    return h(
      "div",
      { class: "scroll", tabIndex: 0, role: "group", "aria-label": "Comparison" },
      h(
        "table",
        { class: "checks compared" },
        h("caption", {}, `${rows.filter((row) => row.ok).length} of ${rows.length} methods do it`, h("span", { class: "unit" }, "; shares are of the limit, worst joint")),
        h("thead", {}, h("tr", {}, COLUMNS.map((column) => headOf(column, sort)), h("th", {}))),
        h("tbody", {}, rows.map(rowOf)),
      ),
    );
  }

  function headOf({ name, title: text }, sort) {
    const own = sort?.column === name;
    const sortBy = () => {
      set({ sort: { column: name, descending: own && !sort.descending } });
      top.querySelector(`[data-column="${name}"]`).focus();
    };
    const mark = own ? (sort.descending ? " ▼" : " ▲") : "";
    return h("th", { scope: "col", "aria-sort": own ? (sort.descending ? "descending" : "ascending") : null }, button(`${text}${mark}`, sortBy, { class: "sort", "data-column": name }));
  }

  function rowOf(row) {
    const key = h("span", { class: "key", style: `border-top: 3px ${row.dash === "solid" ? "solid" : "dashed"} ${row.colour}`, "aria-hidden": true });
    const cells = row.ok
      ? COLUMNS.slice(1).map(({ of, text }) => h("td", {}, (text ?? String)(of(row), row)))
      : h("td", { colSpan: COLUMNS.length - 1, class: "reason" }, row.error.detail ?? row.error.title);
    const look = row.ok ? (row.certificate.holds ? "" : "broken") : "declined";
    const take = button("Plan with it", () => planWith(row.method), { "aria-label": `Plan with ${row.title}` });
    return h("tr", { class: look }, h("th", { scope: "row" }, row.ok ? key : null, row.title), cells, h("td", {}, take));
  }

  /** Plan by this method; options of another one do not go with it. */
  function planWith(method) {
    const { request } = current();
    const next = request.method === method ? request : put(put(request, "options", undefined), "method", method);
    change({ request: next, tab: "plan" }, "compare");
    document.getElementById("tab-plan").focus();
  }

  watch((parts, origin) => {
    if (origin === "theme" && current().tab === id) draw();
    if (["request", "compare", "tab"].some((part) => parts.includes(part))) refresh();
  });
  refresh();
}

/** Return the waypoints of one joint as marks. */
const waypointMarks = ({ times, waypoints }, joint) => ({
  x: times, y: waypoints.map((row) => row[joint]), type: "scatter", mode: "markers", name: "waypoints", yaxis: "y",
  marker: { size: 7, color: "#8896a5" }, hovertemplate: "waypoint: %{y:.5~g} at %{x:.4~f} s<extra></extra>",
});
