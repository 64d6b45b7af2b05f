// A batch as a row of the table, and what stands below it while it is open.

import { download, request, said } from "meshcone/api";
import { h } from "meshcone/dom";
import { age, dateTime } from "meshcone/format";
import { chip, projectTag } from "meshcone/job-words";

const COUNTED = [
  ["failed", "error", ({ counts }) => counts.failed],
  ["fail", "fail", ({ verdicts }) => verdicts.fail],
  ["not_tested", "not tested", ({ verdicts }) => verdicts.not_tested],
  ["canceled", "canceled", ({ counts }) => counts.canceled],
  ["pass", "pass", ({ verdicts }) => verdicts.pass],
  ["ungated", "without gates", ({ counts, verdicts }) => counts.succeeded - total(verdicts)],
  ["deleted", "deleted", ({ counts, pairs }) => pairs - total(counts)],
];

const total = (counts) => Object.values(counts).reduce((sum, number) => sum + number, 0);

export const isBatch = (entry) => "pairs" in entry;

const count = (number) => number.toLocaleString("en");

const pairsInWords = ({ pairs }) => `${count(pairs)} ${pairs === 1 ? "pair" : "pairs"}`;

export const batchTitle = (batch) => batch.name ?? `Batch of ${pairsInWords(batch)}`;

/** How many came out how, worst first; what nothing came of is left out. */
export function countsInWords(batch) {
  const parts = COUNTED.map(([, title, of]) => [of(batch), title]).filter(([number]) => number > 0);
  return parts.map(([number, title]) => `${count(number)} ${title}`).join(" · ");
}

function resultCell(batch) {
  const cell = (...content) => h("td", { class: "result-cell" }, content);
  const { succeeded, failed, canceled } = batch.counts;
  const ended = succeeded + failed + canceled;
  if (batch.state === "running") {
    return cell(chip("running"),
      h("progress", { max: batch.pairs, value: ended, "aria-label": `progress of ${batchTitle(batch)}` }),
      h("span", { class: "hint" }, `${count(ended)} of ${count(batch.pairs)} ended`));
  }
  return cell(batch.verdict ? chip(batch.verdict) : chip("done", "no gates"));
}

/**
 * @param {Object} batch as the table tells of it
 * @param {boolean} isOpen whether its jobs are shown below
 * @param {Function} onToggle
 */
export function batchRow(batch, isOpen, onToggle) {
  const words = countsInWords(batch);
  const toggle = h("button", { type: "button", class: "pair toggle", "aria-expanded": String(isOpen), onclick: onToggle },
    h("span", { class: "name" }, batchTitle(batch)), h("span", { class: "against" }, batch.name ? ` batch of ${pairsInWords(batch)}` : ""));
  const labels = batch.labels.map((label) => h("a", { class: "tag", href: `/?${new URLSearchParams({ label })}` }, label));
  return h("tr", { "data-batch": batch.id, class: `batch ${batch.verdict ?? ""}${isOpen ? " open" : ""}` },
    h("td", { class: "job-cell" }, h("div", { class: "job-line" }, h("div", null, toggle,
      (labels.length > 0 || batch.project !== "default") && h("div", { class: "chips" }, projectTag(batch), labels)))),
    resultCell(batch),
    h("td", { class: "worst" }, h("span", { title: words }, words)),
    h("td", { class: "right soft age" }, h("time", { datetime: batch.created, title: dateTime(batch.created) }, age(batch.created))));
}

/**
 * What can be done with an open batch, and the whole of its verdicts as files.
 * @param {Object} batch
 * @param {Function} onGone is called when it has been deleted
 */
export function batchTools(batch, onGone) {
  const outcome = h("span", { role: "status" });
  const act = (name, path, options, question) => h("button", {
    type: "button",
    class: question ? "danger" : "",
    onclick: async (event) => {
      if (question && !confirm(question)) return;
      const button = event.currentTarget;
      button.disabled = true;
      try {
        await request(path, options);
        if (question) onGone();
      } catch (error) {
        outcome.textContent = said(error);
        button.disabled = false;
      }
    },
  }, name);
  const { links } = batch;
  const tools = batch.state === "finished"
    ? [
      ...[["result", "json", "Verdicts"], ["junit", "xml", "JUnit"], ["sarif", "sarif.json", "SARIF"], ["markdown", "md", "Markdown"]]
        .map(([kind, suffix, title]) => download(links[kind], `${batch.id}.${suffix}`, title)),
      act("Delete batch", links.self, { method: "DELETE" }, `Delete the batch with ${pairsInWords(batch)} and all of their files?`),
    ]
    : [batch.cancel_requested ? h("span", { class: "hint" }, "Canceling") : act("Cancel batch", links.cancel, { method: "POST" })];
  return h("tr", { class: "within tools" }, h("td", { colspan: "4" }, h("div", { class: "batch-tools" }, tools, outcome)));
}

/** A line below a batch that is no job. */
export const lineWithin = (...content) => h("tr", { class: "within line" }, h("td", { colspan: "4" }, content));
