// Take it away: the same request for the shell, for Python and as a link; the answer as a file.

import { button, h, say } from "./dom.js";
import { plotly } from "./draw.js";
import { Problem, download, isKeyed } from "./service.js";
import { hash } from "./state.js";

export const FORMATS = [
  ["CSV", "text/csv", "csv"],
  ["ROS 2", "application/vnd.ros2.joint-trajectory+json", "ros2.json"],
  ["npz", "application/x-npz", "npz"],
  ["JSON", "application/json", "json"],
];

const PICTURE = { format: "png", width: 1200, height: 1000, scale: 2, filename: "trajectory" };

const here = () => new URL(".", document.baseURI).href.replace(/\/$/, "");

/** Return the request as a command, which never holds the key; quotes inside are closed, given on their own, and opened again. */
const curl = (request) => `curl -s ${here()}/v1/trajectories${isKeyed() ? ' -H "X-API-Key: $WAYWRIGHT_KEY"' : ""} -H 'Content-Type: application/json' -d '${JSON.stringify(request).replaceAll("'", "'\\''")}'`;

/** Return a value as Python writes it. */
function literal(value) {
  if (value === null) return "None";
  if (value === true) return "True";
  if (value === false) return "False";
  if (Array.isArray(value)) return `[${value.map(literal).join(", ")}]`;
  if (typeof value === "object") return `{${Object.entries(value).map(([key, one]) => `${JSON.stringify(key)}: ${literal(one)}`).join(", ")}}`;
  return JSON.stringify(value);
}

function python(request) {
  const { waypoints, ...given } = request;
  const rows = Object.entries(given).filter(([, value]) => value !== null).map(([name, value]) => `        ${name}=${literal(value)},\n`).join("");
  const [imports, key] = isKeyed() ? ["import os\n\n", ', api_key=os.environ["WAYWRIGHT_KEY"]'] : ["", ""];
  return `${imports}from api import Client  # installed with waywright

with Client(${JSON.stringify(here())}${key}) as client:
    result = client.plan(
        ${literal(waypoints)},
${rows}    )
print(result.duration, result.certificate["holds"])
`;
}

async function copied(text, what) {
  try {
    await navigator.clipboard.writeText(text);
    say(`${what} copied`);
  } catch {
    // no clipboard where the page has no https and no localhost: show it, to be copied by hand
    const area = h("textarea", { rows: 10, value: text, readOnly: true, "aria-label": what });
    const dialog = h("dialog", { onclose: () => dialog.remove() }, h("form", { method: "dialog" }, h("p", {}, what), area, h("button", {}, "Close")));
    document.body.append(dialog);
    dialog.showModal();
    area.select();
  }
}

/** Let the browser save a blob. */
export function save(blob, name) {
  const link = h("a", { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/** Fetch what was posted to `path` once more in another format, and save it. */
export async function exported(path, body, [label, type, ending], name) {
  try {
    save(await download(path, { body, accept: type }), `${name}.${ending}`);
    say(`${label} saved`);
  } catch (error) {
    if (!(error instanceof Problem)) throw error;
    say(error.message);
  }
}

/** Copy the address, which holds what is shown. */
export function copyLink() {
  const part = hash();
  if (part === null) return say("Too many waypoints for an address: take the JSON");
  copied(`${document.baseURI.split("#")[0]}${part}`, "The link");
}

/** Return the bar of buttons; `request()` is the present one, `picture` the drawing that is saved as PNG. */
export function takeAway({ request, picture }) {
  const rate = h("input", { type: "number", min: 0, step: "any", placeholder: "as asked", title: "a sample every so many seconds in the files" });
  const sampled = () => (rate.valueAsNumber > 0 ? { ...request(), sampling: { dt: rate.valueAsNumber } } : request());
  return h(
    "section",
    { class: "take", "aria-label": "Take it away" },
    h("h2", {}, "Take it away"),
    h("div", { class: "actions" }, button("Copy as curl", () => copied(curl(request()), "curl")), button("Copy as Python", () => copied(python(request()), "Python"))),
    h(
      "div",
      { class: "actions" },
      h("label", {}, "sample every ", rate, " s"),
      FORMATS.map((format) => button(format[0], () => exported("v1/trajectories", sampled(), format, "trajectory"))),
      button("PNG", () => plotly().then((library) => library.downloadImage(picture(), PICTURE)).catch((error) => say(error.message))),
    ),
  );
}
