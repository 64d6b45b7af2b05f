// Measuring the distance between two points of the meshes: two clicks, or two times Enter in the middle.

import { h } from "meshcone/dom";
import { number } from "meshcone/format";

const DRAG = 4;  // pixels that a hand may move in a click

export class Measuring {
  /** @param {Viewer} viewer  @param {number} radius model units for one of the frame  @param {string} unit */
  constructor(viewer, radius, unit) {
    Object.assign(this, { viewer, radius, unit, on: false, points: [] });
    this.element = h("output", { class: "measured", hidden: true, "data-testid": "measured" });
    const { canvas } = viewer;
    canvas.addEventListener("pointerdown", ({ offsetX, offsetY }) => { this.down = { x: offsetX, y: offsetY }; });
    canvas.addEventListener("pointerup", ({ offsetX, offsetY }) => {
      if (this.on && this.down && Math.hypot(offsetX - this.down.x, offsetY - this.down.y) <= DRAG) this.take(offsetX, offsetY);
    });
    canvas.addEventListener("keydown", ({ key }) => {
      if (!this.on || key !== "Enter") return;
      const [{ clip }] = viewer.panes();
      this.take(clip.x + clip.width / 2, clip.y + clip.height / 2);
    });
  }

  toggle(on) {
    this.on = on;
    this.points = [];
    this.viewer.canvas.classList.toggle("measuring", on);
    this.viewer.connect([]);
    this.#tell(on ? "Click two points of the meshes." : "");
  }

  take(x, y) {
    const point = this.viewer.pick(x, y);
    if (!point) return this.#tell("There is no mesh; click on one.");
    this.points = this.points.length === 2 ? [point] : [...this.points, point];
    if (this.points.length === 1) {
      this.viewer.connect([[point, point]]);
      return this.#tell("And the second point.");
    }
    const [from, to] = this.points;
    this.viewer.connect([[from, to]]);
    const apart = from.map((value, axis) => (to[axis] - value) * this.radius);
    return this.#tell(`${number(Math.hypot(...apart), 4)} ${this.unit} apart: ${["x", "y", "z"].map((axis, index) => `${axis} ${number(apart[index])}`).join(", ")}`);
  }

  #tell(text) {
    this.element.hidden = text === "";
    this.element.textContent = text;
  }
}
