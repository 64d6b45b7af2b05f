// What the viewer shows, in the link: who opens it sees the same.

import { inLink, putInLink } from "meshcone/address";

const DIGITS = 4;
const PAUSE = 250;  // milliseconds after the last move

/** What a link asks of the viewer, as far as the surfaces there are allow it. */
export function viewInLink(names, colours) {
  const [layout, ...between] = (inLink("view") ?? "").split(/[:,]/);
  const known = between.every((name) => names.includes(name));
  const asked = {};
  if (["side", "one", "wipe", "blink", "overlay"].includes(layout) && known) {
    asked.layout = layout;
    if (layout === "one" && between.length === 1) asked.shown = between[0];
    if (between.length === 2) asked.over = between;
  }
  const colour = inLink("colour");
  if (colours.includes(colour)) asked.colour = colour;
  const camera = (inLink("camera") ?? "").split(",").map(Number);
  if (camera.length === 8 && camera.every(Number.isFinite)) asked.camera = camera;
  return asked;
}

let timer = 0;

/** Write what the viewer shows into the link, once it has come to rest. */
export function keepInLink({ layout, shown, over, colour }, camera) {
  clearTimeout(timer);
  timer = setTimeout(() => putInLink({
    view: layout === "side" ? null : `${layout}:${layout === "one" ? shown : over.join(",")}`,
    colour,
    camera: camera.map((value) => Number(value.toPrecision(DIGITS))).join(","),
  }), PAUSE);
}
