// The table of jobs and batches, live.

import { getJson, said } from "meshcone/api";
import { batchRow, batchTitle, batchTools, isBatch, lineWithin } from "meshcone/batch-row";
import { byId, h } from "meshcone/dom";
import { age } from "meshcone/format";
import { JobFilters } from "meshcone/job-filters";
import { jobRow } from "meshcone/job-row";
import { Selection } from "meshcone/selection";
import { startSubmitting } from "meshcone/submit";
import { TableFeed } from "meshcone/table-feed";

const rows = byId("rows");
const table = new TableFeed({ onChange: (counts) => { filters.count(counts); show(); }, onState: showState });
const within = new TableFeed({ onChange: lookAtBatch, onState: () => {} });  // the jobs of the open batch
const selection = new Selection(rows, lookAgain);
const drawn = new WeakMap();  // what has not changed keeps its row
let open = { id: "", batch: null, error: null };

function rowOf(entry, isWithin = false) {
  const isOpen = entry.id === open.id;
  if (drawn.get(entry)?.isOpen !== isOpen) drawn.set(entry, { isOpen, row: isBatch(entry) ? batchRow(entry, isOpen, () => toggle(entry)) : jobRow(entry, selection, isWithin) });
  return drawn.get(entry).row;
}

/** The open batch: as the table has it, or as it was asked for where the table has not come to it. */
function openBatch() {
  return table.rows.find(({ id }) => id === open.id) ?? open.batch;
}

/** The table tells of its batches by itself, but not of those that are farther down. */
async function lookAtBatch() {
  const mine = open;
  if (!table.rows.some(({ id }) => id === mine.id)) mine.batch = await getJson(`/v1/batches/${mine.id}`).catch(() => null);
  if (mine === open) show();
}

function toolsOf(batch) {
  if (!drawn.get(batch).tools) drawn.get(batch).tools = batchTools(batch, () => toggle(batch));
  return drawn.get(batch).tools;
}

function rowsWithin(batch) {
  const lines = [];
  if (open.error) lines.push(alertOf(open.error));
  else if (!within.hasCome) lines.push(h("span", { class: "hint" }, "Loading its jobs …"));
  else if (within.rows.length === 0) lines.push(h("span", { class: "hint" }, filters.narrow ? "None of its jobs is like that" : "Its jobs are being entered"));
  const more = within.cursor !== null && h("button", { type: "button", class: "more-within", onclick: (event) => showMore(within, event.currentTarget) }, "Show more of this batch");
  return [
    toolsOf(batch),
    ...lines.map((line) => lineWithin(line)),
    ...within.rows.map((job) => rowOf(job, true)),
    ...(more ? [lineWithin(more)] : []),
  ];
}

/** What has the focus, as a way to find it again among other rows. */
function focusedPlace() {
  const focused = rows.contains(document.activeElement) ? document.activeElement : null;
  const { id, batch } = focused?.closest("tr")?.dataset ?? {};
  if (batch) return `tr[data-batch="${batch}"] .toggle`;
  if (id) return `tr[data-id="${id}"] ${focused.matches(".choose") ? ".choose" : ".pair"}`;
  return focused?.matches(".more-within") ? ".more-within" : null;
}

function show() {
  const shown = openBatch();
  const entries = table.rows;
  if (shown && !entries.some(({ id }) => id === shown.id)) entries.unshift(shown);
  const wanted = entries.flatMap((entry) => (entry.id === open.id ? [rowOf(entry), ...rowsWithin(entry)] : [rowOf(entry)]));
  if (wanted.length !== rows.children.length || wanted.some((row, index) => row !== rows.children[index])) {
    const place = focusedPlace();
    rows.replaceChildren(...wanted);
    if (place) rows.querySelector(place)?.focus();
  }
  rows.setAttribute("aria-busy", "false");
  selection.show(entries.flatMap((entry) => (!isBatch(entry) ? [entry] : entry.id === open.id ? within.rows : [])));
  byId("jobs").hidden = entries.length === 0;
  byId("more").hidden = table.cursor === null;
  byId("jobs-state").replaceChildren(...(entries.length ? [] : [filters.narrow ? noneLikeThat() : noneYet()]));
}

const noneLikeThat = () => h("div", { class: "empty" },
  h("strong", null, "No job is like that"),
  h("p", null, h("a", { href: "/" }, "Show all jobs")));

const noneYet = () => h("div", { class: "empty first" },
  h("strong", null, "No jobs yet"),
  h("p", null, "Drop a mesh and its reference anywhere on this page, or one mesh to audit it alone."),
  h("p", { class: "actions centred" },
    h("button", { type: "button", class: "primary", onclick: submitting.open }, "Choose files"),
    h("button", { type: "button", onclick: submitting.fillInSample }, "Try it with a sample")),
  h("p", { class: "hint" }, "From a shell: ", h("code", null, `meshcone submit --server ${location.origin} SOURCE REFERENCE`)));

function showLoading() {
  byId("jobs").hidden = false;
  byId("jobs-state").replaceChildren();
  rows.setAttribute("aria-busy", "true");
  rows.replaceChildren(...[70, 55, 62].map((width) => h("tr", { class: "skeleton" },
    ...[width, 40, width, 30].map((share) => h("td", null, h("span", { style: { width: `${share}%` } }))))));
}

function showState(state) {
  const live = byId("live");
  live.className = `live ${state === "live" ? "on" : "off"}`;
  live.textContent = state === "live" ? "live" : "interrupted, trying again";
}

const alertOf = (error, ...more) => h("p", { class: "notice error", role: "alert" }, said(error), ...more);

async function start() {
  showLoading();
  follow();
  try {
    await table.start(filters.query());
  } catch (error) {
    showState("interrupted");
    rows.replaceChildren();
    byId("jobs-state").replaceChildren(alertOf(error, " ", h("button", { type: "button", onclick: start }, "Try again")));
  }
}

/** Show the jobs of the batch that the link names, those that did not pass first. */
async function follow() {
  const { batch } = filters.wanted;
  within.stop();
  open = { id: batch, batch: null, error: null };
  const mine = open;
  if (!batch) return;
  try {
    const query = filters.query();
    query.set("batch", batch);
    query.set("order", "failures");
    await within.start(query);
  } catch (error) {
    mine.error = error;
    if (mine !== open) return;
    if (error.status === 404) byId("sent").replaceChildren(alertOf(error));
    show();
  }
}

function toggle(batch) {
  filters.open(open.id === batch.id ? "" : batch.id);
  follow();
  show();
}

async function lookAgain(ids) {
  await Promise.all([table.lookAgain(ids), within.lookAgain(ids)]);
  show();
}

async function showMore(feed, button) {
  button.disabled = true;
  try {
    await feed.showMore();
    show();
  } catch (error) {
    byId("jobs-state").replaceChildren(alertOf(error));
  } finally {
    button.disabled = false;
  }
}

const submitting = startSubmitting();
const filters = new JobFilters(start);
byId("more").addEventListener("click", () => showMore(table, byId("more")));
setInterval(() => {
  for (const time of rows.querySelectorAll("time")) time.textContent = age(time.dateTime);
}, 10000);
start();
