// What the colours mean: a histogram over the scale that they are taken from, with the threshold.

import { spread } from "meshcone/corners";
import { h, svg } from "meshcone/dom";
import { number } from "meshcone/format";
import { colourOf, cssColour } from "meshcone/palette";
import { areas, faceAreas, quantile } from "meshcone/scene-file";

const SHOWN = 0.99;  // share of the vertices within a scale: one spike is not to pale all others
const BINS = 60;
const HEIGHT = 34;
const TICKS = [0, 0.25, 0.5, 0.75, 1];

const TITLES = { contrast: "Colour difference", deviation: "Deviation", signed: "Inside − · + outside", tension: "Cone tension" };

const NO_LENGTHS = { tension: "objective per unit of length", contrast: "CIEDE2000; from about 1 on it can be seen" };
const LEAST_CONTRAST = 2;  // a scale that ends below it would show what nobody sees

export class Legend {
  /** @param {number} radius model units for one unit of the frame  @param {string} unit of the model  @param {Function} onChange told of a new scale */
  constructor(radius, unit, onChange) {
    Object.assign(this, { radius, unit, onChange });
    this.element = h("div", { class: "legend" });
  }

  /** Learn what the scales can be taken from. */
  take(preview, thresholds) {
    const { input, refined } = preview.surfaces;
    const tops = [["input", "99 % of source", quantile(input.deviation, SHOWN)]];
    if (refined) tops.push(["refined", "99 % of refined", quantile(refined.deviation, SHOWN)]);
    tops.push(["largest", "the largest", Math.max(quantile(input.deviation, 1), refined ? quantile(refined.deviation, 1) : 0)]);
    this.tops = tops.map(([name, text, top]) => ({ name, text, top: top > 0 ? top : 1e-9 }));
    this.chosen = this.tops[0];
    this.threshold = thresholds.deviation;
    this.contrastThreshold = thresholds.contrast;
    this.judged = refined ?? input;
    this.weights = areas(this.judged);
    if (this.judged.contrast) this.contrast = spread(this.judged.contrast);
    this.name = refined ? "refined mesh" : "source";
  }

  /** Show the scale of a way of colouring and return it; null where there is none. */
  show(colour) {
    this.colour = colour;
    this.scale = this.#scaleOf(colour);
    this.element.hidden = this.scale === null;
    this.element.replaceChildren(...(this.scale === null ? [] : this.#shown()));
    return this.scale;
  }

  /** What a picture says of the scale; null where there is none. */
  ends() {
    if (this.scale === null) return null;
    const { low, top, threshold } = this.scale;
    const { told, words } = this.#told();
    return { from: told(low), to: told(top), words: `${TITLES[this.colour]}, ${words}${threshold === null ? "" : `; threshold ${told(threshold)}`}` };
  }

  /** How values are written, and in what unit. */
  #told() {
    const isLength = !(this.colour in NO_LENGTHS);
    return { isLength, told: (value) => number(isLength ? value * this.radius : value), words: NO_LENGTHS[this.colour] ?? this.unit };
  }

  #scaleOf(colour) {
    // The threshold is always on the scale.
    const top = Math.max(this.chosen.top, this.threshold === null ? 0 : this.threshold * 1.25);
    if (colour === "deviation") return { low: 0, top, threshold: this.threshold };
    if (colour === "signed") return { low: -top, top, threshold: null };
    if (colour === "contrast") return { low: 0, top: Math.max(quantile(this.contrast.values, SHOWN), 1.25 * (this.contrastThreshold ?? 0), LEAST_CONTRAST), threshold: this.contrastThreshold };
    if (colour === "tension") return { low: 0, top: quantile(this.judged.tension, 1) || 1, threshold: null };
    return null;
  }

  #shown() {
    const { colour, scale } = this;
    const { isLength, told, words } = this.#told();
    this.plot = this.#plot(scale, told, words);
    // Whichever meshes are shown, the bars are of this one.
    return [
      h("div", { class: "legend-title" }, h("strong", null, TITLES[colour]), h("span", { class: "soft" }, words), h("span", { class: "soft" }, `bars: ${this.name}`)),
      this.plot,
      ...(isLength ? [this.#tops(), colour === "deviation" && this.#bound()].filter(Boolean) : []),
    ];
  }

  /** Shares of the area as bars in the colours of their values: legend and histogram in one. */
  #plot(scale, told, words) {
    const { low, top, threshold } = scale;
    const shares = this.colour === "contrast" ? histogram(this.contrast.values, this.#contrastWeights(), scale) : histogram(this.judged[this.colour], this.weights, scale);
    const most = Math.max(...shares, 1e-12);
    const bars = shares.map((share, bin) => {
      // Most of the area is near: a root keeps the rest in sight.
      const height = share > 0 ? Math.max(1.5, (HEIGHT - 8) * Math.sqrt(share / most)) : 0;
      const fill = cssColour(colourOf(low + ((bin + 0.5) / BINS) * (top - low), scale));
      return [svg("rect", { class: "bar-of", x: bin, y: HEIGHT - 7 - height, width: 0.86, height, fill }), svg("rect", { x: bin, y: HEIGHT - 6, width: 1.02, height: 6, fill })];
    });
    const label = `Shares of the area of the ${this.name} from ${told(low)} to ${told(top)} ${words}`;
    const mark = threshold === null ? null : (threshold - low) / (top - low);
    return h("div", { class: "scale", "data-testid": "scale" },
      svg("svg", { viewBox: `0 0 ${BINS} ${HEIGHT}`, preserveAspectRatio: "none", role: "img", "aria-label": label }, bars),
      TICKS.map((share) => h("span", { class: `tick${share === 0 ? " first" : share === 1 ? " last" : ""}${share % 0.5 ? " minor" : ""}`, style: { left: `${100 * share}%` } }, told(low + share * (top - low)))),
      mark !== null && h("span", { class: mark > 0.6 ? "mark flip" : "mark", "data-testid": "threshold", style: { left: `${100 * mark}%` } }, `threshold ${told(threshold)}`));
  }

  /** A share of its triangle's area for each value of the contrast. */
  #contrastWeights() {
    const { each, values } = this.contrast;
    const faces = faceAreas(this.judged);
    return Float64Array.from(values, (_, index) => faces[Math.floor(index / each)] / each);
  }

  #tops() {
    const scale = h("select", { "aria-label": "Scale", onchange: () => { this.chosen = this.tops[Number(scale.value)]; this.#changed(); } },
      this.tops.map(({ text, name }, index) => h("option", { value: String(index), selected: name === this.chosen.name }, text)));
    return h("label", null, "Up to ", scale);
  }

  #bound() {
    const input = h("input", {
      type: "number", step: "any", min: "0", placeholder: "none", value: this.threshold === null ? "" : String(Number((this.threshold * this.radius).toPrecision(4))),
      onchange: () => {
        const value = Number(input.value);
        this.threshold = input.value === "" || !(value > 0) ? null : value / this.radius;
        if (this.threshold === null) input.value = "";
        this.#changed();
      },
    });
    return h("label", null, "Threshold ", input);
  }

  /** Draw the scale anew; what it was changed with stays, for the focus is on it. */
  #changed() {
    this.scale = this.#scaleOf(this.colour);
    const { told, words } = this.#told();
    const plot = this.#plot(this.scale, told, words);
    this.plot.replaceWith(plot);
    this.plot = plot;
    this.onChange({ scale: this.scale });
  }
}

/** Shares of the weights by value, between the ends of a scale; what is beyond is in the last. */
function histogram(values, weights, { low, top }) {
  const bins = new Array(BINS).fill(0);
  let whole = 0;
  for (let index = 0; index < values.length; index += 1) {
    const bin = Math.floor((BINS * (values[index] - low)) / (top - low));
    bins[Math.min(Math.max(bin, 0), BINS - 1)] += weights[index];
    whole += weights[index];
  }
  return bins.map((weight) => (whole > 0 ? weight / whole : 0));
}
