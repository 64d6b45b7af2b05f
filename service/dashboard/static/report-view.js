// Everything a report says, the same on a job's page and in a report.html.

import { assetCard, changesCard } from "meshcone/audit-cards";
import { directionsCard } from "meshcone/directions";
import { h } from "meshcone/dom";
import { number, seconds } from "meshcone/format";
import { gatesPanel } from "meshcone/gates-panel";
import { unitOf } from "meshcone/job-words";
import { metricsTable } from "meshcone/metrics-table";
import { solverPanel } from "meshcone/solver-panel";
import { tabs } from "meshcone/tabs";
import { verdictCard } from "meshcone/verdict-card";
import { ViewerCard } from "meshcone/viewer-card";

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
      report.frame && [h("dt", null, "Radius"), h("dd", null, `${number(report.frame.radius, 6)} ${unitOf(report)}`)],
      h("dt", null, "Time"), h("dd", null, `${seconds(report.timings.total)}: ${stages.map((name) => `${name} ${seconds(report.timings[name])}`).join(", ")}`),
      h("dt", null, "MeshCone"), h("dd", null, report.version)));
}

function badge(count, kind = "") {
  return count > 0 ? h("span", { class: `badge ${kind}` }, String(count)) : null;
}

/**
 * The sections of a report, in the order of the questions: does it pass, where and why not, what
 * changed, by how much, can it be trusted, what was done.
 * @param {Object} report
 * @param {{heading: Node, files: Object, loadPreview: ?Function, loadWhole: ?Function, loadPictures: ?Function, more: Node[]}} around
 *   `more` are cards about the files
 */
export function reportSections(report, { heading, files, loadPreview, loadWhole, loadPictures, more = [] }) {
  const viewer = loadPreview ? new ViewerCard(report, loadPreview, loadWhole) : null;
  const goTo = viewer && ((position) => viewer.goTo(position));
  const failed = (report.gates?.checks ?? []).filter(({ status }) => status === "fail").length;
  const panels = tabs("What the report says", [
    { id: "gates", title: "Gates", badge: badge(failed, "bad"), content: gatesPanel(report, goTo) },
    { id: "changes", title: "Changes", badge: badge(report.changes?.rows.length), content: [report.changes && changesCard(report.changes), report.quality && directionsCard(report, viewer && ((part) => viewer.isolate(part))), loadPictures && picturesCard(report, loadPictures)] },
    { id: "metrics", title: "Metrics", content: [report.quality && metricsTable(report)] },
    { id: "audit", title: "Audit", content: [report.asset && assetCard(report.asset)] },
    { id: "solver", title: "Solver", content: report.solver ? solverPanel(report, files) : [] },
    { id: "files", title: "Files", content: [...more, inputsCard(report)] },
  ]);
  const verdict = verdictCard(report, { goTo, openGates: () => panels.open("gates") });
  if (viewer) {
    const toPlaces = [verdict, panels.element].flatMap((part) => [...part.querySelectorAll(".to-place")]);
    viewer.onAble = (isAble) => { for (const button of toPlaces) button.disabled = !isAble; };
    viewer.start();
  }
  return [...(viewer ? [h("div", { class: "first-screen" }, heading, verdict, viewer.element)] : [heading, verdict]), panels.element];
}
