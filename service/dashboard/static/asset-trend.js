// One asset of a comparison: what became of it in each run, and the values that changed most.

import { h } from "meshcone/dom";
import { dateTime } from "meshcone/format";
import { chip } from "meshcone/job-words";
import { thumbnail } from "meshcone/thumbnail";
import { trendChart } from "meshcone/trend-chart";
import { endingOf } from "meshcone/trends";

const AT_FIRST = 4;  // charts
const IN_STRIP = 24;  // runs, the newest

const ENDINGS = { fail: "fail", error: "error", pass: "pass", not_tested: "not tested", done: "no gates" };

const runChip = (job) => chip(endingOf(job), ENDINGS[endingOf(job)]);

/** A square for each run, which leads to it. */
function strip(asset) {
  return h("ol", { class: "strip", "aria-label": "Runs, oldest first" }, asset.runs.slice(-IN_STRIP).map((job) => {
    const told = `${dateTime(job.created)}: ${ENDINGS[endingOf(job)]}`;
    return h("li", null, h("a", { href: `/jobs/${job.id}`, class: `run ${endingOf(job)}`, title: told, "aria-label": told }));
  }));
}

function more(asset, metrics) {
  const charts = h("div", { class: "trends" });
  const fill = () => { if (!charts.children.length) charts.append(...metrics.map((metric) => trendChart(metric, asset))); };
  return h("details", { ontoggle: fill }, h("summary", null, `${metrics.length} more values`), charts);
}

/** @param {Asset} asset as `assetsOf` gives it */
export function assetTrend(asset) {
  const { before, last, metrics } = asset;
  const verdict = asset.brokeNow ? [runChip(before), h("span", { class: "soft", "aria-label": "then" }, " → "), runChip(last)] : runChip(last);
  return h("section", { class: `card asset is-${asset.state}`, "aria-label": asset.name },
    h("div", { class: "asset-head" },
      thumbnail(last),
      h("div", { class: "grow" },
        h("h3", null, h("a", { href: `/jobs/${last.id}` }, last.source.name), last.reference && h("span", { class: "soft" }, ` → ${last.reference.name}`)),
        h("div", { class: "chips" }, verdict, strip(asset))),
      before && h("a", { class: "button", href: `/compare?${new URLSearchParams({ jobs: `${before.id},${last.id}` })}` }, "Last two side by side")),
    metrics.length > 0 && h("div", { class: "trends" }, metrics.slice(0, AT_FIRST).map((metric) => trendChart(metric, asset))),
    metrics.length > AT_FIRST && more(asset, metrics.slice(AT_FIRST)),
    last.error && h("p", { class: "worse" }, last.error.detail));
}
