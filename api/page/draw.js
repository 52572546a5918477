// plotly.js: read when something is drawn first, sketched until then, and spared what need not be drawn anew.

import { h, painted, say } from "./dom.js";
import { sketch } from "./sketch.js";

const CONFIG = { responsive: true, displaylogo: false, doubleClick: "reset", modeBarButtonsToRemove: ["select2d", "lasso2d"] };

let library = null;

/** Return plotly.js; it is read when something is drawn, for it takes a second or two of the browser. */
export function plotly() {
  const missing = "To be moved, drawings need plotly.js on the service: pip install 'waywright[service]'";
  library ??= new Promise((onload, failed) => {
    document.head.append(h("script", { src: "page/plotly.min.js", onload, onerror: () => failed(new Error(missing)) }));
  }).then(
    () => globalThis.Plotly,
    (error) => {
      library = null; // it may be there the next time
      throw error;
    },
  );
  return library;
}

const zooms = new WeakMap(); // of each drawing the axes that somebody zoomed
const newest = new WeakMap(); // of each drawing what is to be drawn, so that nothing older is

/** Remember which axes are zoomed: by itself plotly.js forgets it as soon as other numbers give the axis another range. */
function watchZoom(div) {
  if (zooms.has(div)) return;
  zooms.set(div, new Set());
  div.on("plotly_doubleclick", () => zooms.get(div).clear());
  div.on("plotly_relayout", (changes) => {
    for (const [, name, what] of Object.keys(changes).flatMap((key) => [...key.matchAll(/^([xy]axis\d*)\.(range|autorange)/g)])) {
      if (what === "range") zooms.get(div).add(name);
      else zooms.get(div).delete(name);
    }
  });
}

/** Put the ranges of zoomed axes into a layout, as long as it is a view of the same. */
function keepZoom(div, layout) {
  const zoomed = zooms.get(div);
  if (!zoomed) return;
  if (div.layout.uirevision !== layout.uirevision) zoomed.clear();
  for (const name of zoomed) layout[name].range = [...div.layout[name].range];
}

/** Return whether traces and layout differ from those drawn by the lines' numbers only, which lie within the axes. */
function fits(div, data, layout) {
  if (div.data?.length !== data.length || div.layout.paper_bgcolor !== layout.paper_bgcolor) return false;
  if (JSON.stringify(div.layout.shapes) !== JSON.stringify(layout.shapes)) return false;
  return data.every((trace, k) => {
    const before = div.data[k];
    if (["name", "yaxis", "mode"].some((part) => before[part] !== trace[part]) || before.marker?.color !== trace.marker?.color) return false;
    return [["xaxis", trace.x], [(trace.yaxis ?? "y").replace("y", "yaxis"), trace.y]].every(([name, values]) => {
      if (zooms.get(div)?.has(name)) return true;
      const [low, high] = div._fullLayout[name].range;
      return values.every((value) => value >= low && value <= high);
    });
  });
}

/** Move the lines and marks that are drawn to new numbers; returns whether that could be done. */
function moved(div, data, layout) {
  if (!fits(div, data, layout)) return false;
  const { _fullLayout: axes } = div;
  const drawn = {}; // by axis, in the order of the traces
  const moves = data.map(({ x, y, yaxis = "y" }) => {
    drawn[yaxis] ??= [...div.querySelectorAll(`.subplot.x${yaxis} .scatterlayer > .trace`)];
    const node = drawn[yaxis].shift();
    const [across, up] = [axes.xaxis, axes[yaxis.replace("y", "yaxis")]];
    const places = x.map((value, i) => `${across.l2p(value).toFixed(2)},${up.l2p(y[i]).toFixed(2)}`);
    const [lines, points] = ["path.js-line", ".points > path"].map((part) => node?.querySelectorAll(part) ?? []);
    if (lines.length > 1 || (points.length && points.length !== places.length) || !(lines.length + points.length)) return null;
    return () => {
      lines.forEach((line) => line.setAttribute("d", `M${places.join("L")}`));
      points.forEach((point, i) => point.setAttribute("transform", `translate(${places[i]})`));
    };
  });
  if (moves.includes(null) || Object.values(drawn).some((rest) => rest.length)) return false;
  moves.forEach((move) => move());
  return true;
}

/**
 * Draw. While something is held only what moves is moved, if that will do: a whole drawing is some 80 ms of plotly.js.
 * What plotly.js knows of is older then, so when it is let go all must be drawn once more.
 */
export async function draw(div, data, layout, held) {
  newest.set(div, data);
  if (held && moved(div, data, layout)) return;
  if (!globalThis.Plotly) {
    sketch(div, data, layout);
    await painted();
    performance.mark("sketched");
  }
  try {
    await plotly();
  } catch (error) {
    return void say(error.message);
  }
  if (newest.get(div) !== data) return; // another drawing overtook this one while it waited
  if (div.firstChild?.matches("svg")) div.replaceChildren(); // the sketch
  keepZoom(div, layout);
  await globalThis.Plotly.react(div, data, layout, CONFIG);
  watchZoom(div);
}
