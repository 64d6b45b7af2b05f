// One job: how far it is, and once it has ended, everything that came of it.

import { download, follow, getJson, key, Problem, request, said } from "meshcone/api";
import { byId, command, h } from "meshcone/dom";
import { bytes, dateTime, number, seconds } from "meshcone/format";
import { chip, hasEnded, projectTag, stageWords, waitWords } from "meshcone/job-words";
import { reportSections } from "meshcone/report-view";
import { pathsOf } from "meshcone/sides";
import { quoted } from "meshcone/solver-panel";

const id = decodeURIComponent(location.pathname.split("/").at(-1));
const path = `/v1/jobs/${encodeURIComponent(id)}`;
const place = byId("job");
const leaving = new AbortController();

function title(job) {
  const took = job.started && job.finished ? `took ${seconds((new Date(job.finished) - new Date(job.started)) / 1000)}` : null;
  const actions = hasEnded(job)
    ? h("button", { type: "button", class: "danger quiet", onclick: remove }, "Delete")
    : h("button", { type: "button", onclick: cancel }, "Cancel");
  return h("div", { class: "title-row" },
    h("div", { class: "grow" },
      h("h1", null, job.source.name, job.reference && [h("span", { class: "arrow" }, " → "), job.reference.name]),
      h("div", { class: "chips" },
        chip(job.state), job.summary?.outcome && chip(job.summary.outcome), job.verdict && chip(job.verdict, `gates: ${job.verdict.replace("_", " ")}`),
        projectTag(job), job.labels.map((label) => h("a", { class: "tag", href: `/compare?label=${encodeURIComponent(label)}` }, label)),
        h("span", { class: "hint" }, [dateTime(job.created), took, job.attempt > 1 && `attempt ${job.attempt}`].filter(Boolean).join(" · ")))),
    actions);
}

async function cancel(event) {
  event.currentTarget.disabled = true;
  try { await request(`${path}/cancel`, { method: "POST" }); } catch (error) { tell(said(error)); }
}

async function remove(event) {
  if (!confirm("Delete this job with all of its files?")) return;
  event.currentTarget.disabled = true;
  try {
    await request(path, { method: "DELETE" });
    location.assign("/");
  } catch (error) {
    tell(said(error));
  }
}

function tell(text) {
  place.prepend(h("p", { class: "notice error", role: "alert" }, text));
}

function waiting(job) {
  const bar = h("progress", { max: 1, value: job.progress?.fraction ?? 0, "aria-label": "progress", "data-testid": "progress" });
  const text = h("p", { class: "hint", role: "status" }, job.state === "queued" ? waitWords(job) : stageWords(job.progress));
  return { bar, text, element: h("section", { class: "card", "aria-label": "Progress" }, bar, text) };
}

async function watch(job) {
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
  await follow(`${path}/events`, { onEvent, signal: leaving.signal });
}

const filesOf = (job, side) => [job[side], ...job[`${side}_resources`]].filter(Boolean);

const namesOf = (job, side) => filesOf(job, side).map((file) => file.name);

const jobPaths = (job) => pathsOf({ source: namesOf(job, "source"), reference: namesOf(job, "reference") });

function inputs(job) {
  const entry = (file, words) => h("li", null, file.link ? download(file.link, file.name.split("/").at(-1)) : file.name, h("span", { class: "soft" }, `${words}, ${file.size === null ? "not fetched" : bytes(file.size)}`));
  return [
    ...["source", "reference"].flatMap((side) => filesOf(job, side).map((file) => entry(file, file === job[side] ? `the ${side}` : `${file.name} of the ${side}`))),
    ...job.resources.map((file) => entry(file, `${file.name} for both`))];
}

function inputsCard(job) {
  return h("section", { class: "card", "aria-labelledby": "inputs-title" },
    h("h2", { id: "inputs-title" }, "As sent"),
    h("ul", { class: "files", "data-testid": "inputs" }, inputs(job)));
}

function filesCard(job) {
  const stem = job.source.name.replace(/\.[^.]*$/, "");
  const suffix = job.source.name.slice(stem.length);
  const known = { mesh: `${stem}.refined${suffix}`, report: `${stem}.report.json`, certificate: `${stem}.report.certificate.npz`, diagnostics_csv: `${stem}.diagnostics.csv`, heatmap: `${stem}.heatmap.glb`, preview: `${stem}.preview.glb`, pictures: `${stem}.pictures.png` };
  const told = { mesh: "the refined mesh", report: "the report, as JSON", certificate: "the certificate", diagnostics_csv: "SCS's iterations", heatmap: "coloured by deviation", preview: "what is shown above", pictures: "from six sides" };
  const entries = Object.keys(known).filter((name) => job.links[name]);
  const paths = jobPaths(job);
  const files = { report: known.report, source: paths.source(job.source.name), reference: job.reference && paths.reference(job.reference.name), refined: known.mesh, apart: paths.apart };
  const card = h("section", { class: "card", "aria-labelledby": "files-title" },
    h("h2", { id: "files-title" }, "Downloads"),
    h("ul", { class: "files" }, entries.map((name) => h("li", null, download(job.links[name], known[name]), h("span", { class: "soft" }, told[name])))),
    h("h3", null, "As sent"),
    h("ul", { class: "files", "data-testid": "inputs" }, inputs(job)));
  return { card, files };
}

function repeatCard(job) {
  const paths = jobPaths(job);
  const field = (name, path) => `  -F ${name}=@${quoted(path)}`;
  const parts = ["curl -sS --fail-with-body", ...(key() ? ['  -H "Authorization: Bearer $MESHCONE_API_KEY"'] : []),
    field("source", paths.source(job.source.name)), ...(job.reference ? [field("reference", paths.reference(job.reference.name))] : []),
    ...job.source_resources.map((file) => field("source_resources", paths.source(file.name))),
    ...job.reference_resources.map((file) => field("reference_resources", paths.reference(file.name))),
    ...job.resources.map((file) => field("resources", file.name)),
    ...job.labels.map((label) => `  --form-string ${quoted(`label=${label}`)}`),
    `  --form-string ${quoted(`options=${JSON.stringify(job.options)}`)}`,
    `  ${location.origin}/v1/jobs`];
  return h("section", { class: "card", "aria-labelledby": "repeat-title" },
    h("h2", { id: "repeat-title" }, "Repeat this job"),
    h("p", { class: "hint" }, `With the same files${paths.apart ? ", in a folder for each side" : ""}: ${[job.source, job.reference].filter((file) => file?.sha256).map((file) => `${file.name} has SHA-256 ${file.sha256.slice(0, 12)}…`).join(", ")}`),
    command(parts.join(" \\\n"), "Command that repeats this job"));
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

async function show(job) {
  document.title = `${job.source.name} · MeshCone`;
  if (job.state !== "succeeded" || !job.links.report) return place.replaceChildren(title(job), ...ended(job), h("div", { class: "columns" }, inputsCard(job), repeatCard(job)));
  const report = await getJson(job.links.report);
  const { card, files } = filesCard(job);
  const bytesOf = (link) => (link ? async () => (await request(link)).arrayBuffer() : null);
  const around = { files, loadPreview: bytesOf(job.links.preview), loadWhole: bytesOf(job.links.heatmap), loadPictures: imageOf(job.links.pictures) };
  place.replaceChildren(title(job), ...reportSections(report, around).filter(Boolean),
    h("div", { class: "columns" }, card, repeatCard(job)));
  return undefined;
}

function ended(job) {
  if (job.state === "succeeded") return [h("p", { class: "notice" }, "The files of this job have been let go.")];
  if (job.state === "canceled") return [h("p", { class: "notice" }, "This job was canceled; it left no files.")];
  const { error } = job;
  const where = [error?.file, error?.place].filter(Boolean).join(", ");
  return [h("section", { class: "card verdict fail", role: "alert" },
    h("p", { class: "headline" }, error?.detail ?? "The job failed."),
    h("p", { class: "soft" }, [where && `In ${where}.`, error?.kind && `Kind: ${error.kind}.`, job.attempt > 1 && `${number(job.attempt)} attempts.`].filter(Boolean).join(" ")))];
}

async function start() {
  try {
    let job = await getJson(path);
    if (!hasEnded(job)) {
      await watch(job);
      job = await getJson(path);
    }
    await show(job);
  } catch (error) {
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
start();
