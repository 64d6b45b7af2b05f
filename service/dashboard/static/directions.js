// What a mesh lacks of its reference and what it has besides: of all of it, and of each part.

import { h, svg } from "meshcone/dom";
import { number } from "meshcone/format";
import { chip } from "meshcone/job-words";

const SIDES = [["missing", "Missing"], ["extra", "Extra"]];
const percent = (share) => (share === null || share === undefined ? "–" : `${number(100 * share)} %`);

/** Two rows of bars, the reference's above and the mesh's below, by distance. */
function histogram({ missing, extra, upper }, radius) {
  const top = Math.max(...missing, ...extra, 1e-12);
  // Most of the area is near: a root keeps the rest in sight.
  const bars = (shares, kind) => shares.map((share, bin) => {
    const height = 20 * Math.sqrt(share / top);
    return svg("rect", { class: kind, x: bin, y: kind === "missing" ? 20 - height : 21, width: 0.9, height });
  });
  return svg("svg", { class: "histogram", viewBox: "0 0 64 41", preserveAspectRatio: "none", role: "img", "aria-label": `Shares of the area by distance, from 0 to ${number(upper * radius)}: missing above, extra below` },
    bars(missing, "missing"), bars(extra, "extra"));
}

function cells(directed, radius) {
  const values = directed ? [directed.mean, directed.p95, directed.max].map((value) => number(value * radius)) : ["–", "–", "–"];
  return [...values, percent(directed?.beyond_percent)].map((text) => h("td", { class: "number" }, text));
}

const heading = (text) => h("th", { scope: "col", class: "number" }, text);

function wholeTable({ missing, extra, signed }, radius) {
  const bounded = missing.beyond_bound !== null;
  const row = (title, directed) => h("tr", null, h("th", { scope: "row" }, title), cells(directed, radius),
    h("td", { class: "number" }, percent(directed.beyond_permille)), bounded && h("td", { class: "number" }, percent(directed.beyond_bound)));
  return [
    h("div", { class: "scroll", tabindex: "0", role: "region", "aria-labelledby": "directions-title" }, h("table", null,
      h("thead", null, h("tr", null, h("th", { scope: "col" }, "Direction"), heading("Mean"), heading("95 %"), heading("Largest"), heading("Beyond 1 %"), heading("Beyond .1 %"), bounded && heading("Beyond the bound"))),
      h("tbody", null, row("Missing: reference to mesh", missing), row("Extra: mesh to reference", extra)))),
    signed && h("p", null, `Signed, negative inside the reference: mean ${number(signed.mean * radius)}, 5 % below ${number(signed.p5 * radius)}, 5 % above ${number(signed.p95 * radius)}.`),
  ];
}

function partsTable(per, radius, isolate) {
  const buttons = per.parts.map((part) => isolate && h("button", {
    type: "button", class: "small to-place", "aria-pressed": "false", "aria-label": `Show ${part.name || "the part without a name"} alone`,
    onclick: (event) => {
      const alone = event.currentTarget.getAttribute("aria-pressed") !== "true";
      for (const button of buttons) button.setAttribute("aria-pressed", String(alone && button === event.currentTarget));
      isolate(alone ? part.name : null);
    },
  }, "Alone"));
  const row = (part, index) => h("tr", { "data-part": part.name },
    h("th", { scope: "row" }, part.name || "(no name)", " ", buttons[index]),
    h("td", null, part.found !== "both" && chip("fail", part.found)),
    SIDES.map(([side]) => cells(part[side], radius)),
    h("td", null, histogram(part.histogram, radius)));
  const left = per.count - per.parts.length;
  return [
    h("h3", { id: "parts-title" }, `By ${per.by}`),
    h("div", { class: "scroll", tabindex: "0", role: "region", "aria-labelledby": "parts-title" }, h("table", null,
      h("thead", null, h("tr", null, h("th", { scope: "col" }, "Part"), h("th", { scope: "col" }, "Found"),
        SIDES.map(([, title]) => ["mean", "95 %", "largest", "beyond 1 %"].map((name) => heading(`${title} ${name}`))), h("th", { scope: "col" }, "Distances"))),
      h("tbody", null, per.parts.map(row)))),
    left > 0 && h("p", { class: "hint" }, `${number(left)} parts that are no worse are left out.`),
  ];
}

/** The card, whose parts can be shown alone by `isolate`; none for a report that does not tell the directions apart. */
export function directionsCard(report, isolate) {
  const { directions, per } = report.quality;
  if (!directions) return null;
  const { radius } = report.frame;
  return h("section", { class: "card", "aria-labelledby": "directions-title", "data-testid": "directions" },
    h("h2", { id: "directions-title" }, "Missing and extra"),
    wholeTable(directions, radius),
    histogram(directions.histogram, radius),
    h("p", { class: "hint" }, "Distances are in model units; shares are of the area, and the bounds of the radius."),
    per && partsTable(per, radius, isolate));
}
