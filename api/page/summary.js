// What an answer comes to, at a glance and in full; and what a refusal says.

import { button, figure, h, percent } from "./dom.js";
import { UNITS } from "./request.js";

const SCOPES = { all: "of any motion", method: "of this method's kind", on_grid: "on the method's grid" };

/** Return a figure with what it is above and more about it below. */
export const tile = (label, value, about, state = "") => h("div", { class: `tile ${state}` }, h("dt", {}, label), h("dd", {}, value), h("dd", { class: "about" }, about));

/** Return the three figures that count: duration, distance from the optimum, certificate; and what they cost. */
export function glance(answer, spent) {
  const { certificate } = answer;
  const { objective } = certificate;
  const worst = certificate.checks.filter((check) => check.ratio !== null).sort((a, b) => b.ratio - a.ratio)[0];
  const kept = worst ? `at most ${figure(100 * worst.ratio, 4)} % of a limit (${worst.quantity})` : "no limits asked";
  const gap = objective?.gap === null || objective?.gap === undefined ? "–" : objective.lower_bound === 0 ? figure(objective.gap) : `≤ ${percent(Math.max(0, objective.gap))}`;
  const about = objective ? (objective.gap === null ? `${objective.name.replaceAll("_", " ")}: no bound computed` : `${objective.name.replaceAll("_", " ")}, against the best ${SCOPES[objective.bound_scope]}`) : "nothing is minimised";
  return h(
    "dl",
    { class: "glance" },
    tile("Duration", `${figure(answer.duration, 5)} s`, answer.picked_because ? `${answer.method}: ${answer.picked_because}` : answer.method),
    tile("From optimal", gap, about),
    tile("Certificate", certificate.holds ? "✓ holds" : "✗ broken", `${kept}; ${certificate.basis.replaceAll("_", " ")}`, certificate.holds ? "good" : "bad"),
    tile("Computed in", `${figure(spent, 3)} ms`, `${answer.solver.name.replaceAll("_", " ")}; squared jerk ${figure(certificate.cost.squared_jerk)}`),
  );
}

/** Return the certificate's checks as a table. */
export function certificateTable(certificate, names) {
  const row = (check) => {
    const share = check.ratio === null ? "–" : `${figure(100 * check.ratio, 5)} %`;
    return h(
      "tr",
      { class: check.holds ? "" : "broken" },
      h("th", { scope: "row" }, check.quantity.replaceAll("_", " ")),
      h("td", {}, check.joint === null ? "–" : names[check.joint] ?? `joint ${check.joint}`),
      h("td", {}, check.time === null ? "–" : `${figure(check.time, 5)} s`),
      h("td", {}, check.value === null ? "unbounded" : `${figure(check.value, 6)} ${UNITS[check.quantity] ?? ""}`),
      h("td", {}, check.bound === null ? "–" : figure(check.bound, 6)),
      h("td", {}, h("meter", { min: 0, max: 1, high: check.holds ? 1 : 0.5, optimum: 0, value: Math.min(1, check.ratio ?? 1), "aria-hidden": true }), share),
      h("td", {}, check.holds ? "✓" : "✗ broken"),
    );
  };
  const heads = ["Limit", "Worst joint", "At", "Value", "Bound", "Share of the limit", "Holds"];
  return h(
    "div",
    { class: "scroll" },
    h(
      "table",
      { class: "checks" },
      h("caption", {}, `Certificate: ${certificate.basis.replaceAll("_", " ")} extrema, ${certificate.holds ? "everything asked holds" : "something asked is broken"}`),
      h("thead", {}, h("tr", {}, heads.map((text) => h("th", { scope: "col" }, text)))),
      h("tbody", {}, certificate.checks.map(row), certificate.checks.length ? null : h("tr", {}, h("td", { colSpan: heads.length }, "no limits were asked"))),
    ),
    h("p", { class: "about" }, rest(certificate)),
  );
}

function rest({ waypoint_error: waypoint, boundary_error: boundary, continuity, path_deviation: deviation, cost }) {
  const parts = [
    waypoint !== null && `waypoints met to ${figure(waypoint, 2)}`,
    boundary !== null && `end states to ${figure(boundary, 2)}`,
    continuity !== null && `continuous to derivative ${continuity}`,
    deviation !== null && `at most ${figure(deviation)} unit from its path`,
    cost.path_length !== null && `path length ${figure(cost.path_length)} unit`,
  ];
  return parts.filter(Boolean).join("; ");
}

/** Return warnings as a list; nothing where there are none. */
export const warnings = (found) => (found?.length ? h("ul", { class: "warnings" }, found.map(({ message }) => h("li", {}, message))) : null);

/** Return what a problem document says; `fixes`: [{ label, run }]; `left`: findings that have no field to stand at. */
export function failure(found, { fixes = [], left = [] } = {}) {
  const told = left.length > 1 ? left : []; // a single one is the detail
  return h(
    "div",
    { class: "failure", role: "alert" },
    h("h2", {}, found.title ?? "It failed"),
    h("p", {}, found.detail ?? "", found.certified ? h("span", { class: "about" }, " Proved: no motion of this kind does it.") : null),
    told.length ? h("ul", {}, told.map(({ field, reason }) => h("li", {}, field ? h("code", {}, field) : null, " ", reason))) : null,
    fixes.length ? h("p", { class: "actions" }, fixes.map(({ label, run }) => button(label, run, { class: "fix" }))) : null,
  );
}
