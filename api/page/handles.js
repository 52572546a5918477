// Points over a drawing that can be dragged, or moved by the arrow keys.

import { figure, h } from "./dom.js";

/**
 * Lay handles over a drawing, and put them in place after each drawing.
 *
 * `points()` returns [{ key, x, y, label, colour, name }], in the order of the arrow keys; `moved(key, x, y)` is
 * called while one is moved, `released()` when one is let go that was not; `free` says in which directions they go: "x",
 * "y" or "xy". Returns a function that lays them anew, and whether one is held now.
 */
export function layHandles(div, { points, moved, released, free }) {
  const layer = h("div", { class: "handles" });
  div.parentElement.append(layer);
  let held = null;

  const axes = () => [div._fullLayout?.xaxis, div._fullLayout?.yaxis];

  function place(node, point) {
    const [x, y] = axes();
    let [left, top] = [x.d2p(point.x), y.d2p(point.y)];
    const outside = !(left >= -1 && left <= x._length + 1 && top >= -1 && top <= y._length + 1);
    const used = node === held?.node || node === document.activeElement;
    node.hidden = outside && !used; // one that is used waits at the edge
    if (outside) [left, top] = [Math.min(Math.max(left, 0), x._length), Math.min(Math.max(top, 0), y._length)];
    node.style.transform = `translate(${x._offset + left}px, ${y._offset + top}px)`;
    node.style.setProperty("--colour", point.colour);
    node.ariaLabel = `${point.label}: ${figure(point.y)}`;
    node.title = `${point.label}: drag, or use the arrow keys`;
  }

  function lay() {
    const [x, y] = axes();
    if (!x?.d2p || !y?.d2p) return;
    const wanted = points();
    if (held && !wanted.some(({ key: one }) => String(one) === String(held.from.key))) held = null; // its waypoint is gone
    while (layer.children.length > wanted.length) layer.lastChild.remove();
    while (layer.children.length < wanted.length) layer.append(made());
    wanted.forEach((point, k) => {
      const node = layer.children[k];
      node.point = point;
      node.tabIndex = k === 0 ? 0 : -1;
      if (node !== held?.node) place(node, point);
    });
  }

  function made() {
    const node = h("button", { type: "button", class: "handle" });
    node.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      held = { node, from: node.point, x: event.clientX, y: event.clientY, pointer: event.pointerId };
      node.setPointerCapture(event.pointerId);
      node.classList.add("held");
    });
    node.addEventListener("pointermove", (event) => held?.node === node && drag(event));
    node.addEventListener("pointerup", (event) => release(node, () => drag(event)));
    node.addEventListener("lostpointercapture", () => release(node, () => moved(held.from.key, held.from.x, held.from.y)));
    node.addEventListener("keydown", (event) => (event.key === "Escape" && held ? node.releasePointerCapture(held.pointer) : key(event, node)));
    return node;
  }

  /** Let go: `last` is what is still done with what was dragged, to put it where it is, or back. */
  function release(node, last) {
    node.classList.remove("held");
    if (held?.node !== node) return;
    const { dragged } = held;
    if (dragged) last();
    held = null;
    lay();
    if (!dragged) released();
  }

  function drag(event) {
    const [x, y] = axes();
    const { from, node } = held;
    const point = { ...from };
    if (free().includes("x")) point.x = x.p2d(x.d2p(from.x) + event.clientX - held.x);
    if (free().includes("y")) point.y = y.p2d(y.d2p(from.y) + event.clientY - held.y);
    held.dragged = true;
    const settled = moved(from.key, rounded(point.x, x), rounded(point.y, y));
    place(node, { ...point, ...settled });
  }

  function key(event, node) {
    const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (event.key === "Home" || event.key === "End" || event.key === "PageUp" || event.key === "PageDown") {
      event.preventDefault();
      const nodes = [...layer.children];
      const at = nodes.indexOf(node);
      const next = { Home: 0, End: nodes.length - 1, PageUp: Math.max(0, at - 1), PageDown: Math.min(nodes.length - 1, at + 1) };
      nodes[next[event.key]].focus();
      return;
    }
    if (!step) return;
    event.preventDefault();
    const [x, y] = axes();
    const size = event.shiftKey ? 0.1 : 0.01;
    const by = (axis, sign) => sign * size * Math.abs(axis.range[1] - axis.range[0]);
    const { point } = node;
    const next = { x: free().includes("x") ? point.x + by(x, step[0]) : point.x, y: free().includes("y") ? point.y + by(y, step[1]) : point.y };
    moved(point.key, rounded(next.x, x), rounded(next.y, y));
    lay();
  }

  div.on?.("plotly_afterplot", lay);
  return { lay, holding: () => held !== null };
}

/** Return a value with as many decimals as a pixel of the axis is worth. */
function rounded(value, axis) {
  const pixel = Math.abs(axis.range[1] - axis.range[0]) / axis._length;
  const decimals = Math.min(12, Math.max(0, Math.ceil(-Math.log10(pixel))));
  return Number(value.toFixed(decimals));
}
