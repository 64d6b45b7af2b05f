// Which jobs are shown, in which order, and which batch is open: all of it is in the link.

import { byId, h } from "meshcone/dom";

// Each is a part of the jobs that the API can list by one value.
const PARTS = [
  { kind: "all", title: "All" },
  { kind: "fail", title: "Fail", verdict: "fail" },
  { kind: "failed", title: "Error", state: "failed" },
  { kind: "not_tested", title: "Not tested", verdict: "not_tested" },
  { kind: "pass", title: "Pass", verdict: "pass" },
  { kind: "running", title: "Running", state: "running" },
  { kind: "queued", title: "Queued", state: "queued" },
  { kind: "canceled", title: "Canceled", state: "canceled" },
];
const NAMES = ["name", "label", "state", "verdict", "order"];
const OPEN = "batch";  // whose jobs are shown below it
const TYPING = 250;  // milliseconds without a key after which a search begins

export class JobFilters {
  /** @param {Function} onChange is called when other jobs are wanted */
  constructor(onChange) {
    this.onChange = onChange;
    this.form = byId("filters");
    this.buttons = new Map(PARTS.map((part) => [part, this.button(part)]));
    byId("tally").append(...this.buttons.values());
    this.read();
    let typing = 0;
    this.form.addEventListener("input", () => {
      clearTimeout(typing);
      typing = setTimeout(() => this.set({ name: this.form.elements.name.value.trim(), order: this.form.elements.order.checked ? "failures" : "" }), TYPING);
    });
    this.form.addEventListener("submit", (event) => event.preventDefault());
    addEventListener("popstate", () => { this.read(); onChange(); });
  }

  button(part) {
    return h("button", { type: "button", class: `part ${part.kind}`, "data-kind": part.kind, onclick: () => this.set({ state: part.state, verdict: part.verdict }) },
      h("span", null, part.title), " ", h("strong", null, "–"));
  }

  /** Take the filters from the address. */
  read() {
    const query = new URLSearchParams(location.search);
    this.wanted = Object.fromEntries([...NAMES, OPEN].map((name) => [name, query.get(name) ?? ""]));
    this.form.elements.name.value = this.wanted.name;
    this.form.elements.order.checked = this.wanted.order === "failures";
    this.show();
  }

  set(changes) {
    this.write(changes);
    this.show();
    this.onChange();
  }

  /** Note which batch is open; the same jobs are wanted. */
  open(batch) {
    this.write({ [OPEN]: batch });
  }

  write(changes) {
    this.wanted = { ...this.wanted, ...changes };
    const query = this.query();
    if (this.wanted[OPEN]) query.set(OPEN, this.wanted[OPEN]);
    history.pushState(null, "", query.size ? `?${query}` : location.pathname);
  }

  /** What to ask the API for. */
  query() {
    const query = new URLSearchParams();
    for (const name of NAMES) if (this.wanted[name]) query.set(name, this.wanted[name]);
    return query;
  }

  get narrow() {
    return NAMES.some((name) => name !== "order" && this.wanted[name]);
  }

  /** Show how many jobs each part has; a search has no counts. */
  count(counts) {
    for (const [{ kind }, button] of this.buttons) {
      const count = counts[kind];
      button.querySelector("strong").textContent = this.wanted.name ? "–" : count.toLocaleString("en");
      button.classList.toggle("none", !this.wanted.name && count === 0);
    }
  }

  show() {
    const { state, verdict, label } = this.wanted;
    const pressed = PARTS.find((part) => (part.state ?? "") === (state ?? "") && (part.verdict ?? "") === (verdict ?? ""));
    for (const [part, button] of this.buttons) button.setAttribute("aria-pressed", String(part === pressed));
    byId("narrowed").replaceChildren(
      ...(pressed ? [] : [this.tag([state, verdict].filter(Boolean).join(", "), { state: "", verdict: "" })]),
      ...(label ? [this.tag(label, { label: "" }), h("a", { href: `/compare?${new URLSearchParams({ label })}` }, "Compare its runs")] : []));
  }

  tag(text, without) {
    return h("span", { class: "tag chosen" }, text, h("button", { type: "button", class: "quiet", "aria-label": `Do not filter by ${text}`, onclick: () => this.set(without) }, "✕"));
  }
}
