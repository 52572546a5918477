// The request as a form: example, waypoints, limits, method and its options, the rest, and the JSON that is sent.

import { button, fresh, h, say } from "./dom.js";
import { csv, parsed } from "./parse.js";
import { BY_WAYPOINT, LIMITED, UNITS, jointNames, misfit, misshapen, put } from "./request.js";
import { complain, field, isNumber, markErrors, read, schemaForm } from "./schema_form.js";

const MORE = ["duration", "start", "end", "segment_limits", "segment_durations", "waypoint_states", "waypoint_tolerance", "tube", "wrap", "joint_names", "sampling", "include", "timeout"];
/** What the families of methods are called. */
export const FAMILIES = { interpolation: "Interpolation at given times", smoothing: "Smoothest", time_optimal: "Fastest" };
const MOST_ROWS = 60; // beyond, a table of fields is no way to edit

/**
 * Build the form in `root`, and the choice of examples in `head`. `changed(request, structural)` is called for each edit; `timesOf()` returns the waypoint times
 * of the last answer, if any. Returns show(request), refresh(request) for new numbers in the same shape, and mark(errors).
 */
export function requestForm({ head, root }, catalogue, { changed, timesOf }) {
  let request = null;
  const parts = h("div", { class: "parts" });
  const refreshers = [];
  root.append(parts);

  const edit = (next) => {
    request = next;
    own();
    refreshers.forEach((fill) => fill());
    changed(next);
  };

  /** What was changed is no example any more. */
  const own = () => (head.querySelector("select").value = "");

  function rebuild(next) {
    request = fitting(next);
    changed(request);
    show(request);
  }

  /** Return the request without its method where that took the one before and does not take this: times came or went. */
  function fitting(next) {
    const row = catalogue.methods.find((one) => one.id === next.method);
    if (!row || next.method !== request.method || Boolean(next.times) === Boolean(request.times)) return next;
    if (misfit(row, request) || !misfit(row, next)) return next;
    say(`${row.title} ${next.times ? "takes no times" : "needs times"}: the method is chosen automatically now`);
    return put(put(next, "method", undefined), "options", undefined);
  }

  function show(next) {
    request = next;
    refreshers.length = 0;
    const open = new Set([...parts.querySelectorAll("details[open]")].map((one) => one.dataset.part));
    const at = document.activeElement?.closest?.("[data-at]")?.dataset.at;
    head.replaceChildren(examples());
    parts.replaceChildren(section("Waypoints", waypoints()), section("Limits", limits()), section("Method", method()), folded("more", "Times, states, tolerances, sampling", more()), folded("json", "The request as JSON", asJson()));
    for (const one of parts.querySelectorAll("details")) if (open.has(one.dataset.part)) one.open = true;
    if (at) parts.querySelector(`[data-at="${CSS.escape(at)}"] :is(input, select, textarea)`)?.focus({ preventScroll: true });
  }

  const section = (title, ...content) => h("section", { class: "part" }, h("h2", {}, title), ...content);
  const folded = (part, title, ...content) => h("details", { class: "part", "data-part": part }, h("summary", {}, title), ...content);

  /** Let a text be that of the present request whenever it is looked at, and not yet edited. */
  function fresher(area, written) {
    let edited = false;
    area.oninput = () => (edited = true);
    const fill = () => (edited ? null : (area.value = written()));
    refreshers.push(fill);
    return () => ((edited = false), fill());
  }

  function examples() {
    const choose = (name) => {
      const found = catalogue.cases.find((one) => one.name === name);
      if (found) rebuild(structuredClone(found.request));
    };
    const same = catalogue.cases.find((one) => JSON.stringify(one.request) === JSON.stringify(request));
    const select = h("select", { onchange: () => choose(select.value) }, h("option", { value: "" }, "your own: choose one to start anew"));
    select.append(...catalogue.cases.map((one) => h("option", { value: one.name, selected: one === same }, one.title)));
    return field({ at: "/example", label: "Example", control: select });
  }

  function waypoints() {
    const { waypoints: rows, times } = request;
    const given = h("input", { type: "checkbox", checked: Boolean(times), id: fresh("times"), onchange: () => toggleTimes(given.checked) });
    const content = [h("p", { class: "inline" }, given, h("label", { htmlFor: given.id }, "at given times"))];
    if (rows.length <= MOST_ROWS && rows[0].length <= 12) content.push(table());
    else content.push(h("p", { class: "about" }, `${rows.length} waypoints of ${rows[0].length} joints: edit them as text`));
    content.push(h("p", { class: "actions" }, button("+ waypoint", addWaypoint), button("+ joint", () => joints(1)), button("− joint", () => joints(-1), { disabled: rows[0].length < 2 })));
    content.push(folded("text", "Paste or edit as text (CSV, ROS 2 JointTrajectory, JSON)", asText()));
    return h("div", { "data-at": "/waypoints" }, content);
  }

  function table() {
    const names = jointNames(request);
    const cell = (at, label, value, set) => {
      const box = h("input", { type: "number", step: "any", value, "aria-label": label, oninput: () => isNumber(box) && edit(set(box.valueAsNumber)) });
      return h("td", { "data-at": at }, box);
    };
    const line = (row, i) =>
      h(
        "tr",
        {},
        h("th", { scope: "row" }, String(i)),
        request.times ? cell(`/times/${i}`, `time of waypoint ${i}, s`, request.times[i], (value) => put(request, "times", request.times.with(i, value))) : null,
        row.map((value, d) => cell(`/waypoints/${i}/${d}`, `waypoint ${i}, ${names[d]}`, value, (next) => put(request, "waypoints", request.waypoints.with(i, request.waypoints[i].with(d, next))))),
        h("td", {}, button("×", () => removeWaypoint(i), { "aria-label": `remove waypoint ${i}`, disabled: request.waypoints.length < 3 })),
      );
    const heads = [h("th", { scope: "col" }, "#"), request.times ? h("th", { scope: "col" }, "time (s)") : null, names.map((name) => h("th", { scope: "col" }, name)), h("th", {})];
    return h("div", { class: "scroll" }, h("table", { class: "waypoints" }, h("thead", {}, h("tr", {}, heads)), h("tbody", {}, request.waypoints.map(line))));
  }

  function toggleTimes(given) {
    const { waypoints: rows } = request;
    const known = timesOf();
    const spread = known?.length === rows.length && known.every((time, i) => i === 0 || time > known[i - 1]) ? known.map((time) => Number(time.toFixed(3))) : rows.map((_, i) => i);
    rebuild(put(request, "times", given ? spread : undefined));
  }

  const bare = (next, names) => names.reduce((held, name) => put(held, name, undefined), next);

  /** Parts with an entry for each waypoint or segment no longer fit when their number changes. */
  const resized = (next) => bare(next, BY_WAYPOINT);

  /** Take a request of another shape; say `what` it is, and which parts of the one before no longer fit. */
  function reshape(next, what = "") {
    const before = request;
    rebuild(next);
    const gone = Object.keys(before).filter((name) => request[name] === undefined && before[name] !== undefined);
    const told = [what, gone.length && `left out, since it no longer fits: ${gone.join(", ")}`].filter(Boolean);
    if (told.length) say(told.join("; "));
  }

  function addWaypoint() {
    const [before, last] = request.waypoints.slice(-2);
    const next = put(resized(request), "waypoints", [...request.waypoints, last.map((value, d) => Number((value + 0.5 * (before[d] - value) + (before[d] === value ? 0.1 : 0)).toFixed(3)))]);
    reshape(put(next, "times", request.times && [...request.times, request.times.at(-1) + (request.times.at(-1) - request.times.at(-2))]));
  }

  function removeWaypoint(i) {
    const next = put(resized(request), "waypoints", request.waypoints.toSpliced(i, 1));
    reshape(put(next, "times", request.times?.toSpliced(i, 1)));
  }

  /** Add or remove the last joint; limits with an entry for each joint get or lose one too. */
  function joints(by) {
    const dims = request.waypoints[0].length;
    const fit = (value) => (!Array.isArray(value) ? value : by > 0 ? [...value, value.at(-1)] : value.slice(0, dims - 1));
    const rows = request.waypoints.map((row) => (by > 0 ? [...row, 0] : row.slice(0, -1)));
    const limited = request.limits && Object.fromEntries(Object.entries(request.limits).map(([name, limit]) => [name, limit?.constructor === Object ? { ...limit, ...(limit.lower !== undefined && { lower: fit(limit.lower) }), ...(limit.upper !== undefined && { upper: fit(limit.upper) }) } : fit(limit)]));
    const rest = bare(resized(request), ["start", "end", "joint_names", "waypoint_tolerance", "tube", "wrap"]);
    reshape(put({ ...rest, waypoints: rows }, "limits", limited));
  }

  function asText() {
    const text = () => csv(request.waypoints, request.times);
    const area = h("textarea", { rows: 8, spellcheck: false, "aria-label": "waypoints as text", value: text() });
    const again = fresher(area, text);
    const take = () => {
      try {
        const found = parsed(area.value);
        if (found.polynomial) throw new Error("these are coefficients, not waypoints: see “Certify and retime”");
        const wrong = misshapen(found.request ?? { waypoints: found.position, times: found.time });
        if (wrong) throw new Error(wrong);
        if (found.request) return rebuild(found.request);
        const names = found.joint_names ?? (found.position[0].length === request.joint_names?.length ? request.joint_names : undefined);
        reshape({ ...bare(request, [...BY_WAYPOINT, "times", "joint_names"]), waypoints: found.position, ...(found.time && { times: found.time }), ...(names && { joint_names: names }) }, `${found.position.length} waypoints of ${found.position[0].length} joints`);
      } catch (error) {
        return complain(area, error.message);
      }
    };
    const row = h("div", { "data-at": "/text" }, area, h("p", { class: "actions" }, button("Take these waypoints", take), button("Show the present ones", again)));
    return row;
  }

  function limits() {
    const set = (name, value) => edit(put(request, "limits", Object.keys(put(request.limits ?? {}, name, value)).length ? put(request.limits ?? {}, name, value) : undefined));
    const rows = LIMITED.map((name) => limitField(name, UNITS[name], (value) => set(name, value)));
    const others = schemaForm({ schema: catalogue.schemas.LimitsBody, defs: catalogue.schemas, names: ["velocity_norm"], at: "/limits", value: request.limits, changed: (held) => set("velocity_norm", held.velocity_norm) });
    return h("div", { "data-at": "/limits" }, rows, folded("range", "Position range, speed along the path", positionFields(set), others));
  }

  function positionFields(set) {
    const about = catalogue.schemas.LimitRange.properties;
    return ["lower", "upper"].map((side) => {
      const box = h("input", { type: "text", spellcheck: false, value: text(request.limits?.position?.[side]), placeholder: "none" });
      box.oninput = () => {
        const value = readLimit(box);
        if (value === undefined && box.value.trim()) return;
        const next = put(request.limits?.position ?? {}, side, value);
        set("position", Object.keys(next).length ? next : undefined);
      };
      return field({ at: `/limits/position/${side}`, label: `position, ${side}`, unit: UNITS.position, description: about[side].description, control: box });
    });
  }

  function limitField(name, unit, set) {
    const value = request.limits?.[name];
    const box = h("input", { type: "text", spellcheck: false, value: text(value), placeholder: "none", inputMode: "decimal" });
    const slider = h("input", { type: "range", min: -1, max: 1, step: 0.01, value: 0, "aria-label": `${name} limit, scaled`, disabled: value === undefined });
    let base = value;
    box.oninput = () => {
      const next = readLimit(box);
      if (next === undefined && box.value.trim()) return;
      base = next;
      slider.value = 0;
      slider.disabled = next === undefined;
      set(next);
    };
    slider.ariaValueText = box.value;
    slider.oninput = () => {
      const next = scaled(base, 10 ** slider.valueAsNumber);
      box.value = slider.ariaValueText = text(next);
      set(next);
    };
    return field({ at: `/limits/${name}`, label: name, unit, control: box, after: slider });
  }

  const text = (value) => (value === undefined || value === null ? "" : Array.isArray(value) ? value.map((one) => one ?? "null").join(", ") : typeof value === "object" ? JSON.stringify(value) : String(value));

  function readLimit(box) {
    try {
      const value = read(box.value);
      complain(box, "");
      return value;
    } catch {
      complain(box, 'this is no number, list like 1, 2, null, or {"lower": -1, "upper": 2}');
      return undefined;
    }
  }

  function scaled(value, factor) {
    if (typeof value === "number") return Number((value * factor).toPrecision(3));
    if (Array.isArray(value)) return value.map((one) => scaled(one, factor));
    if (value && typeof value === "object") return Object.fromEntries(Object.entries(value).map(([side, one]) => [side, scaled(one, factor)]));
    return value;
  }

  function method() {
    const chosen = request.method ?? "auto";
    const row = catalogue.methods.find((one) => one.id === chosen);
    const select = h("select", { onchange: () => rebuild(put(put(request, "options", undefined), "method", select.value === "auto" ? undefined : select.value)) }, h("option", { value: "auto", selected: chosen === "auto" }, "Automatic, by times and limits"));
    for (const family of new Set(catalogue.methods.map((one) => one.family))) {
      const rows = catalogue.methods.filter((one) => one.family === family);
      const label = (one) => [one.title, misfit(one, request)].filter(Boolean).join(" – ");
      select.append(h("optgroup", { label: FAMILIES[family] ?? family }, rows.map((one) => h("option", { value: one.id, selected: one.id === chosen }, label(one)))));
    }
    const options = row && schemaForm({ schema: row.options, value: request.options, at: "/options", changed: (held) => edit(put(request, "options", Object.keys(held).length ? held : undefined)) });
    return [
      field({ at: "/method", label: "method", control: select }),
      row && h("p", { class: "about" }, row.summary),
      row && h("p", { class: "formula" }, row.formula),
      options,
      row && h("p", { class: "about" }, `${row.reference.authors}: ${row.reference.title}, ${row.reference.year}`),
    ];
  }

  function more() {
    const value = Object.fromEntries(MORE.filter((name) => request[name] !== undefined).map((name) => [name, request[name]]));
    // the rest of the request may have changed since: only these parts are taken
    const changed = (held) => edit(MORE.reduce((next, name) => put(next, name, held[name]), request));
    return schemaForm({ schema: catalogue.schemas.PlanBody, defs: catalogue.schemas, names: MORE, at: "", value, changed });
  }

  function asJson() {
    const text = () => JSON.stringify(request, null, 1);
    const area = h("textarea", { rows: 12, spellcheck: false, "aria-label": "the request as JSON", value: text() });
    const again = fresher(area, text);
    const row = h("div", { "data-at": "/json" }, area, h("p", { class: "actions" }, button("Plan this", take), button("Show the present one", again)));
    function take() {
      try {
        const next = JSON.parse(area.value);
        const wrong = misshapen(next);
        if (wrong) throw new Error(wrong);
        rebuild(next);
      } catch (error) {
        complain(area, error.message);
      }
    }
    return row;
  }

  /** Put the numbers of a request of the same shape into the table. */
  function refresh(next) {
    request = next;
    own();
    refreshers.forEach((fill) => fill());
    for (const box of parts.querySelectorAll("table.waypoints td[data-at]")) {
      const [, kind, i, d] = box.dataset.at.split("/");
      const value = kind === "times" ? next.times?.[i] : next.waypoints[i]?.[d];
      if (box.firstChild !== document.activeElement && value !== undefined) box.firstChild.value = value;
    }
  }

  return { show, refresh, mark: (errors) => markErrors(parts, errors) };
}
