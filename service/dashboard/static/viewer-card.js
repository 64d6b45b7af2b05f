// The card around the viewer: what to show and how, the scale, and the worst places.

import { h } from "meshcone/dom";
import { findingAt, findings } from "meshcone/findings";
import { number } from "meshcone/format";
import { unitOf } from "meshcone/job-words";
import { hasWebGl, threeJs } from "meshcone/library";
import { Legend } from "meshcone/legend";
import { readHeatmap, readPreview } from "meshcone/scene-file";
import { Viewer } from "meshcone/viewer";

const TITLES = { input: "Source", refined: "Refined", reference: "Reference" };
const KEYS = "Drag or use the arrow keys to turn, shift to move, the wheel or + and − to zoom, 0 to start over.";

/** Buttons of which one is pressed. */
function choice(label, entries, chosen, onChoose) {
  const buttons = entries.map(([value, text, disabled]) => h("button", {
    type: "button", "data-value": value, disabled, "aria-pressed": String(value === chosen),
    onclick: (event) => {
      for (const button of buttons) button.setAttribute("aria-pressed", String(button === event.currentTarget));
      onChoose(value);
    },
  }, text));
  return h("div", { class: "choice", role: "group", "aria-label": label }, buttons);
}

/** The bound that gates put on a distance, relative to the radius; null if there is none. */
function thresholdOf(report) {
  const bounds = (report.gates?.checks ?? []).filter(({ key, bound, limit }) => key.startsWith("point_to_surface.") && bound.startsWith("max") && typeof limit === "number");
  const check = bounds.find(({ key }) => key.endsWith(".max")) ?? bounds[0];
  if (!check) return null;
  return check.bound.includes("model") ? check.limit / report.frame.radius : check.limit;
}

export class ViewerCard {
  /**
   * @param {Object} report of the job
   * @param {Function} loadPreview gives the preview's bytes
   * @param {?Function} loadWhole gives the heat map's bytes, if it can be had
   */
  constructor(report, loadPreview, loadWhole = null) {
    this.report = report;
    this.radius = report.frame.radius;
    this.loadPreview = loadPreview;
    this.loadWhole = loadWhole;
    this.findings = findings(report);
    this.canvas = h("canvas", { tabindex: "0", role: "application", "aria-label": "The meshes in three dimensions", "aria-describedby": "view-keys" });
    this.overlay = h("div", { class: "over" }, h("p", { class: "loading", role: "status" }, "Loading the meshes …"));
    this.labels = h("div");
    this.note = h("div", { class: "view-note", hidden: true });
    this.wipe = h("input", { type: "range", class: "wipe", min: "0", max: "1", step: "0.005", value: "0.5", "aria-label": "Wipe between the meshes", hidden: true, oninput: () => this.viewer.set({ wipe: Number(this.wipe.value) }) });
    this.view = h("div", { class: "view", "data-testid": "view" }, this.canvas, this.labels, this.wipe, this.note, this.overlay);
    this.tools = h("div", { class: "tools", role: "toolbar", "aria-label": "How the meshes are shown" });
    this.legend = new Legend(this.radius, (changes) => this.viewer.set(changes));
    this.element = h("section", { class: "card stage", "aria-label": "Viewer" },
      h("div", { class: "main" }, this.tools, this.view, this.legend.element, h("p", { class: "hidden", id: "view-keys" }, KEYS)),
      this.places());
  }

  /** Fetch what is to be seen and show it; what goes wrong is said where it would have been. */
  async start() {
    if (!hasWebGl()) return this.say("This browser draws nothing in three dimensions: WebGL is off. All numbers are below.");
    try {
      const [THREE, buffer] = await Promise.all([threeJs(), this.loadPreview()]);
      this.preview = readPreview(buffer);
      this.viewer = new Viewer(THREE, this.canvas, this.preview);
      this.viewer.onPanes = (panes) => this.label(panes);
      this.fillTools();
      this.overlay.hidden = true;
      this.overlay.replaceChildren();
      this.noteSize();
      this.legend.take(this.preview, thresholdOf(this.report));
      this.colour("deviation");
      this.markFirst();
      this.view.dataset.ready = "true";
    } catch (error) {
      this.say(`The meshes cannot be shown: ${error.message}`);
    }
    return undefined;
  }

  /** Mark what is most worth a look, until somebody chooses another place. */
  markFirst() {
    const [first] = this.findings;
    if (first) this.viewer.mark(this.into(first.position), this.into(first.closest));
  }

  /** Fly to a place in model units; what was found there is the one that is chosen. */
  goTo(position) {
    const index = findingAt(this.findings, position, this.radius);
    if (index >= 0) this.choose(index);
    else this.viewer?.show(this.into(position), this.into(position));
    this.element.scrollIntoView({ block: "nearest" });
  }

  choose(index) {
    for (const [number, button] of this.buttons.entries()) button.setAttribute("aria-pressed", String(number === index));
    const { position, closest } = this.findings[index];
    this.viewer?.show(this.into(position), this.into(closest));
  }

  into(point) {
    const { centre } = this.report.frame;
    return point.map((value, axis) => (value - centre[axis]) / this.radius);
  }

  say(text) {
    this.overlay.hidden = false;
    this.overlay.style.display = "";
    this.overlay.replaceChildren(h("p", { class: "notice", role: "alert" }, text));
    for (const button of this.element.querySelectorAll(".places button")) button.disabled = true;
  }

  fillTools() {
    const { surfaces } = this.preview;
    const tension = surfaces.refined?.tension;
    const pairs = [["input", "refined"], ["refined", "reference"], ["input", "reference"]].filter((pair) => pair.every((name) => surfaces[name]));
    this.over = h("select", { "aria-label": "Which meshes to wipe between", hidden: true, onchange: () => this.viewer.set({ over: pairs[Number(this.over.value)] }) },
      pairs.map((pair, index) => h("option", { value: String(index) }, pair.map((name) => TITLES[name]).join(" | "))));
    this.tools.replaceChildren(
      choice("Layout", [["side", "Side by side"], ["wipe", "Wipe"]], "side", (layout) => this.layout(layout)),
      this.over,
      choice("Colour", [["shape", "Shape"], ["deviation", "Deviation"], ["tension", "Cone tension", !tension]], "deviation", (colour) => this.colour(colour)),
      h("label", null, h("input", { type: "checkbox", name: "wireframe", onchange: (event) => this.viewer.set({ wireframe: event.target.checked }) }), "Wireframe"),
      h("button", { type: "button", class: "quiet", onclick: () => this.viewer.orbit.reset() }, "Reset"));
  }

  layout(layout) {
    this.wipe.hidden = this.over.hidden = layout !== "wipe";
    this.viewer.set({ layout });
  }

  colour(colour) {
    this.viewer.set({ colour, ...this.legend.show(colour) });
  }

  /** Put the names of the panes where the viewer has drawn them. */
  label(panes) {
    const { layout } = this.viewer.state;
    const place = ({ name, clip }, index) => {
      const side = index === 1 && layout === "wipe" ? { right: "0px" } : { left: `${clip.x}px` };
      const worst = this.report.quality[name]?.point_to_surface.max * this.radius;
      return h("div", { class: "pane-label", "data-pane": name, style: { ...side, top: `${clip.y}px` } }, TITLES[name], name === "reference" ? null : h("span", { class: "soft" }, ` · worst ${number(worst)} ${unitOf(this.report)}`));
    };
    const lines = layout === "wipe"
      ? [h("div", { class: "wipe-line", style: { left: `${panes[1].clip.x - 1}px` } })]
      : panes.slice(1).map(({ view }) => h("div", { class: "pane-line", style: view.x ? { left: `${view.x}px`, top: "0", bottom: "0", width: "1px" } : { top: `${view.y}px`, left: "0", right: "0", height: "1px" } }));
    this.labels.replaceChildren(...panes.map(place), ...lines);
  }

  noteSize() {
    const shown = (name) => this.preview.surfaces[name].index.length / 3;
    const name = this.preview.surfaces.refined ? "refined" : "input";
    const whole = this.preview.faces[name];
    if (shown(name) >= whole) return;
    this.note.hidden = false;
    this.note.textContent = `preview: ${number(shown(name))} of ${number(whole)} triangles`;
    if (!this.loadWhole) return;
    const button = h("button", {
      type: "button", class: "quiet", onclick: async () => {
        button.disabled = true;
        button.textContent = "Loading …";
        try {
          this.viewer.replace(name, readHeatmap(await this.loadWhole(), this.radius));
          this.note.textContent = `${TITLES[name].toLowerCase()}: all ${number(whole)} triangles`;
          button.remove();
        } catch (error) {
          button.disabled = false;
          button.textContent = "Show every triangle";
          this.say(`The whole mesh cannot be shown: ${error.message}`);
        }
      },
    }, "Show every triangle");
    this.tools.append(button);
  }

  places() {
    this.buttons = this.findings.map(({ title, position, distance, fails }, index) => h("button", { type: "button", "aria-pressed": "false", onclick: () => this.choose(index) },
      h("span", { class: fails ? "rank fails" : "rank" }, String(index + 1)),
      h("span", null, title),
      h("span", { class: "far" }, distance === null ? "" : number(distance * this.radius)),
      h("span", { class: "where" }, `at ${position.map((value) => number(value)).join(", ")}`)));
    return h("div", { class: "side" },
      h("h2", null, "Where to look"),
      this.buttons.length
        ? h("ol", { class: "places" }, this.buttons.map((button) => h("li", null, button)))
        : h("p", { class: "empty" }, h("strong", null, "Nowhere"), "The surfaces agree everywhere."),
      this.buttons.length > 0 && h("p", { class: "hint foot" }, `In ${unitOf(this.report)}; choose one to fly there.`));
  }
}
