// Forms out of JSON schemas: nothing here knows a method or an option by name.

import { button, fresh, h } from "./dom.js";

/** Return a schema with its reference, if it is one, followed. */
function followed(schema, defs) {
  const name = schema?.$ref?.split("/").at(-1);
  return name ? followed({ ...defs[name], ...schema, $ref: undefined }, defs) : schema;
}

/** Return the kinds of values that a schema takes, null apart. */
function choices(schema, defs) {
  const several = schema.oneOf ?? schema.anyOf;
  const all = (several ?? [schema]).map((one) => followed(one, defs));
  return all.flatMap((one) => (one.oneOf || one.anyOf ? choices(one, defs) : [one])).filter((one) => one.type !== "null");
}

const isPlain = (schema) => ["number", "integer", "string"].includes(schema.type) && !schema.enum && schema.const === undefined;

/** Return the text by which a value is edited. */
const written = (value) => (value === undefined || value === null ? "" : typeof value === "string" ? value : JSON.stringify(value));

/** Return the value of a text: JSON; a list without its brackets; or the text itself where strings are taken. */
export function read(text, kinds = []) {
  const trimmed = text.trim();
  if (trimmed === "") return undefined;
  for (const candidate of [trimmed, `[${trimmed}]`]) {
    try {
      return JSON.parse(candidate);
    } catch {
      // the next reading
    }
  }
  const words = kinds.some((kind) => kind.type === "array" && kind.items?.type === "string");
  const word = kinds.some((kind) => kind.type === "string");
  if (words && (!word || trimmed.includes(","))) return trimmed.split(",").map((one) => one.trim());
  if (word) return trimmed;
  throw new Error("this is no number, list like 1, 2, 3, or JSON");
}

/** Return a field with its label, its unit and a description that opens on demand; `at` is its JSON pointer. */
export function field({ at, label, unit, description, control, after }) {
  const labelled = control.matches("span") ? control.querySelector("input") : control;
  labelled.id ||= fresh("field");
  const about = description ? h("small", { id: fresh("about"), class: "about" }, description) : null;
  if (about) labelled.setAttribute("aria-describedby", about.id);
  const row = h("div", { class: "field", "data-at": at });
  row.append(h("label", { htmlFor: labelled.id }, label, unit ? h("span", { class: "unit" }, ` ${unit}`) : null), h("div", { class: "control" }, control, after));
  if (about) row.append(about);
  return row;
}

/** Return the control of one property. `changed(value)` gets undefined where the field was emptied. */
function control(schema, kinds, value, changed) {
  const [kind] = kinds;
  if (kinds.length === 1 && (kind.enum || kind.const !== undefined)) {
    const values = kind.enum ?? [kind.const];
    const select = h("select", { onchange: () => changed(select.value === "" ? undefined : values[Number(select.value)]) });
    select.append(h("option", { value: "" }, schema.default === undefined || schema.default === null ? "–" : `${schema.default} (default)`));
    values.forEach((one, k) => select.append(h("option", { value: k, selected: one === value }, String(one))));
    return select;
  }
  if (kinds.length === 1 && kind.type === "boolean") {
    const box = h("input", { type: "checkbox", checked: value ?? schema.default ?? false });
    box.onchange = () => changed(box.checked === (schema.default ?? false) ? undefined : box.checked);
    return box;
  }
  if (kinds.length === 1 && isPlain(kind) && kind.type !== "string") {
    const box = h("input", { type: "number", step: kind.type === "integer" ? 1 : "any", value: value ?? "", placeholder: written(schema.default) });
    for (const [name, bound] of [["min", kind.minimum], ["max", kind.maximum]]) if (bound !== undefined && Math.abs(bound) < 1e6) box[name] = bound;
    box.oninput = () => (box.value === "" && !box.validity.badInput ? (complain(box, ""), changed(undefined)) : isNumber(box) && changed(box.valueAsNumber));
    return box;
  }
  const names = kinds.flatMap((one) => one.enum ?? []);
  const list = names.length ? h("datalist", { id: fresh("values") }, names.map((name) => h("option", { value: name }))) : null;
  const box = h("input", { type: "text", value: written(value), placeholder: written(schema.default) || "a number, a list, or JSON", spellcheck: false, list: list?.id });
  box.onchange = () => {
    try {
      const next = read(box.value, kinds);
      complain(box, "");
      changed(next);
    } catch (error) {
      complain(box, error.message);
    }
  };
  return list ? h("span", { class: "control" }, box, list) : box;
}

/**
 * Return the fields of an object's properties.
 *
 * `names` picks some of them; `at` is the object's JSON pointer; `changed(next)` gets the whole object without what is at
 * its default; properties that are themselves one of several kinds of objects get a choice of the kind and fields below it.
 */
export function schemaForm({ schema, defs = schema.$defs ?? {}, value = {}, at, names, changed }) {
  const form = h("div", { class: "fields" });
  let held = { ...value };
  const put = (name, one) => {
    held = { ...held };
    if (one === undefined) delete held[name];
    else held[name] = one;
    changed(held);
  };
  for (const name of names ?? Object.keys(schema.properties ?? {})) {
    const property = followed(schema.properties[name], defs);
    const kinds = choices(property, defs);
    const label = name.replaceAll("_", " ");
    const pointer = `${at}/${name}`;
    const named = kinds.filter((kind) => kind.properties?.kind);
    if (named.length > 1) form.append(kindForm({ property, kinds: named, defs, pointer, label, value: held[name], changed: (one) => put(name, one) }));
    else if (kinds.length === 1 && kinds[0].properties) form.append(h("fieldset", { "data-at": pointer }, h("legend", {}, label), schemaForm({ schema: kinds[0], defs, value: held[name] ?? {}, at: pointer, changed: (one) => put(name, Object.keys(one).length ? one : undefined) })));
    else form.append(field({ at: pointer, label, unit: property.unit, description: property.description, control: control(property, kinds, held[name], (one) => put(name, one)) }));
  }
  return form;
}

/** Return the choice between kinds of objects, told apart by `kind`, and the fields of the one that is chosen. */
function kindForm({ property, kinds, defs, pointer, label, value, changed }) {
  const idOf = (kind) => kind.properties.kind.const ?? kind.properties.kind.enum?.[0];
  const place = h("div", {});
  const show = (chosen, held) => {
    place.replaceChildren();
    const kind = kinds.find((one) => idOf(one) === chosen);
    if (!kind) return;
    const names = Object.keys(kind.properties).filter((name) => name !== "kind");
    place.append(schemaForm({ schema: kind, defs, value: held, at: pointer, names, changed: (one) => changed({ kind: chosen, ...one }) }));
  };
  const own = value?.kind ?? "";
  const other = value && !own; // one without a kind: it stays as it is
  const select = h("select", { onchange: () => (show(select.value, {}), changed(select.value ? { kind: select.value } : undefined)) });
  select.append(h("option", { value: "" }, other ? "as given: see the JSON" : "default"), ...kinds.map((kind) => h("option", { value: idOf(kind), selected: idOf(kind) === own }, idOf(kind).replaceAll("_", " "))));
  const { kind: _, ...rest } = value ?? {};
  show(own, rest);
  return h("fieldset", { "data-at": pointer }, h("legend", {}, label), field({ at: `${pointer}/kind`, label: "kind", description: property.description, control: select }), place);
}

/** Return whether a box holds a whole number's text; tell it where not. */
export function isNumber(box) {
  const fine = Number.isFinite(box.valueAsNumber);
  complain(box, fine ? "" : "this is no number");
  return fine;
}

/** Put a reason at the end of a row; `box`, the control or group that it is about, names it as its description and error. */
function tell(row, box, text, kind, ...more) {
  const node = h("p", { class: kind, id: fresh("wrong") }, text, ...more);
  row.append(node);
  if (!box) return;
  box.setAttribute("aria-describedby", [box.getAttribute("aria-describedby"), node.id].filter(Boolean).join(" "));
  if (box.matches("[aria-invalid]")) box.setAttribute("aria-errormessage", node.id);
}

/** Take a reason away, and the names that point at it. */
function untell(node) {
  for (const box of document.querySelectorAll(`[aria-describedby~="${node.id}"]`)) {
    const rest = box.getAttribute("aria-describedby").split(" ").filter((one) => one !== node.id);
    if (rest.length) box.setAttribute("aria-describedby", rest.join(" "));
    else box.removeAttribute("aria-describedby");
    if (box.getAttribute("aria-errormessage") === node.id) box.removeAttribute("aria-errormessage");
  }
  node.remove();
}

/** Mark a control whose text cannot be read, with the reason below it; an empty reason takes the mark away. */
export function complain(box, reason) {
  const row = box.closest("[data-at]");
  row.querySelectorAll(".wrong.local").forEach(untell);
  if (reason) box.dataset.local = "";
  else delete box.dataset.local;
  if (reason) box.setAttribute("aria-invalid", "true");
  else box.removeAttribute("aria-invalid");
  if (reason) tell(row, box, reason, "wrong local");
}

/** Mark the fields that a problem names, each with its reason; `whole` gets the reasons of those that are not there. */
export function markErrors(root, errors) {
  root.querySelectorAll(".wrong:not(.local)").forEach(untell);
  for (const old of root.querySelectorAll("[aria-invalid]:not([data-local])")) old.removeAttribute("aria-invalid");
  const left = [];
  for (const { field: pointer, reason, action } of errors) {
    let row = null;
    for (let path = pointer; path && !row; path = path.slice(0, path.lastIndexOf("/"))) row = root.querySelector(`[data-at="${CSS.escape(path)}"]`);
    if (!row) {
      left.push({ field: pointer, reason });
      continue;
    }
    for (let box = row.closest("details"); box; box = box.parentElement.closest("details")) box.open = true;
    const [box] = row.dataset.at === pointer || row.matches(".field, td") ? row.querySelectorAll("input, select, textarea") : [];
    box?.setAttribute("aria-invalid", "true"); // a group of fields is not wrong as a whole
    tell(row, box ?? (row.matches("fieldset") ? row : null), reason, "wrong", action ? button(action.label, action.run, { class: "fix" }) : "");
  }
  return left;
}
