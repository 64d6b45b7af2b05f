// A new job: two files dropped or chosen, and the options as a form.

import { askForKey, authorization, Problem, said } from "meshcone/api";
import { byId, h } from "meshcone/dom";
import { bytes } from "meshcone/format";
import { optionsForm } from "meshcone/options-form";

const MESHES = /\.(obj|gltf|glb|ply|stl|off)$/i;
const LIKE_A_REFERENCE = /(ref|reference|target|truth|gt|clean|hi|high|highpoly|original)([^a-z]|$)/i;
const EMPTY = { source: "Choose or drop the mesh to refine", reference: "Choose or drop what it should have been" };

const chosen = { source: null, reference: null, resources: [] };
let options = null;

function show() {
  for (const slot of ["source", "reference"]) {
    const element = document.querySelector(`.slot[data-slot=${slot}]`);
    const file = chosen[slot];
    element.classList.toggle("filled", file !== null);
    element.querySelector(".slot-name").textContent = file ? `${file.name} · ${bytes(file.size)}` : EMPTY[slot];
  }
  byId("resources").replaceChildren(...chosen.resources.map((file) => h("li", { class: "tag" }, `${file.name} · ${bytes(file.size)} `,
    h("button", { type: "button", class: "quiet", "aria-label": `Leave out ${file.name}`, onclick: () => { chosen.resources = chosen.resources.filter((other) => other !== file); show(); } }, "×"))));
  byId("send").disabled = !(chosen.source && chosen.reference);
}

/** Decide which of the dropped files is what; a slot they were dropped on decides for the first. */
function take(files, slot) {
  const meshes = files.filter((file) => MESHES.test(file.name));
  chosen.resources.push(...files.filter((file) => !MESHES.test(file.name)));
  if (meshes.length === 1) {
    const place = slot ?? (chosen.source === null ? "source" : "reference");
    chosen[place] = meshes[0];
  } else if (meshes.length > 1) {
    const [first, second] = meshes;
    const turned = LIKE_A_REFERENCE.test(first.name) && !LIKE_A_REFERENCE.test(second.name);
    [chosen.source, chosen.reference] = turned ? [second, first] : [first, second];
  }
  show();
}

function tell(kind, ...content) {
  byId("submit-state").replaceChildren(h("p", { class: kind ? `notice ${kind}` : "hint" }, ...content));
}

/** Post a form; fetch would not say how much of it has been sent. */
function post(form, onProgress) {
  return new Promise((resolve, reject) => {
    const sending = new XMLHttpRequest();
    sending.open("POST", "/v1/jobs");
    for (const [name, value] of Object.entries(authorization())) sending.setRequestHeader(name, value);
    sending.upload.addEventListener("progress", (event) => event.lengthComputable && onProgress(event.loaded / event.total));
    sending.addEventListener("error", () => reject(new TypeError("network")));
    sending.addEventListener("load", () => {
      let document = {};
      try { document = JSON.parse(sending.responseText); } catch { /* said by its status alone */ }
      if (sending.status < 300) resolve(document);
      else reject(new Problem(sending.status, document));
    });
    sending.send(form);
  });
}

async function send() {
  const form = new FormData();
  const wanted = options?.value() ?? {};
  form.append("source", chosen.source);
  form.append("reference", chosen.reference);
  form.append("options", JSON.stringify(wanted));
  for (const file of chosen.resources) form.append("resources", file);
  const label = byId("submit").elements.label.value.trim();
  if (label) form.append("label", label);
  const bar = h("progress", { max: 1, value: 0, "aria-label": "upload" });
  byId("submit-state").replaceChildren(h("p", { class: "hint" }, "Sending …"), bar);
  return post(form, (share) => { bar.value = share; });
}

async function submit(event) {
  event.preventDefault();
  byId("send").disabled = true;
  try {
    let job;
    try {
      job = await send();
    } catch (error) {
      if (!(error instanceof Problem) || error.status !== 401) throw error;
      await askForKey();
      job = await send();
    }
    Object.assign(chosen, { source: null, reference: null, resources: [] });
    for (const input of document.querySelectorAll(".slot input")) input.value = "";
    tell("good", `Accepted: ${job.source.name} → ${job.reference.name}. `, h("a", { href: `/jobs/${job.id}` }, "Watch this job"));
  } catch (error) {
    tell("error", said(error));
  } finally {
    show();
  }
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

export function startSubmitting() {
  const drop = byId("drop");
  for (const slot of drop.querySelectorAll(".slot")) {
    slot.querySelector("input").addEventListener("change", (event) => take([...event.target.files], slot.dataset.slot));
  }
  // The whole page is a place to drop on: nobody loses the page over an inch.
  let over = 0;
  addEventListener("dragenter", (event) => { event.preventDefault(); over += 1; drop.classList.add("over"); });
  addEventListener("dragleave", () => { over -= 1; if (over <= 0) drop.classList.remove("over"); });
  addEventListener("dragover", (event) => event.preventDefault());
  addEventListener("drop", (event) => {
    event.preventDefault();
    over = 0;
    drop.classList.remove("over");
    take([...event.dataTransfer.files], event.target.closest?.(".slot")?.dataset.slot);
  });
  byId("swap").addEventListener("click", () => {
    [chosen.source, chosen.reference] = [chosen.reference, chosen.source];
    show();
  });
  byId("options").addEventListener("toggle", showOptions);
  byId("submit").addEventListener("submit", submit);
  show();
}
