// The tab that judges anyone's trajectory: where it breaks limits, and the same path timed so that it does not.

import { drawOverTime, style } from "./chart.js";
import { button, figure, fresh, h } from "./dom.js";
import { MOST_DRAWN, motionOf, sparser } from "./motion.js";
import { Misread } from "./parse.js";
import { LIMITED } from "./request.js";
import { markErrors, schemaForm } from "./schema_form.js";
import { Problem, call, newest } from "./service.js";
import { change, current, watch } from "./state.js";
import { certificateTable, failure, tile, warnings } from "./summary.js";
import { FORMATS, exported } from "./take.js";

export const id = "judge";
export const title = "Certify and retime";

const MOST_BYTES = 20e6; // of a file; the service takes less
const LONG = 20_000; // characters
const SAVED = FORMATS.filter(([name]) => ["CSV", "ROS 2"].includes(name));

/** Return a motion of two joints that is too fast: it breaks both of its limits. */
function example() {
  const rows = Array.from({ length: 41 }, (_, i) => {
    const s = i / 40;
    const swing = 0.35 * Math.sin(Math.PI * s) ** 3 * Math.sin(3 * Math.PI * s);
    return [1.6 * s, 1.2 * (3 * s ** 2 - 2 * s ** 3), 0.5 * s + swing].map((value) => Number(value.toFixed(6))).join(",");
  });
  return { text: ["time,position_1,position_2", ...rows].join("\n"), limits: { velocity: 1, acceleration: 4, jerk: 60 }, retime: true };
}

/** Return the share of its limit that a check found; nothing is more than without bound, and a one-sided limit has no share. */
const shareOf = ({ ratio, value }) => ratio ?? (value === null ? Infinity : 0);

function told({ ratio, value, holds }) {
  if (value === null) return "unbounded";
  if (ratio === null) return holds ? "within its bound" : "beyond its bound";
  return `at ${figure(100 * ratio, 4)} % of its limit`;
}

export function mount(panel, catalogue) {
  const set = (parts) => change({ judge: { ...current().judge, ...parts } }, "judge");
  const editor = h("form", { class: "editor", "aria-label": "What is judged", onsubmit: (event) => event.preventDefault() });
  const top = h("div", { class: "top-line" });
  const time = h("div", { class: "chart tall", id: "judge-chart" });
  const caption = h("figcaption", { class: "about" });
  const below = h("div", { class: "below" });
  const figures = h("div", { class: "figures" }, h("figure", { class: "figure", "aria-label": "The motion over time" }, time, caption));
  const view = h("div", { class: "view" }, top, figures, below);
  panel.append(h("div", { class: "split" }, editor, view));

  let read = { text: null, motion: null, wrong: null }; // the newest text, and what is in it, or the error
  let judged = null; // the newest answer of each kind: { of: the motion, body, data or problem }
  let retimed = null;
  let asked = ""; // what they are to

  function motion() {
    const { text = "" } = current().judge;
    if (text === read.text) return read;
    read = { text, motion: null, wrong: null, serial: (read.serial ?? 0) + 1 };
    try {
      if (text.trim()) read.motion = { ...motionOf(text.replaceAll("\r\n", "\n")), serial: read.serial }; // as the textarea has it
    } catch (error) {
      read.wrong = error instanceof Misread ? error : new Misread("this is no trajectory of a kind that is read here");
    }
    return read;
  }

  /** Return a job that asks `path` for the newest only and gives `keep` the answer, or the problem; then `next` may begin. */
  const asking = (path, keep) =>
    newest(async ({ of, body, next }, signal) => {
      try {
        keep({ of, body, data: (await call(path, { body, signal })).data });
        next?.();
      } catch (error) {
        if (!(error instanceof Problem)) throw error;
        keep({ of, body, problem: located(error.document, of) });
        if (error.document.status !== 422) asked = ""; // the same may be asked again
        if (error.retryAfter) setTimeout(update, 1000 * error.retryAfter);
      }
      await show();
      panel.dataset.judged = Number(panel.dataset.judged ?? 0) + 1;
    });
  const certify = asking("v1/certificates", (found) => (judged = found));
  const retime = asking("v1/retimings", (found) => (retimed = found));

  const wanted = () => (current().judge.retime ?? true) && (current().judge.limits?.acceleration ?? null) !== null;

  /** Judge what is there now; only while the tab is seen. */
  function update() {
    if (current().tab !== id) return;
    if (current().judge.text === undefined) return void change({ judge: { ...example(), ...current().judge } }, "example");
    const { motion: of, wrong } = motion();
    if (!of) return refused(wrong);
    const { limits = {}, tolerance } = current().judge;
    const next = JSON.stringify([of.serial, limits, tolerance, wanted()]);
    if (next === asked) return void show();
    asked = next;
    const sampling = { count: Math.min(MOST_DRAWN, Math.max(200, of.drawn?.motions[0].time.length ?? 0)) }; // about as dense as given
    const body = { trajectory: of.trajectory, limits, tolerance, joint_names: of.names, sampling };
    if (!wanted()) retimed = null;
    // one after the other: the certificate is there at once, a retiming may take long
    certify({ of, body: { trajectory: of.trajectory, limits }, next: wanted() ? () => retime({ of, body }) : null });
  }

  /** Return whether a retimed motion is to other limits than those that are set now: the next one is on its way. */
  const isStale = ({ body }) => JSON.stringify([body.limits ?? {}, body.tolerance]) !== JSON.stringify([current().judge.limits ?? {}, current().judge.tolerance]);

  function refused(wrong) {
    asked = "";
    markErrors(editor, wrong ? [{ field: "/trajectory", reason: wrong.message, action: going(wrong.place) }] : []);
    view.classList.add("refused");
    top.replaceChildren(wrong ? failure({ title: "This cannot be read", detail: wrong.message }) : h("p", {}, "Paste a trajectory, drop a file, or take the example."));
    below.replaceChildren();
  }

  /** Return the button that shows a place of the text; none where there is no place. */
  const going = (place) => place && { label: `Show line ${place.line}`, run: () => goTo(place) };

  /** Select a place of the text and scroll to it, which browsers leave to us; no line is wrapped, and all letters are as wide. */
  function goTo({ line, from, to }) {
    const area = editor.querySelector("textarea");
    area.focus();
    area.setSelectionRange(from, to);
    const lines = area.value.split("\n");
    const column = from - (area.value.lastIndexOf("\n", from - 1) + 1);
    area.scrollTop = (line - 1) * parseFloat(getComputedStyle(area).lineHeight) - area.clientHeight / 2;
    area.scrollLeft = (area.scrollWidth * column) / lines.reduce((most, one) => Math.max(most, one.length), 1) - area.clientWidth / 2;
  }

  /** Return a problem whose findings about the trajectory are told with the line of the text that they belong to. */
  function located(problem, of) {
    if (!problem?.errors) return problem;
    let { detail } = problem;
    const errors = problem.errors.map((one) => {
      const place = one.field.startsWith("/trajectory/") ? of.place(one.field) : null;
      if (!place) return one;
      detail = detail.replace(`${one.field}: `, `${place.told}: `);
      return { field: "/trajectory", reason: `${place.told}: ${one.reason}`, action: going(place) };
    });
    return { ...problem, errors, detail };
  }

  /** Show the newest answers, but for those to a text that is no longer there. */
  function show() {
    const { motion: of } = motion();
    if (!of || judged?.of !== of) return null;
    const after = wanted() && retimed?.of === of ? retimed : null;
    const problems = [judged.problem, after?.problem].filter(Boolean);
    const errors = new Map(problems.flatMap((found) => found.errors ?? []).map((one) => [one.field + one.reason, one]));
    const left = markErrors(editor, [...errors.values()]);
    view.classList.toggle("refused", Boolean(judged.problem));
    top.replaceChildren(judged.problem ? failure(judged.problem, { left }) : glance(of, judged.data.certificate, after));
    below.replaceChildren(...tables(of, after, left));
    return current().tab === id ? draw(of, after) : null;
  }

  function glance(of, certificate, after) {
    const worst = certificate.checks.toSorted((a, b) => a.holds - b.holds || shareOf(b) - shareOf(a))[0];
    const about = worst ? `${worst.quantity.replaceAll("_", " ")} ${told(worst)}` : "no limits are set";
    const before = lengthOf(of);
    const waiting = wanted() ? "computing …" : current().judge.retime === false ? "not asked" : "needs an acceleration limit";
    return h(
      "dl",
      { class: "glance" },
      tile("As given", `${figure(before, 5)} s`, of.about),
      tile("Certificate", certificate.holds ? "✓ holds" : "✗ broken", `${about}; ${certificate.basis.replaceAll("_", " ")}`, certificate.holds ? "good" : "bad"),
      after?.data && !isStale(after)
        ? tile("Retimed", `${figure(after.data.duration, 5)} s`, `${after.data.duration ? `${figure(after.data.duration / before, 3)} times as long` : "nothing moves: there is nothing to time"}; certificate ${after.data.certificate.holds ? "holds" : "is broken"}`, "good")
        : tile("Retimed", "–", after?.problem && !isStale(after) ? "refused, see below" : waiting),
    );
  }

  function tables(of, after, left) {
    const names = namesOf(of);
    const stale = after && isStale(after);
    const part = (heading, ...content) => h("section", { class: heading === "Retimed" && stale ? "verdict stale" : "verdict" }, h("h2", {}, heading), content);
    const given = judged.problem ? null : part("As given", certificateTable(judged.data.certificate, names));
    if (!after || judged.problem) return [given].filter(Boolean);
    if (after.problem) return [given, part("Retimed", failure(after.problem, { left }))];
    const files = SAVED.map((format) => button(`Retimed as ${format[0]}`, () => exported("v1/retimings", after.body, format, "retimed")));
    return [given, part("Retimed", warnings(after.data.warnings), certificateTable(after.data.certificate, names), h("p", { class: "actions" }, files))];
  }

  /** Draw the motion and, over it, the retimed one from the same start. */
  function draw(of, after) {
    figures.hidden = !of.drawn;
    if (!of.drawn) return null;
    const { dims, motions: given, differences: computed } = of.drawn;
    const joints = Array.from({ length: dims }, (_, d) => d);
    const names = namesOf(of);
    const motions = given.map((samples) => ({ samples, joints, label: (d) => names[d], look: style }));
    if (after?.data) {
      const { samples } = after.data;
      const shift = given[0].time[0] - samples.time[0];
      // of the same colour, with a dash that no joint has as given
      const look = (d) => style(d + (dims > 6 ? 12 : 6));
      motions.push({ samples: { ...samples, time: samples.time.map((value) => value + shift) }, joints, label: (d) => `${names[d]}, retimed`, look });
    }
    caption.textContent = [
      computed.length ? `${computed.join(", ")}: finite differences of the positions.` : "",
      judged.data?.certificate.checks.length ? "◇ where each limit is nearest, or broken." : "",
      after?.data ? "Retimed: dashed." : "",
      motions.some(({ samples }) => samples.time.length > MOST_DRAWN) ? `Drawn: the extremes of ${MOST_DRAWN / 2} spans of time.` : "",
    ].join(" ");
    const frame = { limits: current().judge.limits, dims, joints, look: style };
    return drawOverTime(time, { motions: motions.flatMap(sparser), frame, certificate: judged.data?.certificate, view: `judge ${of.serial}` });
  }

  function build() {
    const { text = "", limits = {}, tolerance, retime: ticked = true } = current().judge;
    const area = h("textarea", { id: fresh("text"), rows: 12, wrap: "off", spellcheck: false, value: text, placeholder: "time,position_1,position_2\n0,0,0\n0.1,0.02,0.01", oninput: () => set({ text: area.value }), onpaste: pasted });
    const file = h("input", { type: "file", id: fresh("file"), accept: ".csv,.txt,.json,text/csv,application/json", onchange: () => take(file.files[0]) });
    const box = h("input", { type: "checkbox", id: fresh("retime"), checked: ticked, onchange: () => set({ retime: box.checked }) });
    const form = (schema, names, at, value, changed) => schemaForm({ schema: catalogue.schemas[schema], defs: catalogue.schemas, names, at, value, changed });
    editor.replaceChildren(
      h("section", { class: "part drop", ondragover: (event) => event.preventDefault(), ondrop: dropped }, h("h2", {}, "The trajectory"),
        h("div", { "data-at": "/trajectory" }, h("label", { htmlFor: area.id, class: "about" }, "CSV with a header, ROS 2 JointTrajectory, samples or a polynomial as JSON: paste it, or drop a file here"), area),
        h("p", { class: "actions" }, button("Example", () => change({ judge: example() }, "example")), h("label", { htmlFor: file.id }, "or a file"), file)),
      h("section", { class: "part", "data-at": "/limits" }, h("h2", {}, "Limits"), form("LimitsBody", [...LIMITED, "velocity_norm", "position"], "/limits", limits, (next) => set({ limits: next }))),
      h("section", { class: "part" }, h("h2", {}, "Retiming"), h("p", { class: "inline" }, box, h("label", { htmlFor: box.id }, "retime: the same path as fast as the limits allow")),
        form("RetimeBody", ["tolerance"], "", { tolerance }, (next) => set({ tolerance: next.tolerance }))),
    );
  }

  /** Put a long text in at once: by itself a browser takes it line by line, and minutes for 10,000. */
  function pasted(event) {
    const text = event.clipboardData.getData("text");
    if (text.length < LONG) return;
    event.preventDefault();
    event.target.setRangeText(text, event.target.selectionStart, event.target.selectionEnd, "end");
    set({ text: event.target.value });
  }

  function dropped(event) {
    event.preventDefault();
    const [file] = event.dataTransfer.files;
    if (file) take(file);
    else if (event.dataTransfer.getData("text")) change({ judge: { ...current().judge, text: event.dataTransfer.getData("text") } }, "file");
  }

  async function take(file) {
    if (!file) return;
    if (file.size > MOST_BYTES) return void markErrors(editor, [{ field: "/trajectory", reason: `${file.name} is larger than ${MOST_BYTES / 1e6} MB` }]);
    change({ judge: { ...current().judge, text: await file.text() } }, "file");
  }

  watch((parts, origin) => {
    if (origin === "theme") return void (current().tab === id && show());
    if (parts.includes("judge") && origin !== "judge") build();
    if (parts.includes("judge") || parts.includes("tab")) update();
  });
  build();
  update();
}

const namesOf = ({ names, drawn }) => names ?? Array.from({ length: drawn?.dims ?? 0 }, (_, d) => `joint ${d}`);
const lengthOf = ({ trajectory: { samples, polynomial } }) => {
  const time = samples?.time ?? polynomial.breaks;
  return time.at(-1) - time[0];
};
