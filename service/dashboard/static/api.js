// Talking to the server: with the key this tab knows, and errors that say what is wrong.

import { byId, h } from "meshcone/dom";

const KEY = "meshcone.key";

export class Problem extends Error {
  constructor(status, document) {
    const where = [document.file, document.place].filter(Boolean).join(", ");
    super(where ? `${where}: ${document.detail}` : document.detail ?? document.title ?? `the server answered ${status}`);
    this.status = status;
    this.document = document;
  }
}

let forgetful = "";  // where storage is forbidden, the key lives as long as the page

/** What a header can carry: with any other character every request would fail as if no server answered. */
const SENDABLE = /^[\x21-\x7e]+$/;

export function key() {
  let known = forgetful;
  try { known = sessionStorage.getItem(KEY) ?? forgetful; } catch { /* kept in this page */ }
  return SENDABLE.test(known) ? known : "";
}

function remember(value) {
  forgetful = value;
  try { sessionStorage.setItem(KEY, value); } catch { /* kept in this page */ }
}

let asking = null;

/** Ask for an API key, once however many requests wait for it. */
export function askForKey() {
  asking ??= new Promise((resolve) => {
    const dialog = byId("key-dialog");
    const form = dialog.querySelector("form");
    byId("key-refused").hidden = key() === "";
    byId("key-unsendable").hidden = true;
    form.reset();
    form.onsubmit = (event) => {
      if (SENDABLE.test(form.elements.key.value.trim())) return;
      event.preventDefault();
      byId("key-refused").hidden = true;
      byId("key-unsendable").hidden = false;
      form.elements.key.focus();
    };
    dialog.addEventListener("close", () => {
      remember(new FormData(form).get("key").trim());
      asking = null;
      resolve();
    }, { once: true });
    dialog.addEventListener("cancel", (event) => event.preventDefault());
    dialog.showModal();
  });
  return asking;
}

export const authorization = () => (key() ? { Authorization: `Bearer ${key()}` } : {});

async function problemOf(response) {
  let document = {};
  try { document = await response.json(); } catch { document = { detail: response.statusText }; }
  return new Problem(response.status, document);
}

/** Fetch; a 401 asks for a key and tries again. Throws Problem, or TypeError where no server answers. */
export async function request(path, options = {}) {
  for (;;) {
    const sent = key();
    const response = await fetch(path, { ...options, headers: { ...authorization(), ...options.headers } });
    if (response.status === 401) {
      if (sent === key()) await askForKey();
      continue;
    }
    if (!response.ok && response.status !== 304) throw await problemOf(response);
    return response;
  }
}

export const getJson = async (path, options) => (await request(path, options)).json();

/** What to tell a person about an error. */
export function said(error) {
  if (error instanceof Problem) return error.message;
  if (error instanceof TypeError) return "The server does not answer.";
  return String(error.message ?? error);
}

function parse(block) {
  const event = { type: "message", data: [], id: null };
  for (const line of block.split("\n")) {
    const [, field, value] = /^(\w*): ?(.*)$/.exec(line) ?? [];
    if (field === "event") event.type = value;
    else if (field === "data") event.data.push(value);
    else if (field === "id") event.id = value;
  }
  return { ...event, data: event.data.join("\n") };
}

const pause = (milliseconds, signal) => new Promise((resolve) => {
  const timer = setTimeout(resolve, milliseconds);
  signal?.addEventListener("abort", () => { clearTimeout(timer); resolve(); }, { once: true });
});

/**
 * Follow server-sent events until the signal aborts or a handler returns "done".
 * EventSource cannot send a key; this resumes after interruptions as it does, by Last-Event-ID.
 */
export async function follow(path, { onEvent, onState = () => {}, signal }) {
  let last = null;
  let wait = 500;
  while (!signal?.aborted) {
    try {
      const headers = { Accept: "text/event-stream", ...(last === null ? {} : { "Last-Event-ID": last }) };
      const response = await request(path, { headers, signal, cache: "no-store" });
      if (response.status === 204) return;
      onState("live");
      wait = 500;
      const reader = response.body.pipeThrough(new TextDecoderStream()).getReader();
      let pending = "";
      for (;;) {
        const { done, value } = await reader.read();
        if (done) break;
        pending = (pending + value).replaceAll("\r\n", "\n");
        const blocks = pending.split("\n\n");
        pending = blocks.pop();
        for (const event of blocks.map(parse)) {
          if (event.id !== null) last = event.id;
          if (event.data && onEvent(event) === "done") { await reader.cancel(); return; }
        }
      }
    } catch (error) {
      if (signal?.aborted) return;
      if (error instanceof Problem && error.status < 500 && error.status !== 429) throw error;
      onState("interrupted");
      wait = Math.min(wait * 2, 15000);
    }
    await pause(wait, signal);
  }
}

/** Fetch a file with the key and hand it to the browser, as the link would have. */
async function fetchFile(path, name) {
  const url = URL.createObjectURL(await (await request(path)).blob());
  h("a", { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 60000);
}

/** A link to a file; where a key is needed it is fetched with it, for a link cannot send one. */
export function download(path, name, label) {
  const refused = h("span", { class: "refused", role: "alert" });
  const link = h("a", { href: path, download: name, class: "file" }, label ?? name);
  link.addEventListener("click", async (event) => {
    if (!key()) return;
    event.preventDefault();
    refused.remove();
    try {
      await fetchFile(path, name);
    } catch (error) {
      refused.textContent = `This file cannot be had: ${said(error)}`;
      link.after(refused);
    }
  });
  return link;
}
