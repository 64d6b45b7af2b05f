// The table of jobs, live.

import { follow, getJson, said } from "meshcone/api";
import { byId, h } from "meshcone/dom";
import { age, dateTime } from "meshcone/format";
import { chip, hasEnded, projectTag, stageWords, worstWords, pairWords } from "meshcone/job-words";
import { startSubmitting } from "meshcone/submit";

const rows = byId("rows");
const filters = byId("filters");
let jobs = [];
let older = [];
let cursor = null;
let following = null;

const wanted = () => {
  const query = new URLSearchParams();
  for (const [name, value] of new FormData(filters)) if (value.trim()) query.set(name, value.trim());
  return query;
};

function stateCell(job) {
  const parts = [chip(job.state)];
  if (job.state === "running") {
    parts.push(
      h("progress", { max: 1, value: job.progress?.fraction ?? 0, "aria-label": `progress of ${job.source.name}` }),
      h("span", { class: "hint" }, stageWords(job.progress)),
    );
  }
  return h("td", { class: "state-cell" }, parts);
}

function row(job) {
  const labels = job.labels.map((label) => h("a", { class: "tag", href: `/?label=${encodeURIComponent(label)}` }, label));
  const verdict = job.verdict ? chip(job.verdict) : hasEnded(job) && job.state === "succeeded" ? h("span", { class: "soft" }, "no gates") : null;
  return h("tr", { "data-id": job.id },
    h("td", null,
      h("a", { class: "pair", href: `/jobs/${job.id}` }, pairWords(job)),
      h("div", { class: "chips" }, projectTag(job), labels, ["measure", "audit"].includes(job.mode) && h("span", { class: "tag" }, job.mode))),
    stateCell(job),
    h("td", { "data-label": "Outcome" }, job.summary?.outcome ? chip(job.summary.outcome) : null),
    h("td", { "data-label": "Verdict" }, verdict),
    h("td", { class: "worst", "data-label": job.state === "failed" ? "Why" : "Worst" }, job.error ? job.error.detail : worstWords(job.summary)),
    h("td", { class: "right soft", "data-label": "Age" }, h("time", { datetime: job.created, title: dateTime(job.created) }, age(job.created))));
}

function show() {
  const focused = document.activeElement?.closest?.("tr")?.dataset.id;
  rows.replaceChildren(...[...jobs, ...older].map(row));
  rows.setAttribute("aria-busy", "false");
  if (focused) rows.querySelector(`tr[data-id="${focused}"] a`)?.focus();
  const filtered = [...wanted()].length > 0;
  byId("jobs").hidden = jobs.length === 0;
  byId("more").hidden = cursor === null;
  byId("jobs-state").replaceChildren(...(jobs.length ? [] : [
    h("div", { class: "empty" },
      h("strong", null, filtered ? "No job is like that" : "No jobs yet"),
      filtered ? "Change or clear the filters above." : "Drop a mesh and its reference above, or send them with the command line:",
      !filtered && h("p", null, h("code", null, `meshcone submit --server ${location.origin} SOURCE REFERENCE`))),
  ]));
}

function showLoading() {
  byId("jobs").hidden = false;
  rows.setAttribute("aria-busy", "true");
  rows.replaceChildren(...[70, 55, 62].map((width) => h("tr", { class: "skeleton" },
    ...[width, 40, 50, 40, width, 30].map((share) => h("td", null, h("span", { style: { width: `${share}%` } }))))));
}

function showState(state) {
  const live = byId("live");
  live.className = `live ${state === "live" ? "on" : "off"}`;
  live.textContent = state === "live" ? "live" : "interrupted, trying again";
}

function take(event) {
  if (event.type === "unavailable") showState("interrupted");
  if (event.type !== "jobs") return;
  showState("live");
  const { order, changed, more } = JSON.parse(event.data);
  const known = new Map([...older, ...jobs, ...changed].map((job) => [job.id, job]));
  jobs = order.map((id) => known.get(id));
  if (!older.length) cursor = more;
  const shown = new Set(order);
  older = older.filter((job) => !shown.has(job.id));
  show();
}

async function start() {
  following?.abort();
  following = new AbortController();
  const { signal } = following;
  older = [];
  showLoading();
  try {
    await follow(`/dashboard/events?${wanted()}`, { onEvent: take, onState: (state) => state !== "live" && showState(state), signal });
  } catch (error) {
    showState("interrupted");
    rows.replaceChildren();
    byId("jobs-state").replaceChildren(h("p", { class: "notice error", role: "alert" }, said(error), " ",
      h("button", { type: "button", onclick: start }, "Try again")));
  }
}

async function showOlder() {
  const query = wanted();
  query.set("cursor", cursor);
  const button = byId("more");
  button.disabled = true;
  try {
    const page = await getJson(`/v1/jobs?${query}`);
    older.push(...page.jobs);
    cursor = page.next;
    show();
  } catch (error) {
    byId("jobs-state").replaceChildren(h("p", { class: "notice error", role: "alert" }, said(error)));
  } finally {
    button.disabled = false;
  }
}

for (const [name, value] of new URLSearchParams(location.search)) {
  if (filters.elements[name]) filters.elements[name].value = value;
}
let typing = 0;
filters.addEventListener("input", () => {
  clearTimeout(typing);
  typing = setTimeout(() => {
    const query = wanted().toString();
    history.replaceState(null, "", query ? `?${query}` : location.pathname);
    start();
  }, 250);
});
filters.addEventListener("submit", (event) => event.preventDefault());
byId("more").addEventListener("click", showOlder);
setInterval(() => {
  for (const time of rows.querySelectorAll("time")) time.textContent = age(time.dateTime);
}, 10000);
startSubmitting();
start();
