// A job as a row of the table: what it is, what came of it, and what is worst about it.

import { h } from "meshcone/dom";
import { age, dateTime } from "meshcone/format";
import { chip, hasEnded, outcomeWords, pairWords, projectTag, stageWords, waitWords, worstWords } from "meshcone/job-words";
import { thumbnail } from "meshcone/thumbnail";

function nameCell(job, selection, isWithin) {
  const labels = job.labels.map((label) => h("a", { class: "tag", href: `/?${new URLSearchParams({ label })}` }, label));
  const ofBatch = job.batch && !isWithin && h("a", { class: "soft", href: `/?${new URLSearchParams({ batch: job.batch })}` }, "its batch");
  const names = job.name
    ? [h("span", { class: "name" }, job.name), h("span", { class: "against" }, ` ${pairWords(job)}`)]
    : [h("span", { class: "name" }, job.source.name), job.reference && h("span", { class: "against" }, ` → ${job.reference.name}`)];
  return h("td", { class: "job-cell" }, h("div", { class: "job-line" }, selection.checkbox(job), thumbnail(job), h("div", null,
    h("a", { class: "pair", href: `/jobs/${job.id}` }, names),
    h("div", { class: "chips" }, ["measure", "audit"].includes(job.mode) && h("span", { class: "soft" }, job.mode), projectTag(job), labels, ofBatch))));
}

/** What came of it: the verdict before anything else, and the outcome beside it. */
function resultCell(job) {
  const cell = (...content) => h("td", { class: "result-cell" }, content);
  if (job.state === "running") {
    return cell(chip("running"),
      h("progress", { max: 1, value: job.progress?.fraction ?? 0, "aria-label": `progress of ${job.source.name}` }),
      h("span", { class: "hint" }, stageWords(job.progress)));
  }
  if (job.state === "queued") return cell(chip("queued"), h("span", { class: "hint" }, waitWords(job)));
  if (job.state === "failed") return cell(chip("error"));
  if (job.state === "canceled") return cell(chip("canceled"));
  const outcome = job.summary?.outcome;
  return cell(job.verdict ? chip(job.verdict) : chip("done", "no gates"),
    outcome && h("span", { class: "hint", title: `${job.source.name} is ${outcomeWords(outcome)}` }, outcome.replaceAll("_", " ")));
}

/**
 * @param {Object} job as the list tells of it
 * @param {Selection} selection that it can be chosen for
 * @param {boolean} isWithin whether it stands below its batch
 */
export function jobRow(job, selection, isWithin) {
  const words = job.error ? job.error.detail : worstWords(job);
  const ending = job.state === "failed" ? "error" : job.verdict ?? "";
  return h("tr", { "data-id": job.id, class: `${hasEnded(job) ? ending : ""}${isWithin ? " within" : ""}` },
    nameCell(job, selection, isWithin),
    resultCell(job),
    h("td", { class: "worst" }, h("span", { title: words }, words)),
    h("td", { class: "right soft age" }, h("time", { datetime: job.created, title: dateTime(job.created) }, age(job.created))));
}
