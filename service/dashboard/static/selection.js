// Jobs that are chosen together, and what can be done with all of them at once.

import { getJson, request, said } from "meshcone/api";
import { byId, h } from "meshcone/dom";
import { hasEnded } from "meshcone/job-words";
import { sendAgain } from "meshcone/run-again";

const AT_A_TIME = 4;  // requests

const jobPath = (id) => `/v1/jobs/${encodeURIComponent(id)}`;

const jobsInWords = (count) => `${count} ${count === 1 ? "job" : "jobs"}`;

/** A job that is the same once more; a row does not tell all of it. */
async function runAgain({ id }) {
  const job = await getJson(jobPath(id));
  await sendAgain(job, job.options, job.labels);
}

const ACTIONS = [
  { name: "Run again", done: "sent again", fits: (job) => hasEnded(job) && !job.expired, act: runAgain },
  { name: "Cancel", done: "canceled", fits: (job) => !hasEnded(job), act: ({ id }) => request(`${jobPath(id)}/cancel`, { method: "POST" }) },
  { name: "Delete", done: "deleted", danger: true, fits: hasEnded, act: ({ id }) => request(jobPath(id), { method: "DELETE" }) },
];

function write(element, words) {
  if (element.textContent !== words) element.textContent = words;
}

export class Selection {
  /**
   * @param {Element} rows the table's body: a row has its job's id, and a checkbox of ours
   * @param {Function} onDone is called after something was done with jobs
   */
  constructor(rows, onDone) {
    this.rows = rows;
    this.onDone = onDone;
    this.jobs = [];
    this.chosen = new Set();
    this.last = null;
    this.isBusy = false;
    this.bar = byId("selected");
    this.fill();
    this.all = byId("choose-all");
    this.all.addEventListener("change", () => this.choose(this.jobs, this.all.checked));
    rows.addEventListener("click", (event) => event.target.matches(".choose") && this.toggle(event.target, event.shiftKey));
    rows.addEventListener("keydown", (event) => this.press(event));
    addEventListener("keydown", (event) => event.key === "Escape" && !document.querySelector("dialog[open]") && this.choose(this.jobs, false));
  }

  /** What the bar is made of; it stays, for a press or the focus may be on it. */
  fill() {
    this.words = h("strong", { role: "status" });
    this.compare = h("a", { class: "button" }, "Compare");
    this.buttons = new Map(ACTIONS.map((action) => [action, h("button", { type: "button", class: action.danger ? "danger" : "", onclick: () => this.carryOut(action) })]));
    this.clear = h("button", { type: "button", class: "quiet", onclick: () => this.choose(this.jobs, false) }, "Clear");
    this.bar.replaceChildren(this.words, this.compare, ...this.buttons.values(), this.clear);
  }

  /** The jobs that are chosen. */
  get those() {
    return this.jobs.filter(({ id }) => this.chosen.has(id));
  }

  /** A checkbox for the row of a job. */
  checkbox(job) {
    return h("input", { type: "checkbox", class: "choose", checked: this.chosen.has(job.id), "aria-label": `Choose ${job.source.name}` });
  }

  /** Take the jobs that are shown; what is shown no longer is chosen no longer. */
  show(jobs) {
    const byIds = new Map(jobs.map((job) => [job.id, job]));  // below its batch a job may stand once more
    this.jobs = [...byIds.values()];
    const ids = new Set(byIds.keys());
    this.chosen = new Set([...this.chosen].filter((id) => ids.has(id)));
    this.tell();
  }

  boxes(id) {
    return this.rows.querySelectorAll(`tr[data-id="${id}"] .choose`);
  }

  choose(jobs, wanted) {
    for (const { id } of jobs) {
      if (wanted) this.chosen.add(id); else this.chosen.delete(id);
      for (const box of this.boxes(id)) box.checked = wanted;
    }
    this.tell();
  }

  /** With shift, all from the last one that was pressed. */
  toggle(box, range) {
    const { id } = box.closest("tr").dataset;
    const places = [this.last, id].map((each) => this.jobs.findIndex((job) => job.id === each)).sort((a, b) => a - b);
    this.last = id;
    this.choose(range && places[0] >= 0 ? this.jobs.slice(places[0], places[1] + 1) : [{ id }], box.checked);
  }

  /** Arrow keys go from checkbox to checkbox; with shift they choose on their way. */
  press(event) {
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (!step || !event.target.matches(".choose")) return;
    const at = this.jobs.findIndex(({ id }) => id === event.target.closest("tr").dataset.id);
    const next = this.jobs[at + step];
    if (!next) return;
    event.preventDefault();
    if (event.shiftKey) this.choose([this.jobs[at], next], true);
    this.last = next.id;
    this.boxes(next.id)[0].focus();
  }

  tell() {
    const { those } = this;
    this.all.checked = those.length > 0 && those.length === this.jobs.length;
    this.all.indeterminate = those.length > 0 && those.length < this.jobs.length;
    if (this.isBusy) return;  // the bar stays as it was pressed until all is done
    this.bar.hidden = those.length === 0;
    write(this.words, `${jobsInWords(those.length)} chosen`);
    this.compare.hidden = those.length !== 2;
    this.compare.href = `/compare?${new URLSearchParams({ jobs: those.map(({ id }) => id).join(",") })}`;
    for (const [action, button] of this.buttons) {
      const fitting = those.filter(action.fits).length;
      button.disabled = fitting === 0;
      write(button, fitting > 0 && fitting < those.length ? `${action.name} ${fitting}` : action.name);
    }
    this.clear.disabled = false;
  }

  async carryOut(action) {
    const jobs = this.those.filter(action.fits);
    if (action.danger && !confirm(`Delete ${jobsInWords(jobs.length)} with all of their files?`)) return;
    this.isBusy = true;
    for (const button of this.bar.querySelectorAll("button")) button.disabled = true;
    const waiting = [...jobs];
    const failures = [];
    const work = async () => {
      for (let job = waiting.pop(); job; job = waiting.pop()) {
        try { await action.act(job); } catch (error) { failures.push(`${job.source.name}: ${said(error)}`); }
      }
    };
    await Promise.all(Array.from({ length: AT_A_TIME }, work));
    this.isBusy = false;
    this.choose(jobs, false);
    this.onDone();
    byId("sent").replaceChildren(
      h("p", { class: `notice ${failures.length ? "error" : "good"}` }, `${jobsInWords(jobs.length - failures.length)} ${action.done}.`,
        failures.length > 0 && ` ${failures.length} not: ${failures[0]}`));
  }
}
