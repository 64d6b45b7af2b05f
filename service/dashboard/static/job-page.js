// One job: how far it is, and once it has ended, everything that came of it.

import { follow, getJson, Problem, request, said } from "meshcone/api";
import { byId, h } from "meshcone/dom";
import { dateTime, number, seconds } from "meshcone/format";
import { filesCard, inputsCard, repeatCard } from "meshcone/job-files";
import { chip, hasEnded, projectTag, stageWords, waitWords } from "meshcone/job-words";
import { reportSections } from "meshcone/report-view";
import { runAgainButton } from "meshcone/run-again";

const id = decodeURIComponent(location.pathname.split("/").at(-1));
const path = `/v1/jobs/${encodeURIComponent(id)}`;
const place = byId("job");
let leaving = new AbortController();
let told = false;  // how the job ended

function title(job) {
  const took = job.started && job.finished ? `took ${seconds((new Date(job.finished) - new Date(job.started)) / 1000)}` : null;
  const actions = hasEnded(job)
    ? h("div", { class: "row" }, runAgainButton(job), h("button", { type: "button", class: "danger quiet", onclick: remove }, "Delete"))
    : h("button", { type: "button", onclick: cancel }, "Cancel");
  return h("div", { class: "title-row" },
    h("div", { class: "grow" },
      h("h1", null, job.source.name, job.reference && [h("span", { class: "arrow" }, " → "), job.reference.name]),
      h("div", { class: "chips" },
        job.state !== "succeeded" && chip(job.state),
        projectTag(job), job.labels.map((label) => h("a", { class: "tag", href: `/compare?label=${encodeURIComponent(label)}` }, label)),
        h("span", { class: "hint" }, [dateTime(job.created), took, job.attempt > 1 && `attempt ${job.attempt}`].filter(Boolean).join(" · ")))),
    actions);
}

/** Do what a button is for, once; where it is refused that is said, and the button can be tried again. */
async function once(button, act) {
  button.disabled = true;
  place.querySelector(":scope > .refused")?.remove();
  try {
    await act();
  } catch (error) {
    place.prepend(h("p", { class: "notice error refused", role: "alert" }, said(error)));
    button.disabled = false;
  }
}

const cancel = (event) => once(event.currentTarget, () => request(`${path}/cancel`, { method: "POST" }));

async function remove(event) {
  if (!confirm("Delete this job with all of its files?")) return;
  await once(event.currentTarget, async () => {
    await request(path, { method: "DELETE" });
    told = false;  // who comes back to this page is told that the job is gone
    location.assign("/");
  });
}

function waiting(job) {
  const bar = h("progress", { max: 1, value: job.progress?.fraction ?? 0, "aria-label": "progress", "data-testid": "progress" });
  const text = h("p", { class: "hint", role: "status" }, job.state === "queued" ? waitWords(job) : stageWords(job.progress));
  return { bar, text, element: h("section", { class: "card", "aria-label": "Progress" }, bar, text) };
}

async function watch(job, signal) {
  const shown = waiting(job);
  place.replaceChildren(title(job), shown.element);
  const onEvent = (event) => {
    const data = JSON.parse(event.data);
    if (event.type === "progress") {
      shown.bar.value = data.fraction;
      shown.text.textContent = stageWords(data);
    } else if (event.type === "cancel") shown.text.textContent = "Asked to stop";
    else if (event.type === "state") {
      if (hasEnded(data)) return "done";
      shown.text.textContent = data.state === "queued" ? "Waiting for a worker" : "Started";
      const state = place.querySelector(".chips .chip");
      state?.replaceWith(chip(data.state));
    }
    return undefined;
  };
  await follow(`${path}/events`, { onEvent, signal });
}

/** An image needs the key that a request sends; so its bytes become its address. */
function imageOf(link) {
  if (!link) return null;
  return async () => {
    const image = await (await request(link)).blob();
    const reader = new FileReader();
    const read = new Promise((resolve, reject) => { reader.onload = resolve; reader.onerror = reject; });
    reader.readAsDataURL(image);
    await read;
    return reader.result;
  };
}

/** What is at a link. Throws in words for the reader. */
async function bytesAt(link) {
  try {
    return await (await request(link)).arrayBuffer();
  } catch (error) {
    throw new Error(said(error));
  }
}

async function show(job, signal) {
  if (job.state !== "succeeded" || !job.links.report) return place.replaceChildren(title(job), ...ended(job), h("div", { class: "columns" }, inputsCard(job), repeatCard(job)));
  const report = await getJson(job.links.report, { signal });
  const { card, files } = filesCard(job);
  const bytesOf = (link) => (link ? () => bytesAt(link) : null);
  const more = [h("div", { class: "columns" }, card, repeatCard(job))];
  const around = { heading: title(job), files, loadPreview: bytesOf(job.links.preview), loadWhole: bytesOf(job.links.heatmap), loadPictures: imageOf(job.links.pictures), more };
  place.replaceChildren(...reportSections(report, around));
  return undefined;
}

function ended(job) {
  if (job.state === "succeeded") return [h("p", { class: "notice" }, "The files of this job have expired.")];
  if (job.state === "canceled") return [h("p", { class: "notice" }, "This job was canceled; it left no files.")];
  const { error } = job;
  const where = [error?.file, error?.place].filter(Boolean).join(", ");
  return [h("section", { class: "card verdict fail", role: "alert" },
    h("p", { class: "headline" }, error?.detail ?? "The job failed."),
    h("p", { class: "soft" }, [where && `In ${where}.`, error?.kind && `Kind: ${error.kind}.`, job.attempt > 1 && `${number(job.attempt)} attempts.`].filter(Boolean).join(" ")))];
}

/** Follow the job to its end and show that. A page that is left stops here, whatever it waits for. */
async function start() {
  const { signal } = leaving;
  try {
    let job = await getJson(path, { signal });
    document.title = `${job.source.name} · MeshCone`;
    while (!hasEnded(job)) {
      await watch(job, signal);
      job = await getJson(path, { signal });
    }
    await show(job, signal);
    told = true;
  } catch (error) {
    if (signal.aborted) return;
    const missing = error instanceof Problem && error.status === 404;
    place.replaceChildren(h("div", { class: "card empty" },
      h("strong", null, missing ? "There is no such job" : "This job cannot be shown"),
      missing ? "It may have been deleted." : said(error), " ",
      h("p", null, missing ? h("a", { href: "/" }, "All jobs") : h("button", { type: "button", onclick: start }, "Try again"))));
  } finally {
    place.setAttribute("aria-busy", "false");
  }
}

addEventListener("pagehide", () => leaving.abort());
// Browsers keep pages and show them again as they were left: the job went on meanwhile.
addEventListener("pageshow", (event) => {
  if (!event.persisted) return;
  leaving = new AbortController();
  if (!told) start();
});
start();
