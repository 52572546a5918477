// What a request is, as far as the page needs to know: its shape, its joints, its parts, and which methods take it.

import { QUANTITIES } from "./chart.js";

/** The quantities of a motion, by order of the derivative, and those that each joint has limits of. */
export const ORDERS = QUANTITIES.map(({ name }) => name);
export const LIMITED = ORDERS.slice(1);

/** The units of what is limited, of a coordinate whose unit is the user's. */
export const UNITS = {
  ...Object.fromEntries(QUANTITIES.map(({ name, unit }) => [name, unit])),
  velocity_norm: "unit/s", duration: "s", segment_duration: "s", tube: "unit", waypoint_tolerance: "unit", tolerance: "unit",
};

/** Parts of a request with an entry for each waypoint or segment. */
export const BY_WAYPOINT = ["segment_limits", "segment_durations", "waypoint_states"];

/** Return what the joints are called; they count from 0, as in what the service says. */
export function jointNames({ joint_names: names, waypoints }) {
  return waypoints[0].map((_, d) => (Array.isArray(names) && typeof names[d] === "string" ? names[d] : `joint ${d}`));
}

const without = (object, name) => Object.fromEntries(Object.entries(object ?? {}).filter(([key]) => key !== name));

/** Return the request with one part replaced, or left out where it is undefined. */
export const put = (request, name, value) => (value === undefined ? without(request, name) : { ...request, [name]: value });

/** Return why a method with default options does not take the request; empty where it does. */
export function misfit(method, request) {
  const asked = [...(request.times ? ["times"] : []), ...Object.keys(request.limits ?? {}), ...[...BY_WAYPOINT, "waypoint_tolerance", "tube", "duration"].filter((name) => request[name] !== undefined)];
  const missing = method.requires.filter((name) => !asked.includes(name));
  const ignored = asked.filter((name) => !method.honours.includes(name) && !(name === "times" && method.timing !== "chosen" && method.timing !== "parameter"));
  return [missing.length && `needs ${missing.join(", ")}`, ignored.length && `not with ${ignored.join(", ")}`].filter(Boolean).join("; ");
}

/** Return what keeps the page from showing a request at all; the rest is the service's to judge. Empty where nothing does. */
export function misshapen(request) {
  const rows = request?.waypoints;
  const isObject = (value) => typeof value === "object" && !Array.isArray(value);
  if (!Array.isArray(rows) || rows.length < 2 || !rows.every((row) => Array.isArray(row) && row.length)) return "“waypoints” must be two rows of numbers or more";
  if (!rows.every((row) => row.length === rows[0].length)) return "all waypoints must have as many numbers as the first";
  if (!rows.flat().every(Number.isFinite)) return "waypoints must be numbers";
  if (request.times && !(Array.isArray(request.times) && request.times.length === rows.length && request.times.every(Number.isFinite))) return "“times” must be a number for each waypoint";
  if (request.joint_names && !(Array.isArray(request.joint_names) && request.joint_names.length === rows[0].length)) return "“joint_names” must have a name for each joint";
  const wrong = ["limits", "options", "duration"].find((name) => request[name] && !isObject(request[name]));
  if (wrong) return `“${wrong}” must be an object`;
  return request.segment_limits && !Array.isArray(request.segment_limits) ? "“segment_limits” must be a list" : "";
}
