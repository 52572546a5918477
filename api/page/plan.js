// The tab that plans: the form on one side, the motion on the other; planned anew whenever something changes.

import { drawInPlane, drawOverTime, style } from "./chart.js";
import { button, h, painted } from "./dom.js";
import { fieldOf, fixesOf } from "./fixes.js";
import { layHandles } from "./handles.js";
import { jointNames, put } from "./request.js";
import { requestForm } from "./request_form.js";
import { Problem, call, newest } from "./service.js";
import { change, current, watch } from "./state.js";
import { certificateTable, failure, glance, warnings } from "./summary.js";
import { takeAway } from "./take.js";

export const id = "plan";
export const title = "Plan";

const MOST_HANDLES = 400;

export function mount(panel, catalogue) {
  const editor = h("form", { class: "editor", "aria-label": "The request", onsubmit: (event) => event.preventDefault() });
  const head = h("div", { class: "part head" });
  const toForm = button("Edit the request", () => editor.querySelector("input, select").focus(), { class: "narrow" });
  const top = h("div", { class: "top-line", tabIndex: -1 }, h("p", { class: "about" }, "Planning … just started, the service warms up for some seconds."));
  const time = h("div", { class: "chart tall", id: "time-chart" });
  const plane = h("div", { class: "chart plane", id: "plane-chart" });
  const planeFigure = h("figure", { class: "figure", "aria-label": "The path in the plane" }, plane);
  const below = h("div", { class: "below" });
  const figures = h("div", { class: "figures" }, h("figure", { class: "figure", "aria-label": "The motion over time" }, time), planeFigure);
  panel.append(head, toForm, h("div", { class: "split" }, editor, h("div", { class: "view" }, top, figures, below, takeAway({ request: () => current().request, picture: () => time }))));

  let answer = null; // the newest one, and what was asked for it
  const handles = {}; // of each drawing, once it is there
  const form = requestForm({ head, root: editor }, catalogue, { changed: (request) => change({ request }, "form"), timesOf: () => answer?.data.waypoint_times });

  const plan = newest(async (request, signal) => {
    const start = performance.now();
    try {
      const { data, spent } = await call("v1/trajectories", { body: sent(request), signal });
      answer = { data, request };
      shown(data, spent, request);
      await draw();
      painted().then(() => performance.measure("replan", { start }));
    } catch (error) {
      if (!(error instanceof Problem)) throw error;
      await refused(error.document, request);
      // warming up, or busy: it says when to come again
      if (error.retryAfter) setTimeout(() => current().request === request && plan(request), 1000 * error.retryAfter);
    }
    panel.dataset.planned = Number(panel.dataset.planned ?? 0) + 1;
  });

  function shown(data, spent, request) {
    form.mark([]);
    panel.classList.remove("refused");
    top.replaceChildren(glance(data, spent));
    below.replaceChildren(...[warnings(data.warnings), certificateTable(data.certificate, jointNames(request))].filter(Boolean));
  }

  function refused(found, request) {
    const names = jointNames(request);
    const take = (fix) => () => {
      form.show(fix.request);
      change({ request: fix.request }, "form");
      top.focus();
    };
    const fixes = fixesOf(found, request, names).map((fix) => ({ label: fix.label, run: take(fix) }));
    if (!found.status || found.status >= 500) fixes.push({ label: "Try again", run: () => plan(current().request) });
    const at = fieldOf(found, request);
    const left = form.mark(found.errors ?? (at ? [{ field: at, reason: found.reason ?? found.detail, action: fixes[0] }] : []));
    panel.classList.add("refused");
    top.replaceChildren(failure(found, { fixes, left: found.errors ? left : [] }));
    below.replaceChildren();
    return draw();
  }

  /** Draw the newest answer; where it is to a request of another shape, or there is none, the waypoints alone. */
  function draw() {
    const fitting = answer && answer.data.samples && alike(answer.request, current().request);
    const { data, request } = fitting ? answer : { data: waypointsAlone(current().request), request: current().request };
    const dims = request.waypoints[0].length;
    const joints = request.waypoints[0].map((_, d) => d);
    const names = jointNames(request);
    const held = Object.values(handles).some((one) => one.holding());
    const frame = { limits: request.limits, segmentLimits: request.segment_limits, waypointTimes: data.waypoint_times, dims, joints, look: style };
    const view = `${dims} ${request.waypoints.length}`;
    const motions = [{ samples: data.samples, joints, label: (d) => names[d], look: style }];
    planeFigure.hidden = dims !== 2;
    const drawn = [drawOverTime(time, { motions, marks: marksOf(data, request, names), frame, certificate: data.certificate, held, view })];
    if (dims === 2) drawn.push(drawInPlane(plane, { paths: [{ position: data.samples.position, name: "path", ...style(0) }], waypoints: request.waypoints, names, held, view }));
    return Promise.all(drawn).then(() => {
      handles.time ??= layHandles(time, overTime);
      if (dims === 2) handles.plane ??= layHandles(plane, inPlane);
      Object.values(handles).forEach((one) => one.lay());
    });
  }

  /** Move a waypoint: the request is changed, and planned as soon as the plan before is there. */
  function moved(i, row, times = null) {
    let { request } = current();
    request = put(request, "waypoints", request.waypoints.with(i, row));
    if (times) request = put(request, "times", times);
    form.refresh(request);
    change({ request }, "drag");
  }

  function timesNow() {
    const { request } = current();
    if (request.times) return request.times;
    return answer && alike(answer.request, request) ? answer.data.waypoint_times : waypointsAlone(request).waypoint_times;
  }

  const overTime = {
    released: () => draw(),
    free: () => (current().request.times ? "xy" : "y"),
    points: () => {
      const { request } = current();
      const times = timesNow();
      if (!times || times.length !== request.waypoints.length || request.waypoints.length * request.waypoints[0].length > MOST_HANDLES) return [];
      const names = jointNames(request);
      return request.waypoints.flatMap((row, i) => row.map((value, d) => ({ key: [i, d], x: times[i], y: value, label: `waypoint ${i}, ${names[d]}`, colour: style(d).colour })));
    },
    moved: ([i, d], x, y) => {
      const { request } = current();
      let times = null;
      if (request.times && x !== request.times[i]) {
        const [before, after] = [request.times[i - 1] ?? -Infinity, request.times[i + 1] ?? Infinity];
        if (x > before && x < after) times = request.times.with(i, x);
      }
      moved(i, request.waypoints[i].with(d, y), times);
      return { x: timesNow()?.[i] ?? x, y };
    },
  };

  const inPlane = {
    released: () => draw(),
    free: () => "xy",
    points: () => {
      const { request } = current();
      if (request.waypoints[0].length !== 2 || request.waypoints.length > MOST_HANDLES) return [];
      return request.waypoints.map((row, i) => ({ key: i, x: row[0], y: row[1], label: `waypoint ${i}`, colour: "var(--text)" }));
    },
    moved: (i, x, y) => {
      moved(i, [x, y]);
      return { x, y };
    },
  };

  watch((parts, origin) => {
    if (parts.includes("request")) {
      if (origin !== "form" && origin !== "drag") form.show(current().request);
      plan(current().request);
    } else if (origin === "theme" || (parts.includes("tab") && current().tab === id)) draw();
  });
  form.show(current().request);
  plan(current().request);
}

/** Return the request as it is sent: what is drawn are samples, whatever else is to be included. */
function sent(request) {
  const { include } = request;
  return Array.isArray(include) && !include.includes("samples") ? { ...request, include: [...include, "samples"] } : request;
}

const alike = (one, other) => one.waypoints.length === other.waypoints.length && one.waypoints[0].length === other.waypoints[0].length;

/** Return the waypoints as if they were an answer, so that they are seen, and can be moved, without one. */
function waypointsAlone({ waypoints, times }) {
  const time = times?.length === waypoints.length ? times : waypoints.map((_, i) => i);
  return { samples: { time, position: waypoints }, waypoint_times: time, certificate: null };
}

/** Return the waypoints as marks of the drawing, so that pictures have them too. */
function marksOf(data, request, names) {
  const times = data.waypoint_times;
  if (!times) return [];
  return request.waypoints[0].map((_, d) => ({
    x: times, y: request.waypoints.map((row) => row[d]), type: "scatter", mode: "markers", name: names[d], legendgroup: names[d], showlegend: false, yaxis: "y",
    marker: { size: 7, color: style(d).colour }, hovertemplate: `waypoint of ${names[d]}: %{y:.5~g} at %{x:.4~f} s<extra></extra>`,
  }));
}
