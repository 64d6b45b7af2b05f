// Pins over the canvas: each names what was found there, and flies to it.

import { h } from "meshcone/dom";

/** Which surfaces a finding is on, of those there are. */
const surfacesOf = ({ on }, names) => (on === "reference" ? ["reference"] : [names.includes("refined") ? "refined" : "input"]);

export class Pins {
  /**
   * @param {{title: string, on: string, position: number[], fails: boolean}[]} found
   * @param {Function} into takes a place in model units into the frame
   * @param {Function} onChoose told of the number of a finding
   */
  constructor(found, into, onChoose) {
    this.found = found.map((finding) => ({ ...finding, point: into(finding.position) }));
    this.onChoose = onChoose;
    this.element = h("div", { class: "pins", "data-testid": "pins" });
    this.chosen = -1;
  }

  /** Put the pins where the viewer has drawn their places. */
  place(viewer) {
    const wanted = this.found.flatMap((finding, index) => viewer.project(finding.point, surfacesOf(finding, viewer.names)).map((at) => ({ ...at, finding, index })));
    while (this.element.children.length > wanted.length) this.element.lastChild.remove();
    while (this.element.children.length < wanted.length) this.element.append(h("button", { type: "button", class: "pin", tabindex: "-1" }, h("span", { class: "pin-number" }), h("span", { class: "pin-title" })));
    for (const [number, { x, y, seen, finding, index }] of wanted.entries()) {
      const pin = this.element.children[number];
      pin.hidden = !seen;
      pin.style.transform = `translate(${x}px, ${y}px)`;
      pin.classList.toggle("fails", finding.fails);
      pin.classList.toggle("chosen", index === this.chosen);
      pin.classList.toggle("behind", behind(finding.point, viewer.orbit));
      pin.classList.toggle("leftward", x > this.element.clientWidth - 180);
      if (pin.dataset.index === String(index)) continue;
      pin.dataset.index = String(index);
      pin.firstChild.textContent = String(index + 1);
      pin.lastChild.textContent = finding.title;
      pin.setAttribute("aria-label", `${index + 1}: ${finding.title}`);
      pin.onclick = () => this.onChoose(index);
    }
  }
}

/** Whether a point is on the far side of the middle, as far as a convex body would hide it. */
function behind(point, orbit) {
  const back = orbit.back();
  return point[0] * back.x + point[1] * back.y + point[2] * back.z < -0.15 * Math.hypot(...point);
}
