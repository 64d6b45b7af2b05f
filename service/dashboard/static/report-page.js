// A report.html: one asset, or a list of them of which one is looked at.

import { inLink } from "meshcone/address";
import { byId, embedded, h } from "meshcone/dom";
import { chip } from "meshcone/job-words";
import { reportSections } from "meshcone/report-view";
import { pathsOf } from "meshcone/sides";
import { checkWords, sortedChecks } from "meshcone/verdict-card";

const ORDER = ["error", "fail", "not_tested", "worse"];
const place = byId("report");
const assets = embedded("assets").map((asset, number) => ({ ...asset, number }));

async function unpacked(element) {
  const packed = Uint8Array.from(atob(element.textContent), (letter) => letter.charCodeAt(0));
  return new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
}

function sections(asset) {
  if (asset.report === null) {
    return [heading(asset), h("section", { class: "card verdict fail" }, h("p", { class: "headline" }, asset.error ?? "There is no report."))];
  }
  const { inputs, output } = asset.report;
  const names = ({ name, resources }) => [name, ...Object.keys(resources ?? {})];
  const paths = pathsOf({ source: names(inputs.source), reference: inputs.reference ? names(inputs.reference) : [] });
  const files = { report: asset.reportName ?? "REPORT", source: paths.source(inputs.source.name), reference: inputs.reference && paths.reference(inputs.reference.name), refined: asset.refined ?? output?.name, apart: paths.apart };
  const packed = byId(`preview-${asset.number}`);
  const without = asset.leftOut && h("p", { class: "notice" }, "The meshes of this asset are not in this file, which holds a dozen of them at most: those that did not pass first.");
  return [without, ...reportSections(asset.report, { heading: heading(asset), files, loadPreview: packed && (() => unpacked(packed)), loadPictures: asset.pictures && (async () => asset.pictures) })].filter(Boolean);
}

const heading = (asset) => h("div", { class: "title-row" }, h("div", { class: "grow" }, h("h1", null, asset.name), h("div", { class: "chips" }, chip(asset.ending))));

function worst(asset) {
  if (asset.error) return asset.error;
  const [first] = asset.report ? sortedChecks(asset.report) : [];
  return first && first.status !== "pass" ? checkWords(first) : "";
}

function list() {
  const rank = (asset) => (ORDER.indexOf(asset.ending) + ORDER.length + 1) % (ORDER.length + 1);
  const sorted = [...assets].sort((a, b) => rank(a) - rank(b));
  const counts = Object.entries(Object.groupBy ? Object.groupBy(assets, ({ ending }) => ending) : assets.reduce((groups, asset) => ({ ...groups, [asset.ending]: [...(groups[asset.ending] ?? []), asset] }), {}));
  return [
    h("div", { class: "title-row" }, h("h1", { class: "grow" }, `${assets.length} assets`), h("div", { class: "chips" }, counts.map(([ending, which]) => chip(ending, `${which.length} ${ending.replace("_", " ")}`)))),
    h("section", { class: "card list" }, h("table", { class: "jobs" },
      h("thead", null, h("tr", null, ["Asset", "Verdict", "Finding"].map((head) => h("th", { scope: "col" }, head)))),
      h("tbody", null, sorted.map((asset) => h("tr", { class: asset.ending },
        h("td", null, h("a", { class: "pair", href: `#asset=${asset.number}` }, h("span", { class: "name" }, asset.name))),
        h("td", { class: "result-cell" }, chip(asset.ending)),
        h("td", { class: "worst" }, worst(asset))))))),
  ];
}

function show() {
  const number = Number(inLink("asset") ?? NaN);
  const asset = assets.length === 1 ? assets[0] : assets[number];
  const back = assets.length > 1 && asset ? [h("p", null, h("a", { href: "#" }, "← all assets"))] : [];
  place.replaceChildren(...back, ...(asset ? sections(asset) : list()));
  scrollTo(0, 0);
}

addEventListener("hashchange", show);
show();
