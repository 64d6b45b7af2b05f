// One upload at a time: how far it is, how it is stopped, and that nobody leaves the page without being asked.

import { authorization, Problem } from "meshcone/api";
import { byId, h } from "meshcone/dom";

/** That an upload was stopped by whoever began it. */
export class Stopped extends Error {
  constructor() {
    super("It was stopped before it was whole.");
  }
}

let line = null;  // what tells of the upload that is under way

const stay = (event) => event.preventDefault();  // the browser asks before it leaves the page

/** Tell of the upload in the dialog, or on the page while that is closed. */
export function tellOfUpload() {
  if (line) byId(byId("new-dialog").open ? "submit-state" : "sent").replaceChildren(line);
}

/** Do what posts forms, as `act` does with the function it is given, while the upload is told of by some words. */
export async function uploading(words, act) {
  const stopping = new AbortController();
  const bar = h("progress", { max: 1, value: 0, "aria-label": "upload" });
  const stop = h("button", { type: "button", onclick: () => stopping.abort() }, "Stop");
  line = h("div", { class: "upload" }, h("p", { class: "hint" }, words), h("div", { class: "row" }, bar, stop));
  addEventListener("beforeunload", stay);
  tellOfUpload();
  try {
    return await act((form) => post(form, { bar, stop, signal: stopping.signal }));
  } finally {
    removeEventListener("beforeunload", stay);
    line.remove();
    line = null;
  }
}

/** Post a form; fetch would not say how much of it has been sent. */
function post(form, { bar, stop, signal }) {
  return new Promise((resolve, reject) => {
    const sending = new XMLHttpRequest();
    sending.open("POST", "/v1/jobs");
    for (const [name, value] of Object.entries(authorization())) sending.setRequestHeader(name, value);
    sending.upload.addEventListener("progress", (event) => { if (event.lengthComputable) bar.value = event.loaded / event.total; });
    // What has been sent whole is a job, or is about to be one, whatever is stopped here.
    sending.upload.addEventListener("load", () => { stop.disabled = true; });
    sending.addEventListener("error", () => reject(new TypeError("network")));
    sending.addEventListener("load", () => {
      let document = {};
      try { document = JSON.parse(sending.responseText); } catch { /* said by its status alone */ }
      if (sending.status < 300) resolve(document);
      else reject(new Problem(sending.status, document));
    });
    stop.disabled = false;
    signal.addEventListener("abort", () => { sending.abort(); reject(new Stopped()); });
    sending.send(form);
  });
}
