// The files of a job, to download, and the command that sends them again.

import { download, key } from "meshcone/api";
import { command, h } from "meshcone/dom";
import { bytes } from "meshcone/format";
import { pathsOf } from "meshcone/sides";
import { quoted } from "meshcone/solver-panel";

const filesOf = (job, side) => [job[side], ...job[`${side}_resources`]].filter(Boolean);

const namesOf = (job, side) => filesOf(job, side).map((file) => file.name);

const jobPaths = (job) => pathsOf({ source: namesOf(job, "source"), reference: namesOf(job, "reference") });

function inputs(job) {
  const entry = (file, words) => h("li", null, file.link ? download(file.link, file.name.split("/").at(-1)) : file.name, h("span", { class: "soft" }, `${words}, ${file.size === null ? "not fetched" : bytes(file.size)}`));
  return [
    ...["source", "reference"].flatMap((side) => filesOf(job, side).map((file) => entry(file, file === job[side] ? `the ${side}` : `${file.name} of the ${side}`))),
    ...job.resources.map((file) => entry(file, `${file.name} for both`))];
}

/** What was sent, to download. */
export function inputsCard(job) {
  return h("section", { class: "card", "aria-labelledby": "inputs-title" },
    h("h2", { id: "inputs-title" }, "As sent"),
    h("ul", { class: "files", "data-testid": "inputs" }, inputs(job)));
}

/** What the job has made and what was sent, to download; and how commands name the files. */
export function filesCard(job) {
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

/** What -F of curl reads as it stands; of all else commas, semicolons, spaces and backslashes have a meaning to it. */
const PLAIN = /^[\w./:=@%+-]+$/;

const forCurl = (text) => (PLAIN.test(text) ? text : `"${text.replaceAll(/[\\"]/g, "\\$&")}"`);

/** A file in a form, under the name that the mesh has for it: curl alone would send the last part of its path. */
function field(name, path, sent) {
  const as = sent.includes("/") ? `;filename=${forCurl(sent)}` : "";
  return `  -F ${quoted(`${name}=@${forCurl(path)}${as}`)}`;
}

/** The command that sends the same job again. */
export function repeatCard(job) {
  const paths = jobPaths(job);
  const parts = ["curl -sS --fail-with-body", ...(key() ? ['  -H "Authorization: Bearer $MESHCONE_API_KEY"'] : []),
    field("source", paths.source(job.source.name), job.source.name), ...(job.reference ? [field("reference", paths.reference(job.reference.name), job.reference.name)] : []),
    ...job.source_resources.map(({ name }) => field("source_resources", paths.source(name), name)),
    ...job.reference_resources.map(({ name }) => field("reference_resources", paths.reference(name), name)),
    ...job.resources.map(({ name }) => field("resources", name, name)),
    ...job.labels.map((label) => `  --form-string ${quoted(`label=${label}`)}`),
    `  --form-string ${quoted(`options=${JSON.stringify(job.options)}`)}`,
    `  ${location.origin}/v1/jobs`];
  return h("section", { class: "card", "aria-labelledby": "repeat-title" },
    h("h2", { id: "repeat-title" }, "Repeat this job"),
    h("p", { class: "hint" }, `With the same files${paths.apart ? ", in a folder for each side" : ""}: ${[job.source, job.reference].filter((file) => file?.sha256).map((file) => `${file.name} has SHA-256 ${file.sha256.slice(0, 12)}…`).join(", ")}`),
    command(parts.join(" \\\n"), "Command that repeats this job"));
}
