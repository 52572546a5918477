// Elements, numbers as text, and a place to say what was done.

/** Return an element: properties, `on…` listeners and attributes from `given`, then children (text or elements). */
export function h(tag, given = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(given)) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else if (name === "class") node.className = value;
    else if (name in node && name !== "list" && name !== "form") node[name] = value;
    else node.setAttribute(name, value === true ? "" : value);
  }
  node.append(...children.flat(Infinity).filter((child) => child !== null && child !== undefined && child !== false));
  return node;
}

let counted = 0;

/** Return an id that no other element has. */
export const fresh = (stem) => `${stem}-${++counted}`;

/** Return a number as text with `digits` significant ones; a dash for what is not there. */
export function figure(value, digits = 4) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  return size >= 1e6 || size < 1e-4 ? value.toExponential(digits - 1) : String(Number(value.toPrecision(digits)));
}

/** Return a share as text, in per cent. */
export const percent = (value) => (value === null || value === undefined ? "–" : `${figure(100 * value, 3)} %`);

/** Say something to those who look and to those who listen. */
export function say(text) {
  const place = document.getElementById("say");
  place.textContent = text;
  place.classList.add("shown");
  clearTimeout(say.timer);
  say.timer = setTimeout(() => place.classList.remove("shown"), 4000);
}

/** Wait until what was changed is on the screen. */
export const painted = () => new Promise((done) => requestAnimationFrame(() => setTimeout(done)));

/** Return a button. */
export const button = (label, onclick, given = {}) => h("button", { type: "button", onclick, ...given }, label);
