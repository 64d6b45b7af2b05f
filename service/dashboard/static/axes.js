// Which way the axes of the model point, in a corner of the view.

import { svg } from "meshcone/dom";

const REACH = 20;
const AXES = [["x", 0], ["y", 1], ["z", 2]];

export class Axes {
  constructor() {
    this.parts = AXES.map(([name, axis]) => ({ name, axis, line: svg("line", { class: `axis-${name}` }), text: svg("text", { class: `axis-${name}`, "text-anchor": "middle" }, name) }));
    this.element = svg("svg", { class: "axes", viewBox: "-30 -30 60 60", "aria-hidden": "true" }, this.parts.map(({ line, text }) => [line, text]));
  }

  /** Turn with a camera. */
  place(orbit) {
    for (const { axis, line, text } of this.parts) {
      const { x, y } = orbit.seen(axis);
      line.setAttribute("x2", REACH * x);
      line.setAttribute("y2", -REACH * y);
      text.setAttribute("x", (REACH + 6) * x);
      text.setAttribute("y", 4 - (REACH + 6) * y);
    }
  }
}
