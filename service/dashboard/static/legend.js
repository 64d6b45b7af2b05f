// What the colours mean: a scale in model units, with the threshold marked.

import { h } from "meshcone/dom";
import { number } from "meshcone/format";
import { paintScale } from "meshcone/palette";
import { quantile } from "meshcone/scene-file";

const SHOWN = 0.99;  // share of the vertices within a scale: one spike is not to darken all others

export class Legend {
  /** @param {number} radius model units for one unit of the frame  @param {Function} onChange told of a new scale */
  constructor(radius, onChange) {
    this.radius = radius;
    this.onChange = onChange;
    this.colour = "shape";
    this.element = h("div", { class: "legend" });
  }

  /** Learn what the scales can be taken from. */
  take(preview, threshold) {
    const { input, refined } = preview.surfaces;
    const tops = [["input", "99 % of the input", quantile(input.deviation, SHOWN)]];
    if (refined) tops.push(["refined", "99 % of the refined", quantile(refined.deviation, SHOWN)]);
    tops.push(["largest", "the largest", Math.max(quantile(input.deviation, 1), refined ? quantile(refined.deviation, 1) : 0)]);
    this.tops = tops.map(([name, text, top]) => ({ name, text, top: top > 0 ? top : 1e-9 }));
    this.chosen = this.tops[0];
    this.threshold = threshold;
    this.tension = refined?.tension ? quantile(refined.tension, 1) : 0;
  }

  /** Show the scale of a way of colouring; returns its top and threshold, in the frame. */
  show(colour) {
    this.colour = colour;
    const make = { shape: () => this.#shape(), deviation: () => this.#deviation(), tension: () => this.#tension() }[colour];
    this.element.replaceChildren(...make());
    return colour === "tension" ? { top: this.tension || 1, threshold: null } : { top: this.#top(), threshold: this.threshold };
  }

  /** The threshold is always on the scale. */
  #top() {
    return Math.max(this.chosen.top, this.threshold === null ? 0 : this.threshold * 1.25);
  }

  #shape() {
    return [h("span", { class: "soft" }, "The meshes as they are. Choose Deviation to see how far they lie from each other.")];
  }

  #deviation() {
    const scale = h("select", { "aria-label": "Scale", onchange: () => { this.chosen = this.tops[Number(scale.value)]; this.onChange(this.show("deviation")); } },
      this.tops.map(({ text, name }, index) => h("option", { value: String(index), selected: name === this.chosen.name }, text)));
    const input = h("input", {
      type: "number", step: "any", min: "0", placeholder: "none", value: this.threshold === null ? "" : String(Number((this.threshold * this.radius).toPrecision(4))), style: { maxWidth: "6.5em" },
      onchange: () => {
        const value = Number(input.value);
        this.threshold = input.value === "" || !(value > 0) ? null : value / this.radius;
        this.onChange(this.show("deviation"));
      },
    });
    return [
      h("strong", null, "Deviation"),
      this.#scale(this.#top(), this.threshold, (value) => number(value * this.radius)),
      h("span", { class: "soft" }, "model units"),
      h("label", null, "Up to ", scale),
      h("label", null, "Threshold ", input),
    ];
  }

  #tension() {
    if (!this.tension) {
      return [h("span", null, h("strong", null, "Cone tension "), h("span", { class: "soft" }, "is zero everywhere: the optimum without any constraint satisfies all of them."))];
    }
    return [
      h("strong", null, "Cone tension"),
      this.#scale(this.tension, null, (value) => number(value)),
      h("span", { class: "soft" }, "how hard constraints hold each vertex: objective per unit of length"),
    ];
  }

  #scale(top, threshold, write) {
    const canvas = h("canvas", { role: "img", "aria-label": `colours from 0 to ${write(top)}` });
    const element = h("div", { class: "scale", "data-testid": "scale" }, canvas);
    paintScale(canvas, top, threshold);
    for (const share of [0, 0.25, 0.5, 0.75, 1]) {
      element.append(h("span", { class: share === 1 ? "tick last" : "tick", style: { left: `${100 * share}%` } }, write(share * top)));
    }
    if (threshold !== null) {
      const share = threshold / top;
      element.append(h("span", { class: share > 0.7 ? "mark flip" : "mark", "data-testid": "threshold", style: { left: `${100 * share}%` } }, `threshold ${write(threshold)}`));
    }
    return element;
  }
}
