// Anyone's motion, as it is judged and as it is drawn: samples with finite differences, polynomials by their pieces; thinned.

import { Misread, parsed } from "./parse.js";
import { ORDERS } from "./request.js";

const POINTS = 400; // a polynomial is drawn by about so many
/** Points of a line: more are not seen, and take plotly.js long. */
export const MOST_DRAWN = 2000;

const isMatrix = (rows, count, width) => Array.isArray(rows) && rows.length === count && rows.every((row) => Array.isArray(row) && row.length === width && row.every(Number.isFinite));
const increases = (time) => Array.isArray(time) && time.length > 1 && time.every((value, i) => Number.isFinite(value) && (i === 0 || value > time[i - 1]));

/**
 * Return what a text holds as { trajectory, names, about, drawn, place }: what the service takes, what is drawn of it, and
 * where in the text stands what a pointer of the service leads to.
 *
 * What cannot be drawn, for its shape is wrong, is left to the service to refuse: it says where.
 */
export function motionOf(text) {
  const found = parsed(text);
  if (found.request) throw new Misread("this is a plan request: it belongs into the tab “Plan”");
  const { polynomial } = found;
  const place = (pointer) => found.place(pointer.split("/").slice(3)); // after /trajectory/samples or /trajectory/polynomial
  if (polynomial) return { trajectory: { polynomial }, about: `a polynomial, pieces: ${polynomial.breaks?.length - 1}`, drawn: evaluated(polynomial), place };
  if (!found.time) throw new Misread("a trajectory needs its times: a column “time”, or time_from_start at each point");
  const samples = Object.fromEntries(["time", "position", "velocity", "acceleration"].filter((name) => found[name]).map((name) => [name, found[name]]));
  const { names, wrong } = namesIn(found.joint_names, samples.position?.[0]?.length);
  return { trajectory: { samples }, names, about: [`${samples.time.length} samples`, wrong].filter(Boolean).join("; "), drawn: asSampled(samples), place };
}

/** Return joint names where there is one for each of the joints, else what is wrong with them: then the joints go by number. */
function namesIn(given, dims) {
  if (given === undefined || given === null || dims === undefined) return {};
  if (!Array.isArray(given) || !given.every((name) => typeof name === "string")) return { wrong: "joint_names is no list of names: not used" };
  return given.length === dims ? { names: given } : { wrong: `joint_names not used: ${given.length} for ${dims} joint${dims === 1 ? "" : "s"}` };
}

/**
 * Return which points of a line are drawn where it has many more than `most`: of each of `most / 2` equal spans of time
 * the lowest and the highest, and both ends. So no extremum of any span is lost.
 */
export function thinned(time, values, most = MOST_DRAWN) {
  const last = time.length - 1;
  if (last < most) return time.map((_, i) => i);
  const spans = most / 2;
  const spanOf = (i) => (i === last ? spans : Math.floor((spans * (time[i] - time[0])) / (time[last] - time[0])));
  const kept = [0];
  const keep = (i) => i > kept.at(-1) && kept.push(i);
  let [span, low, high] = [0, 0, 0];
  for (let i = 1; i <= last; i++) {
    if (spanOf(i) === span) {
      if (values[i] < values[low]) low = i;
      if (values[i] > values[high]) high = i;
      continue;
    }
    keep(Math.min(low, high));
    keep(Math.max(low, high));
    [span, low, high] = [spanOf(i), i, i];
  }
  keep(last); // it has a span to itself
  return kept;
}

/** Return a motion as motions that are drawn; of one with many samples each line by itself, thinned by what it does. */
export function sparser({ samples, joints, ...rest }) {
  if (samples.time.length <= MOST_DRAWN) return [{ samples, joints, ...rest }];
  return ORDERS.filter((name) => samples[name]).flatMap((name) => joints.map((d) => {
    const kept = thinned(samples.time, samples[name].map((row) => row[d]));
    return { samples: { time: kept.map((i) => samples.time[i]), [name]: kept.map((i) => samples[name][i]) }, joints: [d], ...rest };
  }));
}

/** Return samples as motions to draw, with finite differences for the derivatives that were not sent. */
function asSampled({ time, ...sent }) {
  const dims = sent.position?.[0]?.length;
  if (!sent.position || !increases(time) || !Object.values(sent).every((rows) => isMatrix(rows, time.length, dims))) return null;
  const rest = differences(time, sent.position).filter(({ name }) => !sent[name]);
  return { dims, motions: [{ time, ...sent }, ...rest.map(({ name, at, rows }) => ({ time: at, [name]: rows }))], differences: rest.map(({ name }) => name) };
}

/** Return what the certificate judges: of each order the divided differences, at the means of their times. */
function differences(time, position) {
  let rows = position;
  return ORDERS.slice(1).map((name, k) => {
    const n = k + 1;
    rows = rows.slice(1).map((row, i) => row.map((value, d) => (n * (value - rows[i][d])) / (time[i + n] - time[i])));
    const at = rows.map((_, i) => time.slice(i, i + n + 1).reduce((sum, value) => sum + value, 0) / (n + 1));
    return { name, at, rows };
  }).filter(({ rows: found }) => found.length);
}

/** Return the value and three derivatives of a polynomial, lowest power first. */
function derivatives(powers, u) {
  const falling = (k, r) => Array.from({ length: r }, (_, j) => k - j).reduce((product, factor) => product * factor, 1);
  return [0, 1, 2, 3].map((r) => powers.reduceRight((sum, factor, k) => (k < r ? sum : sum * u + factor * falling(k, r)), 0));
}

/** Return the same of a quotient, from those of its two parts (Leibniz's rule for the product, solved for one factor). */
function quotient(above, below) {
  const found = [];
  for (const [r, binomials] of [[], [1], [2, 1], [3, 3, 1]].entries()) {
    const rest = binomials.reduce((sum, binomial, j) => sum + binomial * below[j + 1] * found[r - j - 1], 0);
    found.push((above[r] - rest) / below[0]);
  }
  return found;
}

/** Return a piecewise polynomial as samples, with both ends of each piece, so that jumps are seen. */
function evaluated({ breaks, coefficients, weights }) {
  const pieces = breaks?.length - 1;
  const dims = coefficients?.[0]?.[0]?.length;
  const fits = increases(breaks) && Array.isArray(coefficients) && coefficients.every((rows) => isMatrix(rows, pieces, dims));
  if (!fits || (weights && !isMatrix(weights, weights.length, pieces))) return null;
  const samples = { time: [], position: [], velocity: [], acceleration: [], jerk: [] };
  for (let i = 0; i < pieces; i++) {
    const span = breaks[i + 1] - breaks[i];
    const count = Math.max(2, Math.ceil((POINTS * span) / (breaks[pieces] - breaks[0])));
    for (let k = 0; k <= count; k++) {
      const u = (span * k) / count;
      const below = weights ? derivatives(weights.map((row) => row[i]), u) : [1, 0, 0, 0];
      const joints = Array.from({ length: dims }, (_, d) => quotient(derivatives(coefficients.map((rows) => rows[i][d]), u), below));
      samples.time.push(breaks[i] + u);
      ORDERS.forEach((name, r) => samples[name].push(joints.map((one) => one[r])));
    }
  }
  return { dims, motions: [samples], differences: [] };
}
