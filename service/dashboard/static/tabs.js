// Tabs after the pattern of WAI-ARIA: arrow keys choose, and the link remembers which is open.

import { inLink, putInLink } from "meshcone/address";
import { h } from "meshcone/dom";

const STEPS = { ArrowRight: 1, ArrowLeft: -1, Home: -Infinity, End: Infinity };

/**
 * Tabs over panels.
 * @param {string} label of all of them
 * @param {{id: string, title: string, badge: ?Node, content: Node[]}[]} entries those without content are left out
 * @returns {{element: HTMLElement, open: Function}} `open` takes the id of a tab
 */
export function tabs(label, entries) {
  const shown = entries.map((entry) => ({ ...entry, content: entry.content.filter(Boolean) })).filter(({ content }) => content.length);
  const buttons = shown.map(({ id, title, badge }) => h("button", {
    type: "button", role: "tab", id: `tab-${id}`, "aria-controls": `panel-${id}`, onclick: () => open(id), onkeydown: step,
  }, title, badge));
  const panels = shown.map(({ id, content }) => h("div", { role: "tabpanel", id: `panel-${id}`, class: "panel", "aria-labelledby": `tab-${id}`, tabindex: "0" }, content));

  function select(id) {
    const chosen = Math.max(0, shown.findIndex((entry) => entry.id === id));
    for (const [index, button] of buttons.entries()) {
      button.setAttribute("aria-selected", String(index === chosen));
      button.tabIndex = index === chosen ? 0 : -1;
      panels[index].hidden = index !== chosen;
    }
    return buttons[chosen];
  }

  function open(id) {
    select(id).focus({ preventScroll: true });
    putInLink({ tab: id });
  }

  function step(event) {
    if (!(event.key in STEPS)) return;
    event.preventDefault();
    const last = buttons.length - 1;
    const to = buttons.indexOf(event.currentTarget) + STEPS[event.key];
    const wrapped = Number.isFinite(to) ? (to + buttons.length) % buttons.length : Math.min(Math.max(to, 0), last);
    open(shown[wrapped].id);
    buttons[wrapped].scrollIntoView({ block: "nearest", inline: "nearest" });
  }

  select(inLink("tab"));
  return { element: h("section", { class: "tabs" }, h("div", { role: "tablist", "aria-label": label, class: "tablist" }, buttons), panels), open };
}
