// What whole assets are, and what changed between them.

import { h } from "meshcone/dom";
import { number, words } from "meshcone/format";

const SIDES = ["source", "refined", "reference"];
const ROWS = 100;

const isShown = (value) => value === null || ["number", "boolean", "string"].includes(typeof value) || (Array.isArray(value) && value.every((each) => typeof each === "string"));

const shown = (value) => (value === null ? "not tested" : Array.isArray(value) ? value.join(", ") || "none" : number(value));

/** One family as a table that opens: its values, under the names gates use, for each mesh. */
function family(name, asset, sides) {
  // A value may be a list of words on one side and of records on another, as with nothing in it.
  const of = (side, value) => asset[side][name]?.[value];
  const values = Object.keys(asset[sides[0]][name]).filter((value) => sides.every((side) => of(side, value) === undefined || isShown(of(side, value))));
  return h("details", { "data-family": name },
    h("summary", null, words(name)),
    h("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": words(name) }, h("table", { class: "metrics" },
      h("thead", null, h("tr", null, h("th", { scope: "col" }, "Value"), sides.map((side) => h("th", { scope: "col", class: "number" }, words(side))))),
      h("tbody", null, values.map((value) => h("tr", null,
        h("th", { scope: "row", title: `asset.${name}.${value}` }, words(value)),
        sides.map((side) => h("td", { class: "number" }, shown(of(side, value))))))))));
}

/** What each file is: a table for each family of values. */
export function assetCard(asset) {
  const sides = SIDES.filter((side) => asset[side]);
  return h("section", { class: "card", "aria-labelledby": "audit-title", "data-testid": "audit" },
    h("h2", { id: "audit-title" }, "Whole assets"),
    Object.keys(asset.source).map((name) => family(name, asset, sides)));
}

/** What was lost, added, renamed, moved or altered besides the surface. */
export function changesCard({ rows }) {
  if (!rows.length) return null;
  return h("section", { class: "card", "aria-labelledby": "changes-title", "data-testid": "changes" },
    h("h2", { id: "changes-title" }, "What else changed"),
    h("ul", { class: "told" }, rows.slice(0, ROWS).map((row) => h("li", null, h("span", { class: "chip" }, row.kind), h("span", { class: "grow" }, row.words)))),
    rows.length > ROWS && h("p", { class: "hint" }, `The report lists ${rows.length} of them.`));
}
