// Every metric of a report: input, refined, floor, and what the gates ask of it.

import { boundWords } from "meshcone/bounds";
import { embedded, h } from "meshcone/dom";
import { number } from "meshcone/format";
import { chip } from "meshcone/job-words";

const BETTER_IF_LARGER = new Set(["normal_consistency", "surface_normal_consistency", "fscore", "validity.watertight", "appearance.color_difference.psnr"]);
const NEITHER = new Set(["validity.components"]);
const GROUPS = [
  ["Proven deviation", /^deviation/],
  ["Distances", /^(point_to_surface|chamfer|chamfer_l1|hausdorff|hausdorff95|emd|fscore)(\.|$)/],
  ["Normals and curvature", /^(normal_|surface_normal|curvature)/],
  ["Colours", /^appearance/],
  ["Faces", /^aspect_ratio/],
  ["Validity", /^validity/],
];
const POWERS = { radius: 1, "radius²": 2, "1/radius": -1 };

/** Every number, yes or no of a metric set, by its dotted name; places are left out. */
function leaves(metrics, prefix = "") {
  return Object.entries(metrics ?? {}).flatMap(([name, value]) => {
    if (Array.isArray(value)) return [];
    return value !== null && typeof value === "object" ? leaves(value, `${prefix}${name}.`) : [[prefix + name, value]];
  });
}

/** The colour differences of one mesh under the names gates use; that they are not tested is one row. */
function colours(compared) {
  const name = "appearance.color_difference";
  if (compared === undefined) return [];
  return compared === "not_tested" ? [[name, "not tested"]] : leaves(compared, `${name}.`);
}

/** The proven intervals, under the names gates use. */
function intervals(deviation) {
  return ["max", "extra", "missing"].filter((name) => deviation?.[name]).map((name) => [`deviation.${name}`, deviation[name]]);
}

function bars(before, after) {
  if (typeof before !== "number" || typeof after !== "number") return null;
  const top = Math.max(Math.abs(before), Math.abs(after));
  if (top === 0) return null;
  const bar = (kind, value) => h("span", { class: kind, style: { width: `${(100 * Math.abs(value)) / top}%` } });
  return [bar("before", before), bar("after", after)];
}

function tendency(name, before, after) {
  if (typeof before === "boolean" || before === undefined || after === undefined || after === null || before === null || NEITHER.has(name) || before === after) return "";
  return (after > before) === BETTER_IF_LARGER.has(name) ? "better" : "worse";
}

function gateCell(report, checks) {
  return checks.map((check) => h("div", { title: check.words }, chip(check.status), " ",
    h("span", { class: "soft" }, boundWords(report, check).replaceAll("_", " "))));
}

const title = (text) => text[0].toUpperCase() + text.slice(1).replace(/, in degrees$/, "");

/** The table, and a switch between relative and model units. */
export function metricsTable(report) {
  const { quality, frame } = report;
  const names = embedded("words");
  const looks = report.appearance ?? {};
  const proven = intervals(report.deviation);
  const refined = quality.refined ? Object.fromEntries([...proven, ...leaves(quality.refined), ...colours(looks.color_difference)]) : null;
  const floor = Object.fromEntries([...leaves(quality.floor), ...colours(looks.floor)]);
  const judged = refined ? proven.map(([name]) => [name, undefined]) : proven;
  const input = [...judged, ...leaves(quality.input), ...colours(looks.input)];
  const checks = report.gates?.checks ?? [];
  const body = h("tbody");
  const convention = (name) => quality.conventions.metrics[name.replace(/^appearance\./, "").split(".")[0]];
  const unitOf = (name) => (name.endsWith(".psnr") ? "dB" : (convention(name)?.unit ?? "1"));

  const shown = (name, value, model) => {
    if (value?.upper !== undefined) return `${number(value.lower * (model ? frame.radius : 1))} to ${number(value.upper * (model ? frame.radius : 1))}`;
    const power = POWERS[unitOf(name)];
    if (typeof value === "number" && power && model && !name.endsWith("share_over_4")) return number(value * frame.radius ** power);
    return value === null || value === undefined ? "–" : number(value);
  };
  const unit = (name, model) => {
    const text = unitOf(name);
    if (text === "1" || text === "count") return "";
    if (!(text in POWERS)) return text;
    return model ? text.replace("radius", "unit") : text;
  };

  function fill(model) {
    body.replaceChildren(...GROUPS.flatMap(([group, pattern]) => {
      const rows = input.filter(([name]) => pattern.test(name)).map(([name, before]) => {
        const after = refined?.[name];
        const definition = convention(name)?.definition;
        return h("tr", { "data-metric": name },
          h("th", { scope: "row", title: definition }, title(names[name] ?? name), " ", h("span", { class: "soft" }, unit(name, model))),
          h("td", { class: "number" }, shown(name, before, model)),
          refined && h("td", { class: `number ${tendency(name, before, after)}` }, shown(name, after, model)),
          h("td", { class: "number soft" }, shown(name, floor[name], model)),
          refined && h("td", { class: "bars" }, bars(before, after)),
          h("td", null, gateCell(report, checks.filter((check) => check.key === name))));
      });
      return rows.length ? [h("tr", { class: "group" }, h("th", { colspan: "6", scope: "rowgroup" }, group)), ...rows] : [];
    }));
  }

  const units = h("select", { "aria-label": "Unit of distances", onchange: () => fill(units.value === "model"), style: { width: "auto" } },
    h("option", { value: "model" }, "in model units"), h("option", { value: "relative" }, "relative to the radius"));
  fill(true);
  return h("section", { class: "card", "aria-labelledby": "metrics-title" },
    h("div", { class: "row heading" }, h("h2", { id: "metrics-title", class: "grow" }, "Metrics"), units),
    h("div", { class: "scroll", tabindex: "0", role: "region", "aria-labelledby": "metrics-title" }, h("table", null,
      h("thead", null, h("tr", null, h("th", { scope: "col" }, "Metric"), h("th", { scope: "col", class: "number" }, "Input"), refined && h("th", { scope: "col", class: "number" }, "Refined"), h("th", { scope: "col", class: "number" }, "Floor"), refined && h("th", { scope: "col" }, "Input / refined"), h("th", { scope: "col" }, "Gate"))),
      body)),
    h("p", { class: "hint" }, quality.conventions.floor));
}
