// What would mend a refused request, as far as the problem document says it: each a label and the request mended.

import { sides } from "./chart.js";
import { figure } from "./dom.js";

/** Return a number rounded away from zero to four digits, so that what is needed is still met. */
function enough(value) {
  if (!value) return value;
  const unit = 10 ** (Math.floor(Math.log10(Math.abs(value))) - 3);
  const steps = Math.ceil(Math.abs(value) / unit - 1e-9) + 1;
  return Number((Math.sign(value) * steps * unit).toPrecision(4));
}

const with_ = (request, parts) => ({ ...request, ...parts });

/** Return the request with its times, or what bounds its duration, stretched to `seconds`. */
function lasting(request, seconds) {
  if (request.times) {
    const [first, last] = [request.times[0], request.times.at(-1)];
    const times = request.times.map((time) => Number((first + ((time - first) * seconds) / (last - first)).toPrecision(12)));
    const duration = request.duration?.max < seconds ? { duration: { ...request.duration, max: seconds } } : {};
    return with_(request, { times, ...duration });
  }
  const { min, max } = request.duration ?? {};
  if (max === undefined) return null;
  return with_(request, { duration: min === undefined || min === null ? { max: seconds } : { min: min === max ? seconds : min, max: seconds } });
}

/** Return the request with the longest duration of one segment raised to `seconds`. */
function lastingOn(request, segment, seconds) {
  const own = request.segment_durations?.[segment];
  if (!own) return null;
  const next = { ...own, min: own.min === own.max ? seconds : own.min, max: seconds };
  return with_(request, { segment_durations: request.segment_durations.with(segment, next) });
}

/** Return whether a limit is the one whose bound was found. */
const holds = (limit, { joint, bound }, dims = (joint ?? 0) + 1) =>
  sides(limit, dims)[joint ?? 0].some((one) => one !== null && Math.abs(one - bound) <= 1e-9 * Math.abs(bound));

/** Return the request with one joint's limit at least `needed`. */
function allowing(request, { quantity, joint, needed, bound }) {
  const dims = request.waypoints[0].length;
  const own = request.limits?.[quantity];
  if (own === undefined) return null;
  if (typeof own === "number" && (joint === null || dims === 1)) return with_(request, { limits: { ...request.limits, [quantity]: Math.abs(needed) } });
  if (joint === null) return null;
  const pairs = sides(own, dims);
  if (!holds(own, { joint, bound }, dims)) return null; // it is a segment's own bound: to change this limit would not help
  const lower = pairs.map((pair) => pair[0]);
  const upper = pairs.map((pair) => pair[1]);
  const symmetric = quantity !== "position" && pairs.every((pair) => pair[0] === null ? pair[1] === null : pair[0] === -pair[1]);
  if (symmetric) {
    upper[joint] = Math.abs(needed);
    return with_(request, { limits: { ...request.limits, [quantity]: upper } });
  }
  const side = Math.abs((lower[joint] ?? Infinity) - bound) < Math.abs((upper[joint] ?? Infinity) - bound) ? lower : upper;
  side[joint] = side === lower && quantity !== "position" ? -Math.abs(needed) : needed;
  return with_(request, { limits: { ...request.limits, [quantity]: { lower, upper } } });
}

function ofInfeasible(found, request, names) {
  const fixes = [];
  if (found.minimum_duration) {
    const seconds = enough(found.minimum_duration);
    const next = lasting(request, seconds);
    if (next) fixes.push({ label: `Use ${figure(seconds, 4)} s`, request: next });
  }
  if (found.needed !== null && found.needed !== undefined && found.quantity !== "duration") {
    const needed = enough(found.needed);
    const longer = found.quantity === "segment_duration" && lastingOn(request, found.segment, needed);
    if (longer) fixes.push({ label: `Give segment ${found.segment} ${figure(needed, 4)} s`, request: longer });
    const next = allowing(request, { ...found, needed });
    const whose = found.joint === null ? "" : ` of ${names[found.joint]}`;
    if (next) fixes.push({ label: `Allow ${found.quantity} ${figure(Math.abs(needed), 4)}${whose}`, request: next });
  }
  return fixes;
}

/** Return the fixes of a problem document for the request that it refuses. */
export function fixesOf(found, request, names) {
  if (found.type === "/errors/infeasible") return ofInfeasible(found, request, names);
  if (found.type === "/errors/unsupported") {
    const others = (found.alternatives ?? []).slice(0, 4).map((id) => ({ label: `Use ${id}`, request: with_(request, { method: id, options: undefined }) }));
    const left = leaving(request, found.what);
    return left ? [...others, { label: `Leave out ${found.what}`, request: left }] : others;
  }
  return [];
}

/** Return the request without what a method does not honour ("jerk, velocity"), where all of it is parts of the request. */
function leaving(request, what) {
  let left = request;
  for (const name of what.split(", ")) {
    if (left[name] !== undefined && name !== "waypoints") {
      const { [name]: _, ...rest } = left;
      left = rest;
    } else if (left.limits?.[name] !== undefined) {
      const { [name]: _, ...limits } = left.limits;
      left = with_(left, { limits: Object.keys(limits).length ? limits : undefined });
    } else return null;
  }
  return left;
}

/** Return the pointer of the part of the request that has this name. */
const pointerOf = (request, name) => (request[name] !== undefined ? `/${name}` : request.limits?.[name] !== undefined ? `/limits/${name}` : "/method");

/** Return the pointer of the field that an infeasible or unsupported problem is about. */
export function fieldOf(found, request) {
  if (found.type === "/errors/unsupported") return pointerOf(request, found.what.split(", ")[0]);
  if (found.type === "/errors/unknown_method") return "/method";
  if (found.type !== "/errors/infeasible") return null;
  if (found.quantity === "duration") return request.duration ? "/duration" : "/times";
  if (found.quantity === "segment_duration") return "/segment_durations";
  const own = request.segment_limits?.[found.segment]?.[found.quantity] !== undefined && !holds(request.limits?.[found.quantity], found);
  if (found.quantity === "position" && !own) return `/limits/position/${sides(request.limits?.position, request.waypoints[0].length)[found.joint]?.[0] === found.bound ? "lower" : "upper"}`;
  return own ? "/segment_limits" : request.limits?.[found.quantity] !== undefined ? `/limits/${found.quantity}` : null;
}
