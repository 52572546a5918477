// A first drawing without plotly.js, from the same data and layout, while those five megabytes are still being read.

const NAMES = "http://www.w3.org/2000/svg";
const DASHES = { dash: "9 9", dot: "3 3", dashdot: "9 3 3 3" };
const TICKS = 5;

function shape(tag, given, text = "") {
  const node = document.createElementNS(NAMES, tag);
  for (const [name, value] of Object.entries(given)) node.setAttribute(name, value);
  node.textContent = text;
  return node;
}

/** Return round values within a range, so many at most. */
function ticks([low, high]) {
  const least = (high - low) / TICKS;
  const power = 10 ** Math.floor(Math.log10(least));
  const step = power * [1, 2, 5, 10].find((one) => one * power >= least);
  const first = Math.ceil(low / step);
  return Array.from({ length: Math.floor(high / step) - first + 1 }, (_, i) => Number(((first + i) * step).toPrecision(12)));
}

/** Return the text of a value at an axis. */
const written = (value) => (Math.abs(value) >= 1e5 ? value.toExponential() : String(value)).replace("-", "−");

/** Return the ranges of two axes whose units are to be of one length: the finer one is widened on both sides. */
function alike(across, up, width, height) {
  const [wide, tall] = [across, up].map(([low, high]) => high - low);
  const unit = Math.max(wide / width, tall / height);
  const widen = ([low, high], size) => [(low + high - unit * size) / 2, (low + high + unit * size) / 2];
  return [widen(across, width), widen(up, height)];
}

/** Draw lines, marks, limits and axes of `data` and `layout`, which are plotly.js's, into `div`; axes are linear. */
export function sketch(div, data, layout) {
  const { l, r, t, b } = layout.margin;
  const [width, height] = [div.clientWidth, div.clientHeight];
  const [wide, tall] = [width - l - r, height - t - b];
  if (!(wide > 0 && tall > 0) || layout.xaxis.type === "log") return;
  const root = shape("svg", { width, height, viewBox: `0 0 ${width} ${height}`, fill: "none", "font-size": 12, "font-family": layout.font.family });
  const scaled = layout.yaxis.scaleanchor ? alike(layout.xaxis.range, layout.yaxis.range, wide, tall) : [layout.xaxis.range, layout.yaxis.range];
  const [from, to] = scaled[0];
  const x = (value) => l + (wide * (value - from)) / (to - from);
  const label = (px, py, anchor, text, more = {}) => root.append(shape("text", { x: px, y: py, "text-anchor": anchor, fill: layout.font.color, ...more }, text));
  for (const name of Object.keys(layout).filter((one) => one.startsWith("yaxis"))) {
    const { title, gridcolor, range, domain = [0, 1] } = layout[name];
    const [low, high] = name === "yaxis" ? scaled[1] : range;
    const [top, size] = [t + tall * (1 - domain[1]), tall * (domain[1] - domain[0])];
    const y = (value) => top + (size * (high - value)) / (high - low);
    const frame = shape("svg", { x: l, y: top, width: wide, height: size, viewBox: `${l} ${top} ${wide} ${size}` }); // cuts off what sticks out
    const line = (x0, y0, x1, y1, stroke, more = {}) => frame.append(shape("path", { d: `M${x0},${y0}L${x1},${y1}`, stroke, ...more }));
    const axis = name.replace("axis", "");
    for (const one of (layout.shapes ?? []).filter((each) => each.yref === axis)) {
      const [x0, x1] = one.xref === "x" ? [x(one.x0), x(one.x1)] : [l, l + wide];
      if (one.type === "rect") frame.append(shape("rect", { x: x0, y: y(one.y1), width: x1 - x0, height: y(one.y0) - y(one.y1), fill: one.fillcolor }));
      else line(x0, y(one.y0), x1, y(one.y1), one.line.color, { "stroke-width": one.line.width, "stroke-dasharray": DASHES.dash });
    }
    for (const value of ticks([from, to])) line(x(value), top, x(value), top + size, gridcolor);
    for (const value of ticks([low, high])) {
      line(l, y(value), l + wide, y(value), gridcolor);
      label(l - 4, y(value) + 4, "end", written(value));
    }
    for (const { x: across, y: up, yaxis = "y", mode = "lines", line: pen = {}, marker = {} } of data) {
      if (yaxis !== axis || up[0] === null) continue;
      const places = up.map((value, i) => `${x(across[i]).toFixed(2)},${y(value).toFixed(2)}`);
      const dash = DASHES[pen.dash] ?? "none";
      if (mode.includes("lines")) frame.append(shape("path", { d: `M${places.join("L")}`, stroke: pen.color, "stroke-width": pen.width, "stroke-dasharray": dash }));
      if (!mode.includes("markers")) continue;
      // a diamond, or a dot: a line of no length with round ends
      const d = places.map((place) => `M${place}${marker.symbol ? "m0-5l5,5-5,5-5-5z" : "h0"}`).join("");
      frame.append(shape("path", { d, stroke: marker.color, "stroke-width": marker.symbol ? 2 : marker.size, "stroke-linecap": "round" }));
    }
    root.append(frame);
    label(0, 0, "middle", title.text, { transform: `translate(14 ${top + size / 2}) rotate(-90)`, "font-size": title.font?.size ?? 14 });
  }
  for (const value of ticks([from, to])) label(x(value), height - b + 16, "middle", written(value));
  label(l + wide / 2, height - 8, "middle", layout.xaxis.title.text, { "font-size": 14 });
  div.replaceChildren(root);
}
