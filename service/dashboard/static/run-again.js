// The same files once more, with other options: a form that begins with the job's own.

import { request, said } from "meshcone/api";
import { h } from "meshcone/dom";
import { optionsForm } from "meshcone/options-form";

const named = ({ name, sha256 }) => ({ name, sha256 });

/** Send the files of a job once more, by their hashes, as the server has them; gives the new job. */
export async function sendAgain(job, options, labels) {
  const sides = { source: named(job.source), ...(job.reference && { reference: named(job.reference) }) };
  const beside = ["source_resources", "reference_resources", "resources"].map((name) => [name, job[name].map(named)]);
  const body = JSON.stringify({ ...sides, ...Object.fromEntries(beside), options, labels });
  return (await request("/v1/jobs", { method: "POST", headers: { "Content-Type": "application/json" }, body })).json();
}

async function fill(dialog, job) {
  const count = h("span", { class: "hint" });
  const { form, value } = await optionsForm((changed) => { count.textContent = `${changed} ${changed === 1 ? "differs" : "differ"} from the defaults`; }, job.options);
  const label = h("input", { name: "label", maxlength: "200", value: job.labels[0] ?? "", placeholder: "optional, to find and compare jobs by", autocomplete: "off" });
  const state = h("div", { role: "status" });
  const start = h("button", { type: "submit", class: "primary" }, "Start the job");
  const send = async (event) => {
    event.preventDefault();
    start.disabled = true;
    try {
      const labels = [label.value.trim(), ...job.labels.slice(1)].filter(Boolean);
      location.assign(`/jobs/${(await sendAgain(job, value(), labels)).id}`);
    } catch (error) {
      state.replaceChildren(h("p", { class: "notice error", role: "alert" }, said(error)));
      start.disabled = false;
    }
  };
  dialog.replaceChildren(h("form", { onsubmit: send },
    h("div", { class: "row heading" }, h("h2", { id: "again-title", class: "grow" }, "Run again"), h("button", { type: "button", class: "quiet", "aria-label": "Close", onclick: () => dialog.close() }, "✕")),
    h("p", { class: "hint" }, "With the files of this job, which need not be sent again."),
    h("label", null, "Label ", label),
    h("h3", null, "Options ", count), form, state,
    h("div", { class: "actions" }, h("span", { class: "grow" }), start)));
}

/** A button that opens the form; none where the files cannot be named by their hashes. */
export function runAgainButton(job) {
  const files = [job.source, job.reference, ...job.source_resources, ...job.reference_resources, ...job.resources].filter(Boolean);
  if (files.some(({ sha256 }) => !sha256)) return null;
  const dialog = h("dialog", { class: "wide", "aria-labelledby": "again-title" });
  const open = async () => {
    dialog.replaceChildren(h("h2", { id: "again-title" }, "Run again"), h("p", { class: "loading" }, "Loading the options …"));
    dialog.showModal();
    try { await fill(dialog, job); } catch (error) { dialog.replaceChildren(h("h2", { id: "again-title" }, "Run again"), h("p", { class: "notice error", role: "alert" }, said(error))); }
  };
  return [h("button", { type: "button", onclick: open }, "Run again"), dialog];
}
