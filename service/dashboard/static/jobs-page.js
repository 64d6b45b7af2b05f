// The table of jobs, live.

import { follow, getJson, said } from "meshcone/api";
import { byId, h } from "meshcone/dom";
import { age } from "meshcone/format";
import { JobFilters } from "meshcone/job-filters";
import { jobRow } from "meshcone/job-row";
import { Selection } from "meshcone/selection";
import { startSubmitting } from "meshcone/submit";

const rows = byId("rows");
const selection = new Selection(rows, lookAgain);
const drawn = new WeakMap();  // a job that has not changed keeps its row
let jobs = [];
let older = [];
let cursor = null;
let following = null;

function rowOf(job) {
  if (!drawn.has(job)) drawn.set(job, jobRow(job, selection));
  return drawn.get(job);
}

/** Put other rows in place; what has the focus keeps it. */
function replaceRows(wanted) {
  const focused = rows.contains(document.activeElement) ? document.activeElement : null;
  const { id } = focused?.closest("tr").dataset ?? {};
  rows.replaceChildren(...wanted);
  if (id) rows.querySelector(`tr[data-id="${id}"] ${focused.matches(".choose") ? ".choose" : ".pair"}`)?.focus();
}

function show() {
  const shown = [...jobs, ...older];
  const wanted = shown.map(rowOf);
  if (wanted.length !== rows.children.length || wanted.some((row, index) => row !== rows.children[index])) replaceRows(wanted);
  rows.setAttribute("aria-busy", "false");
  selection.show(shown);
  byId("jobs").hidden = jobs.length === 0;
  byId("more").hidden = cursor === null;
  byId("jobs-state").replaceChildren(...(jobs.length ? [] : [filters.narrow ? noneLikeThat() : noneYet()]));
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

function take(event) {
  if (event.type === "unavailable") showState("interrupted");
  if (event.type !== "jobs") return;
  showState("live");
  const { order, changed, more, counts } = JSON.parse(event.data);
  const known = new Map([...older, ...jobs, ...changed].map((job) => [job.id, job]));
  jobs = order.map((id) => known.get(id));
  if (!older.length) cursor = more;
  const shown = new Set(order);
  older = older.filter((job) => !shown.has(job.id));
  filters.count(counts);
  show();
}

async function start() {
  following?.abort();
  following = new AbortController();
  const { signal } = following;
  older = [];
  showLoading();
  try {
    await follow(`/dashboard/events?${filters.query()}`, { onEvent: take, onState: (state) => state !== "live" && showState(state), signal });
  } catch (error) {
    showState("interrupted");
    rows.replaceChildren();
    byId("jobs-state").replaceChildren(alertOf(error, " ", h("button", { type: "button", onclick: start }, "Try again")));
  }
}

/** Older jobs are not followed: look at those of them that something was done with. */
async function lookAgain(ids) {
  const looked = await Promise.all(older.map((job) => (ids.has(job.id) ? getJson(`/v1/jobs/${job.id}`).catch((error) => (error.status === 404 ? null : job)) : job)));
  older = looked.filter(Boolean);
  show();
}

async function showOlder() {
  const query = filters.query();
  query.set("cursor", cursor);
  const button = byId("more");
  button.disabled = true;
  try {
    const page = await getJson(`/v1/jobs?${query}`);
    older.push(...page.jobs);
    cursor = page.next;
    show();
  } catch (error) {
    byId("jobs-state").replaceChildren(alertOf(error));
  } finally {
    button.disabled = false;
  }
}

const submitting = startSubmitting();
const filters = new JobFilters(start);
byId("more").addEventListener("click", showOlder);
setInterval(() => {
  for (const time of rows.querySelectorAll("time")) time.textContent = age(time.dateTime);
}, 10000);
start();
