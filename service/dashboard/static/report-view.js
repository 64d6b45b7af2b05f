// Everything a report says, the same on a job's page and in a report.html.

import { directionsCard } from "meshcone/directions";
import { h } from "meshcone/dom";
import { auditCards } from "meshcone/audit-cards";
import { number, seconds } from "meshcone/format";
import { chip, outcomeSentence, verdictSentence, withinSentence } from "meshcone/job-words";
import { metricsTable } from "meshcone/metrics-table";
import { solverPanel } from "meshcone/solver-panel";
import { ViewerCard } from "meshcone/viewer-card";

const ORDER = { fail: 0, not_tested: 1, pass: 2 };

/** The verdict in words: of the gates if there are any, and what became of the mesh. */
export function verdictCard(report) {
  const { gates } = report;
  const checks = [...(gates?.checks ?? [])].sort((a, b) => ORDER[a.status] - ORDER[b.status]);
  return h("section", { class: `card verdict ${gates?.verdict ?? report.outcome ?? ""}`, "aria-label": "Verdict", "data-testid": "verdict" },
    gates && h("p", { class: "headline" }, verdictSentence(gates)),
    report.statement && h("p", { class: gates ? "" : "headline", "data-testid": "statement" }, `${report.statement[0].toUpperCase()}${report.statement.slice(1)}.`),
    h("p", { class: gates || report.statement ? "" : "headline" }, outcomeSentence(report)),
    report.within && h("p", { "data-testid": "within" }, withinSentence(report.within)),
    !gates && h("p", { class: "soft" }, verdictSentence(null)),
    checks.length > 0 && h("ul", null, checks.map((check) => h("li", null, chip(check.status), h("span", null, check.words, check.severity === "warning" ? " (a warning)" : "")))));
}

function warnings(report) {
  if (!report.warnings.length) return null;
  return h("section", { class: "card", "aria-labelledby": "warnings-title" }, h("h2", { id: "warnings-title" }, "Warnings"), h("ul", null, report.warnings.map((warning) => h("li", null, warning.code && h("code", null, warning.code), warning.code && " ", warning.words ?? warning))));
}

/** What loadPictures gives the address of: every surface from six sides, in its own colours. */
function picturesCard(report, loadPictures) {
  const shown = report.quality.refined ? "Source, refined mesh and reference" : "Source and reference";
  const place = h("div", { class: "scroll", tabindex: "0", role: "region", "aria-labelledby": "pictures-title" }, h("p", { class: "loading" }, "Loading the pictures …"));
  loadPictures().then(
    (address) => place.replaceChildren(h("img", { src: address, alt: `${shown}, each from front, back, right, left, top and bottom`, "data-testid": "pictures" })),
    () => place.replaceChildren(h("p", { class: "notice error" }, "The pictures cannot be had.")));
  return h("section", { class: "card", "aria-labelledby": "pictures-title" }, h("h2", { id: "pictures-title" }, "From six sides"), place);
}

function inputsCard(report) {
  const facts = (record) => [record.format.toUpperCase(), `${number(record.faces)} triangles`, `${number(record.welded_vertices)} vertices`, record.validity.watertight ? "watertight" : `${number(record.validity.boundary_edges)} open edges`].join(", ");
  const stages = ["read", "align", "solve", "quality", "write", "audit"].filter((name) => report.timings[name] > 0.0005);
  return h("section", { class: "card", "aria-labelledby": "inputs-title" },
    h("h2", { id: "inputs-title" }, "Files and times"),
    h("dl", { class: "facts" },
      h("dt", null, "Source"), h("dd", null, `${report.inputs.source.name}: ${facts(report.inputs.source)}`),
      report.inputs.reference && [h("dt", null, "Reference"), h("dd", null, `${report.inputs.reference.name}: ${facts(report.inputs.reference)}`)],
      report.frame && [h("dt", null, "Radius"), h("dd", null, `${number(report.frame.radius, 6)} model units`)],
      h("dt", null, "Time"), h("dd", null, `${seconds(report.timings.total)}: ${stages.map((name) => `${name} ${seconds(report.timings[name])}`).join(", ")}`),
      h("dt", null, "MeshCone"), h("dd", null, report.version)));
}

/**
 * The sections of a report.
 * @param {Object} report
 * @param {{files: Object, loadPreview: ?Function, loadWhole: ?Function, loadPictures: ?Function}} around
 */
export function reportSections(report, { files, loadPreview, loadWhole, loadPictures }) {
  const viewer = loadPreview ? new ViewerCard(report, loadPreview, loadWhole) : null;
  viewer?.start();
  return [
    verdictCard(report),
    viewer?.element,
    loadPictures && picturesCard(report, loadPictures),
    report.quality && metricsTable(report),
    report.quality && directionsCard(report),
    ...auditCards(report),
    ...(report.solver ? solverPanel(report, files) : []),
    warnings(report),
    inputsCard(report),
  ];
}
