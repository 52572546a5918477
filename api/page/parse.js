// What people paste: CSV with or without a header, a ROS 2 JointTrajectory as JSON, our own JSON; and where in it what stands.

const seconds = (stamp) => (typeof stamp === "number" ? stamp : (stamp?.sec ?? stamp?.secs ?? 0) + 1e-9 * (stamp?.nanosec ?? stamp?.nsecs ?? 0));

/** What is wrong with a text; `place`: where, as far as that is known: { line, from, to }, of which lines count from 1. */
export class Misread extends Error {
  constructor(reason, place = null) {
    super(reason);
    this.place = place;
  }
}

/** Return a line of a text as a place. */
function lineAt(text, line) {
  let from = 0;
  for (let k = 1; k < line; k++) from = text.indexOf("\n", from) + 1;
  const end = text.indexOf("\n", from);
  return { line, from, to: end < 0 ? text.length : end };
}

const placeAt = (text, from, to) => ({ line: text.slice(0, from).split("\n").length, from, to });

const WORDS = /"(?:[^"\\]|\\.)*"|[{}[\],:]|[^\s{}[\],:"]+/g; // of JSON

/** Return where in a JSON text the value stands that these keys and indices lead to; null where they lead nowhere. */
function valueAt(text, wanted) {
  const keys = []; // of what is read now; null in an object before the next key
  let from = null;
  for (const { 0: word, index } of text.matchAll(WORDS)) {
    const isHere = () => keys.length === wanted.length && keys.every((key, k) => String(key) === wanted[k]);
    const [opens, closes] = ["[{".includes(word), "]}".includes(word)];
    if (closes) keys.pop();
    else if (word === ",") keys[keys.length - 1] = typeof keys.at(-1) === "number" ? keys.at(-1) + 1 : null;
    else if (word !== ":" && keys.at(-1) === null) keys[keys.length - 1] = JSON.parse(word);
    else if (word !== ":" && isHere()) from = index;
    if (from !== null && !opens && isHere()) return placeAt(text, from, index + word.length);
    if (opens) keys.push(word === "[" ? 0 : null);
  }
  return null;
}

/** Return what separates the words of a line: a semicolon or tab where there is one, else commas, else blanks. */
const separator = (line) => [";", "\t", ","].find((one) => line.includes(one)) ?? /\s+/;

/** Return the numbers of a line; with semicolons or tabs between them a comma is a decimal point. */
function numbers(line, between) {
  return line.split(between).map((word) => {
    const plain = Number(word);
    if (Number.isFinite(plain) && word.trim() !== "") return plain;
    const text = word.trim().replace(/^"|"$/g, "");
    const value = text === "" ? NaN : Number(between === "," ? text : text.replace(",", "."));
    if (!Number.isFinite(value)) throw new Error(`“${text.slice(0, 20)}” is not a number`);
    return value;
  });
}

const YAML = /^(---|- \D.*|[a-z_][\w ]*:(\s+([[{].*|[^,;\t]*))?)$/i; // how a line of it looks, and of a table does not

/** Return the table that a text holds: its header, its rows, and in which line of the text each row stands. */
function rowsOf(text) {
  const lines = text.split("\n").map((line, i) => ({ line: line.trim(), at: i + 1 })).filter(({ line }) => line && !line.startsWith("#") && !/^sep=.?$/i.test(line));
  if (!lines.length) throw new Misread("there is nothing here yet");
  if (YAML.test(lines[0].line)) throw new Misread("this looks like YAML, which is not read: CSV is, and a ROS 2 JointTrajectory, samples or a polynomial as JSON", lineAt(text, lines[0].at));
  const between = separator(lines[0].line);
  const titled = /[a-df-z_]/i.test(lines[0].line.replace(/\b(nan|inf|infinity)\b/gi, ""));
  const header = titled ? lines[0].line.split(between).map((name) => name.trim().replace(/^"|"$/g, "").replace(/\s*(\[.*\]|\(.*\))$/, "")) : null; // without units
  const body = titled ? lines.slice(1) : lines;
  if (!body.length) throw new Misread("there is a header, but no numbers");
  const rows = [];
  for (const { line, at } of body) {
    try {
      rows.push(numbers(line, header ? between : separator(line)));
      const width = header?.length ?? rows[0].length;
      if (rows.at(-1).length !== width) throw new Error(`${rows.at(-1).length} numbers, not ${width}`);
    } catch (error) {
      throw new Misread(`line ${at}: ${error.message}`, lineAt(text, at));
    }
  }
  return { header, rows, lines: body.map(({ at }) => at) };
}

const KINDS = {
  time: /^(t|time|timestamp|secs?|seconds)([ _[(].*)?$/i,
  velocity: /^(velocity|vel|qd|v)[_ ]?\d*$|[_.](vel|velocity)$/i,
  acceleration: /^(acceleration|acc|qdd|a)[_ ]?\d*$|[_.](acc|acceleration)$/i,
  jerk: /^(jerk|qddd|j)[_ ]?\d*$|[_.]jerk$/i,
};
const PLAIN = /^((position|pos|q|joint)[_ ]?\d*|[xyz])$/i; // no name that somebody gave to a joint

/** Return columns of a table by what they are: time, position, velocity, acceleration. */
function columns({ header, rows }) {
  if (!header) return { position: rows };
  const kindOf = (name) => Object.keys(KINDS).find((kind) => KINDS[kind].test(name)) ?? "position";
  let kinds = header.map(kindOf);
  // a1, a2, … and j1, j2, … are joints where nothing else is
  if (!kinds.includes("position")) kinds = kinds.map((kind) => (kind === "time" ? kind : "position"));
  const picked = (kind) => kinds.flatMap((one, column) => (one === kind ? [column] : []));
  if (!picked("position").length) throw new Misread("no column is a position");
  const parts = {};
  for (const kind of new Set(kinds)) {
    const own = picked(kind);
    parts[kind] = kind === "time" ? rows.map((row) => row[own[0]]) : rows.map((row) => own.map((column) => row[column]));
  }
  const names = picked("position").map((column) => header[column]);
  if (!names.every((name) => PLAIN.test(name))) parts.joint_names = names;
  return parts;
}

const OF_POINTS = { time: "time_from_start", position: "positions", velocity: "velocities", acceleration: "accelerations" };

function ofRos(message) {
  const { points, joint_names: names } = message;
  if (!points.length || !points.every((point) => Array.isArray(point?.positions))) throw new Misread("the JointTrajectory has no positions");
  const parts = { position: points.map((point) => point.positions) };
  for (const name of ["velocity", "acceleration"]) {
    if (points.every((point) => point[OF_POINTS[name]]?.length)) parts[name] = points.map((point) => point[OF_POINTS[name]]);
  }
  const time = points.map((point) => seconds(point.time_from_start));
  if (time.length > 1 && time.at(-1) > 0) parts.time = time;
  if (names?.length) parts.joint_names = names;
  return parts;
}

/** Return what a JSON value holds; `keys(parts)` leads to an entry of the motion, `row` is what that is called; `at` leads to the value itself. */
function ofTree(tree, at = []) {
  const below = (...keys) => ({ keys: (parts) => [...at, ...keys, ...parts] });
  if (Array.isArray(tree)) return { position: tree, keys: ([, ...rest]) => [...at, ...rest] };
  if (Array.isArray(tree.waypoints)) return { request: tree };
  if (tree.trajectory) return ofTree(tree.trajectory, [...at, "trajectory"]);
  if (Array.isArray(tree.points)) return { ...ofRos(tree), row: "point", keys: ([name, i, ...rest]) => [...at, "points", i, OF_POINTS[name], ...rest] };
  if (tree.samples) return { ...tree.samples, ...below("samples") };
  if (tree.polynomial) return { polynomial: tree.polynomial, ...below("polynomial") };
  if (tree.breaks && tree.coefficients) return { polynomial: tree, ...below() };
  if (Array.isArray(tree.position)) return { ...tree, ...below() };
  throw new Misread("this JSON is none of: a plan request, samples, a polynomial, a ROS 2 JointTrajectory");
}

/** Return where JSON is broken: where the browser says, else at the first word that JSON has not, or a comma before a bracket; null if unknown. */
function brokenAt(text, message) {
  const found = /line (\d+) column (\d+)/.exec(message);
  if (found) {
    const from = Math.min(text.length, lineAt(text, Number(found[1])).from + Number(found[2]) - 1);
    return placeAt(text, from, Math.min(text.length, from + 1));
  }
  let before = "";
  for (const { 0: word, index } of text.matchAll(WORDS)) {
    const odd = "]}".includes(word) ? before === "," : !/^(["{[:,]|(-?\d+(\.\d+)?(e[+-]?\d+)?|true|false|null)$)/i.test(word);
    if (odd) return placeAt(text, index, index + word.length);
    before = word;
  }
  return /end/i.test(message) ? placeAt(text, text.length, text.length) : null;
}

/**
 * Return what a text holds: { request } for a plan request, { polynomial }, or a motion { position, time?, velocity?, … };
 * `place([name, i, joint])` is where in the text an entry of the motion stands, null where that is not known.
 *
 * Throws a Misread that says what is wrong with it. Lines end with "\n" alone, as in a textarea.
 */
export function parsed(text) {
  if (!/^\s*[{[]/.test(text)) {
    const table = rowsOf(text);
    return { ...columns(table), place: ([, i]) => (table.lines[i] ? { ...lineAt(text, table.lines[i]), told: `line ${table.lines[i]}` } : null) };
  }
  let tree;
  try {
    tree = JSON.parse(text);
  } catch (error) {
    throw new Misread(`this looks like JSON, but ${error.message}`, brokenAt(text, error.message));
  }
  const { keys, row, ...found } = ofTree(tree);
  const place = ([name, ...indices]) => {
    let [at, path] = [null, indices.length ? keys([name, ...indices]) : []];
    for (; !at && path.length; path = path.slice(0, -1)) at = valueAt(text, path); // what is not there is looked for in what should hold it
    return at && { ...at, told: `${row ?? name} ${indices.join(", ")} (line ${at.line})` };
  };
  return { ...found, place };
}

/** Return waypoints as CSV, with their times where they have some. */
export function csv(waypoints, times) {
  const names = waypoints[0].map((_, d) => `position_${d + 1}`);
  const rows = waypoints.map((row, i) => [...(times ? [times[i]] : []), ...row].join(","));
  return [[...(times ? ["time"] : []), ...names].join(","), ...rows].join("\n");
}
