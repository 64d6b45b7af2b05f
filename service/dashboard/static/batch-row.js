// A batch as a row of the table, and what stands below it while it is open.

import { download, request, said } from "meshcone/api";
import { byId, h } from "meshcone/dom";
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

const batchTitle = (batch) => batch.name ?? `Batch of ${pairsInWords(batch)}`;

/** How many came out how, worst first; what nothing came of is left out. */
function countsInWords(batch) {
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

/** What can be done with an open batch, and the whole of its verdicts as files: a row that stays for as long as the batch. */
export class BatchTools {
  /** @param {Function} onGone is called when the batch has been deleted */
  constructor(onGone) {
    this.onGone = onGone;
    this.offered = h("span", { class: "offered" });
    this.outcome = h("span", { role: "status" });
    this.row = h("tr", { class: "within tools" }, h("td", { colspan: "4" }, h("div", { class: "batch-tools" }, this.offered, this.outcome)));
    this.kind = null;
  }

  /** The row, with what fits the batch as it is now; what fits it still is left alone. */
  show(batch) {
    const kind = batch.state === "finished" ? "finished" : batch.cancel_requested ? "canceling" : "running";
    if (kind !== this.kind) this.offered.replaceChildren(...this[kind](batch));
    this.kind = kind;
    return this.row;
  }

  finished(batch) {
    const { links, id } = batch;
    const files = [["result", "json", "Verdicts"], ["junit", "xml", "JUnit"], ["sarif", "sarif.json", "SARIF"], ["markdown", "md", "Markdown"]];
    const question = `Delete the batch with ${pairsInWords(batch)} and all of their files?`;
    return [
      ...files.map(([kind, suffix, title]) => download(links[kind], `${id}.${suffix}`, title)),
      this.button(batch, "Delete batch", () => request(links.self, { method: "DELETE" }).then(this.onGone), question),
    ];
  }

  canceling() {
    return [h("span", { class: "hint" }, "Canceling")];
  }

  running(batch) {
    return [this.button(batch, "Cancel batch", () => request(batch.links.cancel, { method: "POST" }))];
  }

  button(batch, name, act, question) {
    const button = h("button", { type: "button", class: question ? "danger" : "" }, name);
    button.addEventListener("click", async () => {
      if (question && !confirm(question)) return;
      button.disabled = true;
      this.outcome.textContent = "";
      try {
        await act();
      } catch (error) {
        this.refused(said(error), `${name}, ${batchTitle(batch)}: ${said(error)}`);
        button.disabled = false;
      }
    });
    return button;
  }

  /** Tell of a refusal here, or where it is seen if the batch was closed since. */
  refused(here, elsewhere) {
    if (this.row.isConnected) this.outcome.textContent = here;
    else byId("sent").replaceChildren(h("p", { class: "notice error", role: "alert" }, elsewhere));
  }
}

/** A line below a batch that is no job. */
export const lineWithin = (...content) => h("tr", { class: "within line" }, h("td", { colspan: "4" }, content));
