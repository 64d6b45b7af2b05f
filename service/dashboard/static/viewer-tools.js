// What can be chosen about the view: how the meshes are laid out, what colours them, and what else.

import { h, svg } from "meshcone/dom";

export const TITLES = { input: "Source", refined: "Refined", reference: "Reference" };
const LAYOUTS = [["side", "Side by side"], ["one", "One"], ["wipe", "Wipe"], ["blink", "Blink"], ["overlay", "Overlay"]];

const ICONS = {
  wire: "M4 7 12 3l8 4v10l-8 4-8-4ZM4 7l8 4 8-4M12 11v10",
  pins: "M12 21s6.5-6.2 6.5-11.2A6.5 6.5 0 0 0 5.5 9.8C5.5 14.8 12 21 12 21ZM12 12a2.3 2.3 0 1 0 0-4.6 2.3 2.3 0 0 0 0 4.6Z",
  measure: "M3 17 17 3l4 4L7 21ZM7 13l2 2M10 10l2.5 2.5M13 7l2 2",
  picture: "M4 7h3l2-3h6l2 3h3v13H4ZM12 17a4 4 0 1 0 0-8 4 4 0 0 0 0 8Z",
  home: "M4 11 12 4l8 7M6 9.5V20h12V9.5",
};

/** Buttons of which one is pressed. */
export function choice(label, entries, chosen, onChoose) {
  const buttons = entries.map(([value, text]) => h("button", {
    type: "button", "data-value": value, "aria-pressed": String(value === chosen),
    onclick: (event) => {
      for (const button of buttons) button.setAttribute("aria-pressed", String(button === event.currentTarget));
      onChoose(value);
    },
  }, text));
  return h("div", { class: "choice", role: "group", "aria-label": label }, buttons);
}

/** Layouts with, where one or two meshes are chosen, which; `onChoose` is told of changes of the state. */
export function layoutTools(names, state, onChoose) {
  const pairs = [["input", "refined"], ["refined", "reference"], ["input", "reference"]].filter((pair) => pair.every((name) => names.includes(name)));
  const which = h("select", { "aria-label": "Which meshes", onchange: () => onChoose(values()[Number(which.value)]) });
  let { layout } = state;
  const values = () => (layout === "one" ? names.map((shown) => ({ shown })) : pairs.map((over) => ({ over })));
  const fill = () => {
    which.hidden = layout === "side" || (layout !== "one" && pairs.length === 1);
    const chosen = layout === "one" ? names.indexOf(state.shown) : pairs.findIndex((pair) => pair.join() === state.over.join());
    which.replaceChildren(...values().map(({ shown, over }, index) => h("option", { value: String(index), selected: index === chosen }, shown ? TITLES[shown] : over.map((name) => TITLES[name]).join(" | "))));
  };
  fill();
  return [choice("Layout", LAYOUTS, layout, (next) => { layout = next; onChoose({ layout }); fill(); }), which];
}

/** A button with a sign; one that stays pressed says so. */
function button(name, text, onClick, pressed = null) {
  return h("button", {
    type: "button", class: "icon", title: text, "aria-label": text, "aria-pressed": pressed === null ? null : String(pressed),
    onclick: (event) => {
      const it = event.currentTarget;
      if (pressed !== null) it.setAttribute("aria-pressed", String(it.getAttribute("aria-pressed") !== "true"));
      onClick(it.getAttribute("aria-pressed") === "true");
    },
  }, svg("svg", { viewBox: "0 0 24 24", "aria-hidden": "true" }, svg("path", { d: ICONS[name], fill: "none", stroke: "currentColor", "stroke-width": 1.7, "stroke-linejoin": "round", "stroke-linecap": "round" })));
}

/** What else there is, in a column at the edge of the view. */
export const viewButtons = ({ onWire, onPins, onMeasure, onPicture, onHome }) => h("div", { class: "icons", role: "toolbar", "aria-label": "View" },
  button("wire", "Wireframe", onWire, false),
  button("pins", "Pins", onPins, true),
  button("measure", "Measure between two points", onMeasure, false),
  button("picture", "Save a picture", onPicture),
  button("home", "Start over", onHome));
