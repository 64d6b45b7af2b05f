// A new job: two meshes dropped or chosen, each with the files it names, and the options as a form.

import { askForKey, Problem, said } from "meshcone/api";
import { opened } from "meshcone/archive";
import { byId, h } from "meshcone/dom";
import { bytes } from "meshcone/format";
import { pairWords } from "meshcone/job-words";
import { optionsForm } from "meshcone/options-form";
import { samplePair } from "meshcone/sample";
import { droppedFiles, MESHES, sorted } from "meshcone/sides";
import { Stopped, tellOfUpload, uploading } from "meshcone/upload";

const SIDES = ["source", "reference"];
const EMPTY = { source: "Choose or drop the mesh to judge", reference: "Choose or drop what it should have been" };

// Each mesh, where it lay, and what it names; files of both where nothing says whose they are.
const nothing = () => ({ source: null, reference: null, resources: { source: [], reference: [], both: [] } });
const chosen = nothing();
let options = null;
let sending = false;

function tag(file, place) {
  const leaveOut = () => {
    chosen.resources[place] = chosen.resources[place].filter((other) => other !== file);
    show();
  };
  return h("li", { class: "tag" }, `${file.name} · ${bytes(file.size)} ${place === "both" ? "· for both " : ""}`,
    h("button", { type: "button", class: "quiet", "aria-label": `Leave out ${file.name}`, onclick: leaveOut }, "×"));
}

function show() {
  for (const side of SIDES) {
    const element = document.querySelector(`.slot[data-slot=${side}]`);
    const mesh = chosen[side];
    element.classList.toggle("filled", mesh !== null);
    const leaveOut = element.querySelector(".leave-out");
    leaveOut.hidden = mesh === null;
    leaveOut.setAttribute("aria-label", `Leave out ${mesh?.file.name} as the ${side}`);
    element.querySelector(".slot-name").textContent = mesh ? `${mesh.folder}${mesh.file.name} · ${bytes(mesh.file.size)}` : EMPTY[side];
  }
  for (const [place, files] of Object.entries(chosen.resources)) {
    document.querySelector(`[data-resources=${place}]`).replaceChildren(...files.map((file) => tag(file, place)));
  }
  byId("send").disabled = sending || chosen.source === null;
  byId("send").textContent = chosen.source && !chosen.reference ? "Audit the source alone" : "Start the job";
  byId("intent").textContent = intent();
}

/** What would be done with what was chosen, before it is sent. */
function intent() {
  const { source, reference } = chosen;
  if (source && reference) return `${source.file.name} is judged against ${reference.file.name}. The other way round? Swap them.`;
  if (source) return `${source.file.name} is audited by itself.`;
  if (reference) return `No mesh to judge yet: ${reference.file.name} is what it should have been.`;
  const beside = Object.values(chosen.resources).flat().map(({ name }) => name);
  return beside.length ? `No mesh yet: ${beside.join(", ")} ${beside.length === 1 ? "is" : "are"} what a mesh names. Choose or drop that, too.` : "";
}

/** Take files that came together; the side they were dropped on or chosen for, if any, decides. Tells what was not taken. */
async function take(coming, side) {
  try {
    const came = await coming;
    open();
    byId("take-state").replaceChildren();
    if (came.length === 0) throw new Error("There are no files in what was dropped.");
    takeFiles(await opened(came, MESHES), side);
  } catch (error) {
    open();
    tell("take-state", "error", error.message);
  }
}

function takeFiles(files, side) {
  const { meshes, beside, leftOut, unread } = sorted(files, { side, free: chosen.source === null ? "source" : "reference" });
  if (unread.length) throw new Error(unreadWords(unread));
  forgetRefusal();
  for (const [place, mesh] of Object.entries(meshes)) {
    // What the mesh before it named is not for this one; what came before any mesh is.
    if (chosen[place] !== null) chosen.resources[place] = [];
    chosen[place] = mesh;
  }
  for (const [place, added] of Object.entries(beside)) {
    const names = new Set(added.map((file) => file.name));
    // On a side a file replaces its namesake. For both, two of one name may be one for each mesh: the service refuses them.
    const kept = chosen.resources[place].filter((file) => place === "both" || !names.has(file.name));
    chosen.resources[place] = [...kept, ...added];
  }
  if (leftOut.length) tell("take-state", "error", `Left out: ${leftOut.map(({ file, folder }) => folder + file.name).join(", ")}. A job has one source and one reference; drop two meshes at a time.`);
  show();
}

/** What cannot be read is no attachment of another mesh: who dropped it meant it. */
function unreadWords(unread) {
  const names = unread.map(({ file, folder }) => folder + file.name);
  const [it, are] = names.length === 1 ? ["it", "is"] : ["them", "are"];
  return `Nothing was taken: ${names.join(", ")} ${are} of a kind that cannot be read here. Export ${it} as GLB or OBJ, pack archives as ZIP, or drop the others without ${it}.`;
}

/** What was said of other files goes, but for what leads back to them. */
function forgetRefusal() {
  for (const told of byId("submit-state").querySelectorAll(".error")) {
    if (!told.querySelector("button")) told.remove();
  }
}

/** Take a mesh out of its slot, with what it names. */
function empty(side) {
  chosen[side] = null;
  chosen.resources[side] = [];
  show();
  document.querySelector(`.slot[data-slot=${side}] input`).focus();
}

function open() {
  if (byId("new-dialog").open) return;
  byId("new-dialog").showModal();
  tellOfUpload();
}

function tell(place, kind, ...content) {
  byId(place).replaceChildren(h("p", { class: `notice ${kind}` }, content));
}

/** What is sent of some files, with the options and the label as they are now. */
function formOf(files) {
  const form = new FormData();
  const wanted = options?.value() ?? {};
  if (files.reference === null) wanted.mode = "audit"; // what the button says; the only mode that needs no reference
  for (const side of SIDES) {
    if (files[side] === null) continue;
    form.append(side, files[side].file);
    for (const file of files.resources[side]) form.append(`${side}_resources`, file);
  }
  form.append("options", JSON.stringify(wanted));
  for (const file of files.resources.both) form.append("resources", file);
  const label = byId("submit").elements.label.value.trim();
  if (label) form.append("label", label);
  return form;
}

const pairOf = ({ source, reference }) => pairWords({ source: source.file, reference: reference?.file });

const isEmpty = ({ source, reference, resources }) => !source && !reference && !Object.values(resources).flat().length;

async function send(files, form, post) {
  try {
    return await post(form);
  } catch (error) {
    if (error instanceof Stopped) throw error;
    if (!(error instanceof Problem)) throw await changed(files) ?? error;
    if (error.status !== 401) throw error;
    await askForKey();
    return send(files, form, post);
  }
}

/** Which of the files cannot be read any more: a browser does not tell that from a server that is silent. */
async function changed({ source, reference, resources }) {
  const files = [source, reference].filter(Boolean).map(({ file }) => file).concat(...Object.values(resources));
  for (const file of files) {
    try {
      await file.slice(0, 1).arrayBuffer();
    } catch {
      return new Error(`${file.name} has changed since it was chosen, or is gone. Choose it again.`);
    }
  }
  return null;
}

/** Send what was chosen. What is chosen or dropped meanwhile is for another job. */
async function submit(event) {
  event.preventDefault();
  if (sending) return;
  let form;
  try {
    form = formOf(chosen);
  } catch (error) {
    tell("submit-state", "error", said(error));
    return;
  }
  const files = { ...chosen };
  Object.assign(chosen, nothing());
  sending = true;
  byId("take-state").replaceChildren();
  show();
  try {
    accepted(await uploading(`Sending ${pairOf(files)} …`, (post) => send(files, form, post)));
  } catch (error) {
    refused(files, error);
  } finally {
    sending = false;
    show();
    // The button that was pressed could not be meanwhile, and lost the focus by it.
    if (byId("new-dialog").open && document.activeElement === document.body) byId("send").focus();
  }
}

function accepted(job) {
  const words = () => [`Accepted: ${pairWords(job)}. `, h("a", { href: `/jobs/${job.id}` }, "Watch this job")];
  tell("sent", "good", ...words());
  if (isEmpty(chosen)) {
    byId("submit-state").replaceChildren();
    byId("new-dialog").close();
  } else tell("submit-state", "good", ...words());
}

function refused(files, error) {
  const takeBack = () => { Object.assign(chosen, files); show(); };
  if (isEmpty(chosen)) takeBack();
  // What came meanwhile keeps its place; what was refused is a press away.
  const back = chosen.source !== files.source && h("button", { type: "button", onclick: (event) => { event.currentTarget.remove(); takeBack(); } }, `Choose ${pairOf(files)} again`);
  tell("submit-state", "error", said(error), back && " ", back);
  if (!byId("new-dialog").open) tell("sent", "error", `${pairOf(files)} was not sent: ${said(error)} `, h("button", { type: "button", onclick: open }, "Show it"));
}

async function showOptions() {
  if (!byId("options").open || options) return;
  try {
    const { form, value } = await optionsForm((count) => {
      byId("options-count").textContent = count ? `${count} changed` : "all at their defaults";
    });
    options = { value };
    byId("options-form").replaceChildren(form);
  } catch (error) {
    byId("options-form").replaceChildren(h("p", { class: "notice error" }, said(error)));
  }
}

/** The whole page is a place to drop on: nobody loses the page over an inch. */
function startDropping() {
  const drop = byId("drop");
  const hover = (over) => {
    drop.classList.toggle("over", over);
    byId("veil").hidden = !over || byId("new-dialog").open;
  };
  // A link or some text that is dragged goes where it can go without us.
  const hasFiles = ({ dataTransfer }) => dataTransfer.types.includes("Files");
  for (const kind of ["dragenter", "dragover"]) {
    addEventListener(kind, (event) => {
      if (!hasFiles(event)) return;
      event.preventDefault();
      hover(true);
    });
  }
  // It goes to nothing when the pointer leaves the window.
  addEventListener("dragleave", (event) => { if (!event.relatedTarget) hover(false); });
  addEventListener("drop", (event) => {
    if (!hasFiles(event)) return;
    event.preventDefault();
    hover(false);
    take(droppedFiles(event.dataTransfer), event.target.closest?.(".slot")?.dataset.slot);
  });
}

/** Make the form work; gives the ways to open it. */
export function startSubmitting() {
  for (const slot of byId("drop").querySelectorAll(".slot")) {
    slot.querySelector(".leave-out").addEventListener("click", () => empty(slot.dataset.slot));
    slot.querySelector("input").addEventListener("change", ({ target }) => {
      const files = [...target.files].map((file) => ({ file, folder: "" }));
      target.value = "";  // the same file can be chosen again
      if (files.length) take(files, slot.dataset.slot);
    });
  }
  startDropping();
  const fillInSample = () => take(samplePair());
  byId("new-job").addEventListener("click", open);
  byId("new-dialog").addEventListener("close", tellOfUpload);
  byId("close-new").addEventListener("click", () => byId("new-dialog").close());
  byId("sample").addEventListener("click", fillInSample);
  byId("swap").addEventListener("click", () => {
    const { resources } = chosen;
    [chosen.source, chosen.reference] = [chosen.reference, chosen.source];
    [resources.source, resources.reference] = [resources.reference, resources.source];
    show();
  });
  byId("options").addEventListener("toggle", showOptions);
  byId("submit").addEventListener("submit", submit);
  show();
  return { open, fillInSample };
}
