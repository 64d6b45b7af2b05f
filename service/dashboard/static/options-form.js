// The options as a form, made from their schema: nothing here knows any of them by name.

import { getJson } from "meshcone/api";
import { h } from "meshcone/dom";

const LENGTH = ["relative", "model"];  // a schema with exactly these is a length in either unit

class Schema {
  constructor(document) { this.schemas = document.components.schemas; }

  resolve(schema) {
    if (!schema.$ref) return schema;
    const { $ref, ...beside } = schema;
    return { ...this.schemas[$ref.split("/").at(-1)], ...beside };
  }

  /** The one alternative that is not null, and whether null is another. */
  present(schema) {
    const resolved = this.resolve(schema);
    const alternatives = (resolved.anyOf ?? []).map((each) => this.resolve(each));
    const others = alternatives.filter((each) => each.type !== "null");
    if (others.length !== 1) return { schema: resolved, optional: false };
    const { anyOf, ...beside } = resolved;
    return { schema: { ...others[0], ...beside }, optional: others.length < alternatives.length };
  }
}

const isLength = (schema) => schema.type === "object" && schema.properties && Object.keys(schema.properties).join() === LENGTH.join();

/** Whether a value of this kind is one word, or none. */
const isWord = ({ type }) => ["string", "integer", "null"].includes(type);

const same = (a, b) => JSON.stringify(a) === JSON.stringify(b);

const written = (value) => (Array.isArray(value) ? value.join(", ") : typeof value === "object" && value !== null ? JSON.stringify(value) : String(value ?? ""));

function range(schema) {
  const low = schema.minimum ?? schema.exclusiveMinimum;
  const high = schema.maximum ?? schema.exclusiveMaximum;
  if (low === undefined && high === undefined) return "";
  if (high === undefined) return schema.exclusiveMinimum === undefined ? `at least ${low}` : `above ${low}`;
  return `${low} to ${high}`;
}

function list(text) {
  try { return JSON.parse(`[${text}]`); } catch {
    return text.split(",").map((part) => part.trim()).filter(Boolean).map((part) => (part !== "" && !Number.isNaN(Number(part)) ? Number(part) : part));
  }
}

/** An input for a value, how to read it (undefined where it is left as it is) and how to fill it in. */
function control(schema, id) {
  if (schema.enum) {
    const select = h("select", { id }, schema.enum.map((each) => h("option", { value: each, selected: each === schema.default }, each)));
    return { element: select, read: () => select.value, write: (value) => { select.value = value; } };
  }
  if (schema.type === "boolean") {
    const box = h("input", { id, type: "checkbox", checked: schema.default === true });
    return { element: box, read: () => box.checked, write: (value) => { box.checked = value; } };
  }
  if (isLength(schema)) {
    const input = h("input", { id, type: "number", step: "any", min: "0", placeholder: "not set" });
    const unit = h("select", { "aria-label": "unit" }, h("option", { value: "relative" }, "of the radius"), h("option", { value: "model" }, "model units"));
    return {
      element: h("div", { class: "pair" }, input, unit),
      read: () => (input.value === "" ? undefined : { [unit.value]: Number(input.value) }),
      write: (value) => { [[unit.value, input.value]] = Object.entries(value); },
    };
  }
  const filled = (input, read) => ({ element: input, read: () => (input.value.trim() === "" ? undefined : read(input.value.trim())), write: (value) => { input.value = written(value); } });
  if (schema.type === "number" || schema.type === "integer") {
    const input = h("input", {
      id, type: "number", step: schema.type === "integer" ? "1" : "any", placeholder: written(schema.default) || "not set",
      min: String(schema.minimum ?? schema.exclusiveMinimum ?? ""), max: String(schema.maximum ?? ""),
    });
    return filled(input, Number);
  }
  if (schema.type === "array") {
    const input = h("input", { id, placeholder: written(schema.default) || "none", autocomplete: "off" });
    return filled(input, list);
  }
  if (schema.type === "string") {
    const input = h("input", { id, type: "text", placeholder: written(schema.default) || "not set", autocomplete: "off" });
    return filled(input, String);
  }
  if (schema.anyOf?.every(isWord)) {
    const input = h("input", { id, type: "text", placeholder: written(schema.default) || "not set", autocomplete: "off" });
    return filled(input, (text) => (/^\d+$/.test(text) ? Number(text) : text));
  }
  const area = h("textarea", { id, rows: "4", spellcheck: "false", placeholder: '{"point_to_surface.p95": {"max": 0.002}}' });
  return {
    element: area,
    read: () => {
      area.setCustomValidity("");
      if (area.value.trim() === "") return undefined;
      try { return JSON.parse(area.value); } catch { area.setCustomValidity("this is no JSON"); area.reportValidity(); throw new Error("the options hold something that is no JSON"); }
    },
    write: (value) => { area.value = JSON.stringify(value, null, 1); },
  };
}

/** The value at a path of a nested document; undefined if there is none. */
const at = (document, path) => path.reduce((section, name) => section?.[name], document);

function put(document, path, value) {
  let section = document;
  for (const name of path.slice(0, -1)) section = section[name] ??= {};
  section[path.at(-1)] = value;
}

class Form {
  constructor(schema, onChange, given) {
    this.schema = schema;
    this.onChange = onChange;
    this.given = given;
    this.fields = [];
  }

  section(schema, path, title) {
    const entries = Object.entries(schema.properties).map(([name, each]) => [name, this.schema.present(each).schema]);
    const isSection = ([, each]) => each.properties && !isLength(each);
    const plain = entries.filter((entry) => !isSection(entry)).map(([name, each]) => this.field(each, [...path, name]));
    const nested = entries.filter(isSection).map(([name, each]) => this.section(each, [...path, name], name));
    const content = [h("div", { class: "options-grid" }, plain), nested];
    if (path.length === 0) return h("div", null, content);
    return h("details", { class: "section" },
      h("summary", null, title.replaceAll("_", " "), schema.description && h("span", { class: "hint" }, ` ${schema.description}`)),
      content);
  }

  field(schema, path) {
    const id = `option-${path.join("-")}`;
    const { element, read, write } = control(schema, id);
    const given = at(this.given, path);
    if (given !== undefined && given !== null) write(given);
    const limits = range(schema);
    const wrapper = h("div", { class: "field" },
      h("label", { for: id }, h("span", { class: "name" }, path.at(-1).replaceAll("_", " "))),
      element,
      h("span", { class: "help" }, [schema.description, limits].filter(Boolean).join("; ")));
    const changed = () => {
      let value;
      try { value = read(); } catch { value = "unreadable"; }
      wrapper.classList.toggle("changed", value !== undefined && !same(value, schema.default));
      this.onChange(this.fields.filter((field) => field.wrapper.classList.contains("changed")).length);
    };
    const field = { path, read, wrapper, schema, given, touched: false };
    wrapper.addEventListener("input", () => { field.touched = true; changed(); });
    this.fields.push(field);
    if (given !== undefined) changed();
    return wrapper;
  }

  /** The options that differ from their defaults, nested. */
  value() {
    const document = {};
    for (const { path, read, schema, given, touched } of this.fields) {
      // What was given and not touched stays as it is, in whatever form it came.
      const value = touched ? read() : given;
      if (value === undefined || (touched && same(value, schema.default))) continue;
      put(document, path, value);
    }
    return document;
  }
}

/** Build the form from the schema of the API's description, filled in with some options. */
export async function optionsForm(onChange, given = {}) {
  const schema = new Schema(await getJson("/openapi.json"));
  const form = new Form(schema, onChange, given);
  const root = schema.resolve({ $ref: "#/components/schemas/Options" });
  const element = form.section(root, [], "");
  // What is wrong in a closed section cannot be shown, and a form with it is not sent.
  element.addEventListener("invalid", ({ target }) => {
    for (let section = target.closest("details"); section; section = section.parentElement.closest("details")) section.open = true;
  }, true);
  return { form: element, value: () => form.value() };
}
