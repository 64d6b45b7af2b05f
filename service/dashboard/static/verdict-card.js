// Does it pass, and if not, why: what a page says first.

import { h, svg } from "meshcone/dom";
import { number } from "meshcone/format";
import { outcomeSentence, verdictSentence, withinSentence } from "meshcone/job-words";

const ORDER = { fail: 0, not_tested: 1, pass: 2 };
const SHOWN = 2;  // checks that did not pass; the tab has all
const JUST_OVER = 1.05;  // times the bound, below which two digits would say that it is kept
const SIGNS = { pass: "M5 12.5 10 17.5 19.5 7", fail: "M7 7 17 17M17 7 7 17", not_tested: "M12 6v8M12 17.6v.4" };

/** A sign for a state, beside words that say the same. */
export const sign = (kind) => svg("svg", { class: `sign ${kind}`, viewBox: "0 0 24 24", "aria-hidden": "true" },
  svg("path", { d: SIGNS[kind] ?? SIGNS.not_tested, fill: "none", stroke: "currentColor", "stroke-width": 2.4, "stroke-linecap": "round", "stroke-linejoin": "round" }));

const rank = ({ status, severity }) => 2 * ORDER[status] + (severity === "warning" ? 1 : 0);

/** The checks of a report, those that did not pass first, and of these the errors. */
export const sortedChecks = (report) => [...(report.gates?.checks ?? [])].sort((a, b) => rank(a) - rank(b));

/** What a check found, and that it is a warning where it is one. */
export const checkWords = ({ words, severity }) => `${words}${severity === "warning" ? " (a warning)" : ""}`;

/** By how much a value is beyond its bound, in words; null where a ratio says nothing. */
export function excess({ bound, status, value, limit }) {
  if (status !== "fail" || !bound.startsWith("max") || typeof value !== "number" || !(limit > 0)) return null;
  const times = value / limit;
  if (times < JUST_OVER) return "just over";
  return times > 1000 ? "over 1000 × allowed" : `${number(times, 2)} × allowed`;
}

/** A button that flies to where a check was decided. */
export const showButton = (position, words, goTo) => position && goTo && h("button", { type: "button", class: "small to-place", "aria-label": `Show where: ${words}`, onclick: () => goTo(position) }, "Show");

function reason(check, goTo) {
  const beyond = excess(check);
  return h("li", null, sign(check.status),
    h("span", { class: "grow" }, checkWords(check)),
    beyond && h("span", { class: "beyond" }, beyond),
    showButton(check.position, check.words, goTo));
}

const capitalised = (text) => `${text[0].toUpperCase()}${text.slice(1)}.`;

/**
 * The verdict of the gates if there are any, what is proven, and what became of the mesh.
 * @param {Object} report
 * @param {{goTo: ?Function, openGates: Function}} around `goTo` takes a place in model units
 */
export function verdictCard(report, { goTo, openGates }) {
  const { gates } = report;
  const open = sortedChecks(report).filter(({ status }) => status !== "pass");
  const kind = gates?.verdict ?? report.outcome ?? "";
  const statement = report.statement && capitalised(report.statement);
  const more = open.length - SHOWN;
  return h("section", { class: `card verdict band ${kind}`, "aria-label": "Verdict", "data-testid": "verdict" },
    gates && sign(kind),
    h("div", { class: "grow" },
      gates && h("div", { class: "row" }, h("p", { class: "headline grow" }, verdictSentence(gates)),
        more > 1 && h("button", { type: "button", class: "small", onclick: openGates }, `${more} more checks that did not pass`)),
      statement && h("p", { class: gates ? "statement" : "headline", "data-testid": "statement" }, statement),
      h("p", { class: gates || statement ? "soft" : "headline" }, outcomeSentence(report)),
      report.within && h("p", { "data-testid": "within" }, withinSentence(report.within)),
      !gates && h("p", { class: "soft" }, verdictSentence(null)),
      open.length > 0 && h("ul", { class: "reasons" }, open.slice(0, more === 1 ? SHOWN + 1 : SHOWN).map((check) => reason(check, goTo)))));
}
