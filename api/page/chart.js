// Drawings of motions by plotly.js: quantities over time one below the other, and the path in the plane.

import { figure } from "./dom.js";
import { draw } from "./draw.js";

/** What is drawn over time, by order of the derivative, with units of a coordinate whose unit is the user's. */
export const QUANTITIES = [
  { name: "position", unit: "unit" },
  { name: "velocity", unit: "unit/s" },
  { name: "acceleration", unit: "unit/s²" },
  { name: "jerk", unit: "unit/s³" },
];

// After Okabe and Ito, told apart with any colour vision; darker or lighter until each stands out 3 : 1 from its ground.
const COLOURS = {
  light: ["#0072b2", "#b35c00", "#00795a", "#b3458a", "#6a4fb3", "#c8321e"],
  dark: ["#56b4e9", "#e69f00", "#2fc79a", "#e08fc0", "#b6a2ff", "#ff7a5c"],
};
const DASHES = ["solid", "dash", "dot", "dashdot"];
const MARGIN = { l: 62, r: 12, t: 12, b: 44 };

/** Return colour and dash of the n-th of several lines. */
export function style(n) {
  const colours = COLOURS[document.documentElement.dataset.theme] ?? COLOURS.light;
  return { colour: colours[n % colours.length], dash: DASHES[Math.floor(n / colours.length) % DASHES.length] };
}

/** Return a limit as one [lower, upper] per joint, null where there is none. */
export function sides(limit, joints) {
  const bound = (value) => (Number.isFinite(value) ? value : null); // what is no number is the service's to refuse
  const each = (value) => Array.from({ length: joints }, (_, d) => bound(Array.isArray(value) ? value[d] : value));
  if (limit === undefined || limit === null) return each(null).map(() => [null, null]);
  if (typeof limit === "object" && !Array.isArray(limit)) {
    const upper = each(limit.upper);
    return each(limit.lower).map((lower, d) => [lower, upper[d]]);
  }
  return each(limit).map((bound) => [bound === null ? null : -bound, bound]);
}

const palette = () => {
  const css = getComputedStyle(document.documentElement);
  const of = (name) => css.getPropertyValue(name).trim();
  return { text: of("--text"), grid: of("--line"), band: of("--band"), edge: of("--edge"), paper: of("--panel"), good: of("--good"), bad: of("--bad") };
};

const MOST_SMOOTH = 1000; // points of a line that plotly.js draws as it is, not as a polygon of fewer

const axis = (order) => (order ? `y${order + 1}` : "y");

/** Return the traces of one motion, a line for each quantity that it has and joint that is shown. */
function lines({ samples, joints, label, look }) {
  const found = [];
  QUANTITIES.forEach(({ name, unit }, order) => {
    const rows = samples[name];
    if (!rows) return;
    for (const d of joints) {
      const { colour, dash } = look(d);
      found.push({
        x: samples.time,
        y: rows.map((row) => row[d]),
        type: "scatter",
        mode: "lines",
        name: label(d),
        legendgroup: label(d),
        showlegend: order === 0,
        yaxis: axis(order),
        line: { color: colour, dash, width: 1.8, simplify: rows.length > MOST_SMOOTH },
        hovertemplate: `%{y:.5~g} ${unit} at %{x:.4~f} s`,
      });
    }
  });
  return found;
}

/** Return the points where the certificate found each quantity at its worst. */
function extrema(certificate, shown, colours) {
  const marks = [];
  for (const check of certificate?.checks ?? []) {
    const order = QUANTITIES.findIndex(({ name }) => name === check.quantity);
    if (order < 0 || check.time === null || check.value === null || !shown.includes(check.joint)) continue;
    const share = check.ratio === null ? "" : `, ${figure(100 * check.ratio, 4)} % of the limit`;
    marks.push({
      x: [check.time],
      y: [check.value],
      type: "scatter",
      mode: "markers",
      name: "certified extremum",
      showlegend: false,
      yaxis: axis(order),
      marker: { symbol: "diamond-open", size: 11, line: { width: 2 }, color: check.holds ? colours.good : colours.bad },
      hovertemplate: `largest ${check.quantity}, joint ${check.joint}: ${figure(check.value, 6)}${share}<extra></extra>`,
    });
  }
  return marks;
}

/** Return the shapes of the limits: a band where all joints shown share them, else lines in the joints' colours. */
function bands({ limits, segmentLimits, waypointTimes, dims, joints, look }, colours) {
  const shapes = [];
  const spans = segmentLimits && waypointTimes ? segmentLimits.map((own, i) => [own, waypointTimes[i], waypointTimes[i + 1]]) : [[null, null, null]];
  QUANTITIES.forEach(({ name }, order) => {
    for (const [own, from, to] of spans) {
      const both = [sides(limits?.[name], dims), sides(own?.[name], dims)];
      const tighter = joints.map((d) => {
        const [lowers, uppers] = [0, 1].map((side) => both.map((pair) => pair[d][side]).filter((bound) => bound !== null));
        return [lowers.length ? Math.max(...lowers) : null, uppers.length ? Math.min(...uppers) : null];
      });
      const place = from === null ? { xref: "x domain", x0: 0, x1: 1 } : { xref: "x", x0: from, x1: to };
      const alike = tighter.every((pair) => pair[0] === tighter[0][0] && pair[1] === tighter[0][1]);
      const base = { ...place, yref: axis(order), layer: "below" };
      if (alike && tighter.length && tighter[0][0] !== null && tighter[0][1] !== null) {
        shapes.push({ ...base, type: "rect", y0: tighter[0][0], y1: tighter[0][1], fillcolor: colours.band, line: { width: 0 } });
      }
      (alike ? tighter.slice(0, 1) : tighter).forEach((pair, k) => {
        for (const bound of pair.filter((value) => value !== null)) {
          const line = { color: alike ? colours.edge : look(joints[k]).colour, width: 1.2, dash: "dash" };
          shapes.push({ ...base, type: "line", y0: bound, y1: bound, line });
        }
      });
    }
  });
  return shapes;
}

/** Return the range of an axis: of all that is drawn, and of the limits where they are near. */
function range(traces, shapes, name) {
  let [low, high] = [Infinity, -Infinity];
  for (const trace of traces) {
    if (trace.yaxis !== name || trace.visible === "legendonly") continue;
    for (const value of trace.y) {
      if (value === null) continue;
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  if (!(low <= high)) return [-1, 1];
  const size = high - low || Math.max(Math.abs(low), 1e-3);
  const [least, most] = [low - 0.8 * size, high + 0.8 * size];
  for (const shape of shapes.filter((one) => one.yref === name)) {
    for (const bound of [shape.y0, shape.y1]) if (bound > least && bound < most) [low, high] = [Math.min(low, bound), Math.max(high, bound)];
  }
  const room = 0.06 * (high - low || size);
  return [low - room, high + room];
}

/**
 * Draw motions over time into `div`.
 *
 * `motions`: [{ samples, joints, label(d), look(d) }]; `marks`: a further trace or several; `frame`: limits and so on, as
 * `bands` takes them; `certificate`: whose extrema are marked; `held`: keep the range of the positions, as while somebody
 * drags; `view`: what the user's zoom belongs to.
 */
export function drawOverTime(div, { motions, marks = [], frame, certificate, held = false, view = "" }) {
  const colours = palette();
  const data = [...motions.flatMap(lines), ...marks, ...extrema(certificate, frame.joints, colours)];
  const shapes = bands(frame, colours);
  const last = Math.max(...motions.map(({ samples }) => samples.time.at(-1)));
  const begin = Math.min(...motions.map(({ samples }) => samples.time[0]));
  QUANTITIES.forEach((_, order) => {
    // an axis that nothing is drawn on would not be there
    if (!data.some((trace) => trace.yaxis === axis(order))) data.push({ x: [begin], y: [null], type: "scatter", yaxis: axis(order), showlegend: false, hoverinfo: "skip" });
  });
  const edge = 0.02 * (last - begin || 1);
  const layout = {
    ...common(colours, `${view} over time`),
    shapes,
    xaxis: { ...grid(colours), title: { text: "time (s)" }, anchor: "y4", range: [begin - edge, last + edge] },
    legend: { orientation: "h", y: 1.01, yanchor: "bottom", x: 0 },
    margin: { ...MARGIN, t: 34 },
  };
  QUANTITIES.forEach(({ name, unit }, order) => {
    const top = 1 - order * 0.255;
    const kept = held && order === 0 && div.layout?.yaxis?.range;
    layout[`yaxis${order ? order + 1 : ""}`] = {
      ...grid(colours),
      domain: [top - 0.235, top],
      title: { text: `${name} (${unit})`, font: { size: 12 } },
      range: kept || range(data, shapes, axis(order)),
    };
  });
  return draw(div, data, layout, held);
}

/** Return the range of values with some room at both ends. */
function around(values) {
  const [low, high] = values.reduce(([least, most], value) => [Math.min(least, value), Math.max(most, value)], [Infinity, -Infinity]);
  const room = 0.06 * (high - low || Math.max(Math.abs(low), 1e-3));
  return [low - room, high + room];
}

/** Draw paths in the plane: `paths` as [{ position, name, colour, dash }], the waypoints, and the polyline between them. */
export function drawInPlane(div, { paths, waypoints, names, held = false, view = "" }) {
  const colours = palette();
  const column = (rows, d) => rows.map((row) => row[d]);
  const data = [
    { x: column(waypoints, 0), y: column(waypoints, 1), mode: "lines+markers", name: "waypoints", line: { color: colours.edge, dash: "dot", width: 1 }, marker: { size: 7, color: colours.text } },
    ...paths.map(({ position, name, colour, dash }) => ({ x: column(position, 0), y: column(position, 1), mode: "lines", name, line: { color: colour, dash, width: 2, simplify: position.length > MOST_SMOOTH } })),
  ].map((trace) => ({ ...trace, type: "scatter", showlegend: false, hovertemplate: "%{x:.4~g}, %{y:.4~g}" }));
  const layout = {
    ...common(colours, `${view} plane`),
    margin: MARGIN,
    xaxis: { ...grid(colours), title: { text: `${names[0]} (unit)` }, range: around(data.flatMap((trace) => trace.x)) },
    yaxis: { ...grid(colours), title: { text: `${names[1]} (unit)` }, range: around(data.flatMap((trace) => trace.y)), scaleanchor: "x" },
  };
  return draw(div, data, layout, held);
}

const LETTER = 6.6; // px, of the drawings' font, about
const LINE = 16;

/**
 * Return on which side of each point its name stands: the first where it is inside `width` and on no other name or point.
 *
 * `points`: [{ x, y, name }] in px. A name for which there is no room is left out; it is seen when the point is pointed at.
 */
export function namesBeside(points, width) {
  const sides = { "top center": [0, -1], "bottom center": [0, 1], "middle right": [1, 0], "middle left": [-1, 0], "top right": [1, -1], "top left": [-1, -1], "bottom right": [1, 1], "bottom left": [-1, 1] };
  const taken = points.map(({ x, y }) => [x - 7, y - 7, x + 7, y + 7]);
  const meet = (one, other) => one[0] < other[2] && other[0] < one[2] && one[1] < other[3] && other[1] < one[3];
  return points.map(({ x, y, name }, k) => {
    const size = LETTER * name.length;
    const found = Object.entries(sides).find(([, [across, down]]) => {
      const [left, top] = [x + across * 9 - (size * (1 - across)) / 2, y + down * (LINE / 2 + (across ? 2 : 7)) - LINE / 2];
      const box = [left, top, left + size, top + LINE];
      if (left < 0 || box[2] > width || taken.some((other, i) => i !== k && meet(box, other))) return false;
      taken.push(box);
      return true;
    });
    return found?.[0] ?? null;
  });
}

/** Draw points in a plane of two figures: `points` as [{ x, y, name, colour }]. */
export function drawAgainst(div, { points, titles, view = "" }) {
  const colours = palette();
  const ends = (pick) => {
    const values = points.map(pick).filter((value) => value > 0).map(Math.log10);
    const [low, high] = values.length ? [Math.min(...values), Math.max(...values)] : [0, 1];
    const room = Math.max(0.1 * (high - low), 0.05);
    return [low - room, high + room];
  };
  const [across, up] = [ends((point) => point.x), ends((point) => point.y)];
  const margin = { ...MARGIN, t: 30, r: 40 };
  const [width, height] = [div.clientWidth - margin.l - margin.r, div.clientHeight - margin.t - margin.b];
  const within = (value, [low, high], size) => (size * (Math.log10(value) - low)) / (high - low);
  const sides = namesBeside(points.map(({ x, y, name }) => ({ x: margin.l + within(x, across, width), y: margin.t + height - within(y, up, height), name })), div.clientWidth);
  const data = points.map(({ x, y, name, colour }, k) => ({
    x: [x], y: [y], name, type: "scatter", mode: sides[k] ? "markers+text" : "markers", text: [name], textposition: sides[k] ?? "top center", showlegend: false,
    cliponaxis: false, marker: { size: 11, color: colour }, hovertemplate: `${name}: %{x:.5~g}, %{y:.5~g}<extra></extra>`,
  }));
  const layout = {
    ...common(colours, `${view} against`),
    margin,
    xaxis: { ...grid(colours), title: { text: titles[0] }, type: "log", range: across },
    yaxis: { ...grid(colours), title: { text: titles[1] }, type: "log", range: up },
  };
  return draw(div, data, layout);
}

const grid = (colours) => ({ type: "linear", gridcolor: colours.grid, zerolinecolor: colours.grid, linecolor: colours.grid, automargin: false, exponentformat: "e", nticks: 5 });

const common = (colours, view) => ({
  uirevision: view,
  autosize: true,
  dragmode: "zoom",
  hovermode: "closest",
  paper_bgcolor: colours.paper,
  plot_bgcolor: colours.paper,
  font: { color: colours.text, family: "system-ui, sans-serif", size: 12 },
});
