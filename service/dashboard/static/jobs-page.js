// The table of jobs and batches, live.

import { getJson, said } from "meshcone/api";
import { batchRow, BatchTools, isBatch, lineWithin } from "meshcone/batch-row";
import { byId, h } from "meshcone/dom";
import { age } from "meshcone/format";
import { JobFilters } from "meshcone/job-filters";
import { jobRow } from "meshcone/job-row";
import { keepingFocus, place, refresh } from "meshcone/redraw";
import { Selection } from "meshcone/selection";
import { startSubmitting } from "meshcone/submit";
import { TableFeed } from "meshcone/table-feed";

const rows = byId("rows");
const table = new TableFeed({ onChange: (counts) => { filters.count(counts); show(); }, onState: showState });
const within = new TableFeed({ onChange: lookAtBatch, onState: () => {} });  // the jobs of the open batch
const selection = new Selection(rows, () => lookAgain());
let drawn = new Map();  // each row that is shown, by what it is of; it stays while its job does
const tools = new Map();  // of batches that have been open: what is under way with them is known once they are closed, too
let open = opened("");
let standing = "";  // what stands in place of rows, or below them

function opened(id) {
  return { id, batch: null, error: null, lines: new Map() };
}

function rowOf(entry, isWithin = false) {
  const isOpen = entry.id === open.id;
  const name = `${isWithin ? "within " : ""}${entry.id}`;
  const known = drawn.get(name);
  if (known?.entry === entry && known.isOpen === isOpen) return known;
  const row = isBatch(entry) ? batchRow(entry, isOpen, () => toggle(entry)) : jobRow(entry, selection, isWithin);
  if (known) refresh(known.row, row);
  return { name, entry, isOpen, row: known?.row ?? row };
}

/** The open batch: as the table has it, or as it was asked for where the table has not come to it. */
function openBatch() {
  return table.rows.find(({ id }) => id === open.id) ?? open.batch;
}

/** The table tells of its batches by itself, but not of those that are farther down. */
async function lookAtBatch() {
  const mine = open;
  if (!table.rows.some(({ id }) => id === mine.id)) mine.batch = await getJson(`/v1/batches/${mine.id}`).catch((error) => (error.status === 404 ? null : mine.batch));
  if (mine === open) show();
}

function toolsOf(batch) {
  if (!tools.has(batch.id)) tools.set(batch.id, new BatchTools(() => leave(batch)));
  return tools.get(batch.id).show(batch);
}

/** A batch has been deleted. */
function leave(batch) {
  tools.delete(batch.id);
  if (open.id === batch.id) toggle(batch);
  lookAgain([table]);
}

/** A line below the open batch: the same one for as long as it says the same. */
function line(words, content = () => h("span", { class: "hint" }, words)) {
  if (!open.lines.has(words)) open.lines.set(words, lineWithin(content()));
  return open.lines.get(words);
}

const moreWithin = () => h("button", { type: "button", class: "more-within", onclick: (event) => showMore(within, event.currentTarget) }, "Show more of this batch");

/** What stands below the open batch, each as a row or as what is drawn of a job. */
function rowsWithin(batch) {
  const before = [];
  if (open.error) before.push(line(said(open.error), () => alertOf(open.error)));
  else if (!within.hasCome) before.push(line("Loading its jobs …"));
  else if (within.rows.length === 0) before.push(line(filters.narrow ? "None of its jobs is like that" : "Its jobs are being entered"));
  const after = within.cursor === null ? [] : [line("more", moreWithin)];
  return [{ row: toolsOf(batch) }, ...before.map((row) => ({ row })), ...within.rows.map((job) => rowOf(job, true)), ...after.map((row) => ({ row }))];
}

function show() {
  const shown = openBatch();
  if (!table.hasCome && !shown) return;  // still loading
  const entries = table.rows;
  if (shown && !entries.some(({ id }) => id === shown.id)) entries.unshift(shown);
  keepingFocus(rows, () => {
    const wanted = entries.flatMap((entry) => (entry.id === open.id ? [rowOf(entry), ...rowsWithin(entry)] : [rowOf(entry)]));
    drawn = new Map(wanted.filter(({ name }) => name).map((each) => [each.name, each]));
    place(rows, wanted.map(({ row }) => row));
  });
  rows.setAttribute("aria-busy", "false");
  selection.show(entries.flatMap((entry) => (!isBatch(entry) ? [entry] : entry.id === open.id ? within.rows : [])));
  byId("jobs").hidden = entries.length === 0;
  byId("more").hidden = table.cursor === null;
  if (!entries.length) stand(filters.narrow ? "none like that" : "none yet", filters.narrow ? noneLikeThat : noneYet);
  else if (standing !== "refused") stand("");
}

/** Have this stand in place of rows or below them; what stands there already is left alone. */
function stand(kind, content) {
  if (kind === standing) return;
  standing = kind;
  byId("jobs-state").replaceChildren(...(content ? [content()] : []));
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
  stand("");
  drawn = new Map();
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
    stand("interrupted", () => alertOf(error, " ", h("button", { type: "button", onclick: start }, "Try again")));
  }
}

/** Show the jobs of the batch that the link names, those that did not pass first. */
async function follow() {
  const { batch } = filters.wanted;
  within.stop();
  open = opened(batch);
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

/** Look at the rows that are not told of, after something was done with jobs. */
async function lookAgain(feeds = [table, within]) {
  // What cannot be read now is looked at once more when the clock comes round.
  await Promise.all(feeds.map((feed) => feed.lookAgain().catch(() => {})));
  show();
}

async function showMore(feed, button) {
  button.disabled = true;
  stand("");
  try {
    await feed.showMore();
    show();
  } catch (error) {
    stand("refused", () => alertOf(error));
  } finally {
    button.disabled = false;
  }
}

const submitting = startSubmitting();
const filters = new JobFilters(start);
byId("more").addEventListener("click", () => showMore(table, byId("more")));
let looking = null;
setInterval(() => {
  for (const time of rows.querySelectorAll("time")) time.textContent = age(time.dateTime);
  const behind = [table, within].filter((feed) => feed.isBehind);
  if (behind.length && !looking) looking = lookAgain(behind).finally(() => { looking = null; });
}, 10000);
start();
