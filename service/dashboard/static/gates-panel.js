// Every check of the gates, and the warnings beside them.

import { boundWords } from "meshcone/bounds";
import { h } from "meshcone/dom";
import { chip } from "meshcone/job-words";
import { checkWords, excess, showButton, sortedChecks } from "meshcone/verdict-card";

function row(report, check, goTo) {
  const asked = `${check.key} ${boundWords(report, check)}`;
  return h("li", { "data-status": check.status }, chip(check.status),
    h("span", { class: "grow" }, checkWords(check), h("code", { class: "soft asked" }, asked)),
    h("span", { class: "beyond" }, excess(check)),
    showButton(check.position, check.words, goTo));
}

function checksCard(report, goTo) {
  if (!report.gates) {
    return h("section", { class: "card empty" }, h("strong", null, "No gates were set"), "Gates are bounds on any value of the report. With some, this page begins with a verdict.");
  }
  return h("section", { class: "card", "aria-labelledby": "checks-title" },
    h("h2", { id: "checks-title" }, "Checks"),
    h("ul", { class: "told", "data-testid": "checks" }, sortedChecks(report).map((check) => row(report, check, goTo))));
}

function warningsCard({ warnings }) {
  if (!warnings.length) return null;
  return h("section", { class: "card", "aria-labelledby": "warnings-title" },
    h("h2", { id: "warnings-title" }, "Warnings"),
    h("ul", { class: "told" }, warnings.map((warning) => h("li", null, h("span", { class: "grow" }, warning.words ?? warning), warning.code && h("code", { class: "soft" }, warning.code)))));
}

/** What was asked of the asset, and what else a person should know. */
export const gatesPanel = (report, goTo) => [checksCard(report, goTo), warningsCard(report)];
