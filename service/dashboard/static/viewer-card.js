// The card around the viewer: what to show and how, the scale, and where to look.

import { Axes } from "meshcone/axes";
import { contrastThreshold, distanceThreshold } from "meshcone/bounds";
import { decodeImages } from "meshcone/corners";
import { h } from "meshcone/dom";
import { findingAt, findings } from "meshcone/findings";
import { number } from "meshcone/format";
import { unitOf } from "meshcone/job-words";
import { hasWebGl, LOST, threeJs } from "meshcone/library";
import { Legend } from "meshcone/legend";
import { Measuring } from "meshcone/measuring";
import { savePicture } from "meshcone/picture";
import { Pins } from "meshcone/pins";
import { readHeatmap, readPreview } from "meshcone/scene-file";
import { keepInLink, viewInLink } from "meshcone/view-link";
import { Viewer } from "meshcone/viewer";
import { choice, layoutTools, TITLES, viewButtons } from "meshcone/viewer-tools";

const KEYS = "Drag or use the arrow keys to turn, shift to move, the wheel or + and − to zoom, 0 to start over; Enter measures from the middle.";
const COLOURS = { shape: "Shape", skin: "Textures", contrast: "Colour difference", deviation: "Deviation", signed: "Signed", uv: "UV", tension: "Cone tension" };

const loading = () => h("p", { class: "loading", role: "status" }, "Loading the meshes …");

export class ViewerCard {
  /**
   * @param {Object} report of the job
   * @param {Function} loadPreview gives the preview's bytes
   * @param {?Function} loadWhole gives the heat map's bytes, if it can be had
   */
  constructor(report, loadPreview, loadWhole = null) {
    Object.assign(this, { report, loadPreview, loadWhole, radius: report.frame.radius, unit: unitOf(report), findings: findings(report) });
    this.canvas = h("canvas", { tabindex: "0", role: "application", "aria-label": "The meshes in three dimensions", "aria-describedby": "view-keys" });
    this.overlay = h("div", { class: "over" }, loading());
    this.onAble = () => {};  // told whether there is anything to fly to
    this.labels = h("div");
    this.note = h("div", { class: "view-note", role: "status", hidden: true });
    this.size = "";
    this.wipe = h("input", { type: "range", class: "wipe", min: "0", max: "1", step: "0.005", value: "0.5", "aria-label": "Wipe between the meshes", hidden: true, oninput: () => this.viewer.set({ wipe: Number(this.wipe.value) }) });
    this.turn = h("button", { type: "button", class: "small turn", hidden: true, onclick: () => this.viewer.turnOver() }, "Show the other");
    this.axes = new Axes();
    this.pins = new Pins(this.findings, (point) => this.into(point), (index) => this.choose(index));
    this.view = h("div", { class: "view", "data-testid": "view" }, this.canvas, this.pins.element, this.labels, this.axes.element, this.wipe, this.turn, this.note, this.overlay);
    this.tools = h("div", { class: "tools", role: "toolbar", "aria-label": "How the meshes are shown" });
    this.legend = new Legend(this.radius, this.unit, (changes) => this.viewer.set(changes));
    this.element = h("section", { class: "card stage", "aria-label": "Viewer" },
      h("div", { class: "main" }, this.tools, this.view, this.legend.element, h("p", { class: "hidden", id: "view-keys" }, KEYS)),
      this.places());
  }

  /** Fetch what is to be seen and show it; what goes wrong is said where it would have been. */
  async start() {
    if (!hasWebGl()) return this.say("This browser draws nothing in three dimensions: WebGL is off. All numbers are below.");
    let loaded;
    try {
      loaded = await Promise.all([threeJs(), this.loadPreview()]);
    } catch (error) {
      return this.say(`The meshes cannot be shown: ${error.message} `, h("button", { type: "button", onclick: () => this.again() }, "Try again"));
    }
    try {
      const [THREE, buffer] = loaded;
      this.preview = readPreview(buffer);
      await decodeImages(this.preview.surfaces);
      this.viewer = new Viewer(THREE, this.canvas, this.preview);
      this.viewer.onDraw = (panes) => this.drawn(panes);
      this.viewer.onLost = (lost) => { if (lost) this.cover(LOST); else this.uncover(); };
      this.legend.take(this.preview, { deviation: distanceThreshold(this.report), contrast: contrastThreshold(this.report) });
      this.begin();
      this.uncover();
      this.view.dataset.ready = "true";
    } catch (error) {
      this.say(`The meshes cannot be shown: ${error.message}`);
    }
    return undefined;
  }

  /** Show what the link asks for, and offer all else. */
  begin() {
    const { viewer } = this;
    const colours = Object.keys(COLOURS).filter((colour) => colour === "shape" || Object.values(this.preview.surfaces).some((surface) => surface[colour]));
    const { colour = "deviation", camera, ...asked } = viewInLink(viewer.names, colours);
    if (camera) viewer.orbit.restore(camera);
    Object.assign(viewer.state, asked);
    this.tools.replaceChildren(
      ...layoutTools(viewer.names, viewer.state, (changes) => this.arrange(changes)),
      choice("Colour", colours.map((each) => [each, COLOURS[each]]), colour, (chosen) => this.colour(chosen)));
    this.measuring = new Measuring(viewer, this.radius, this.unit);
    this.view.append(this.measuring.element, viewButtons({
      onWire: (wireframe) => viewer.set({ wireframe }),
      onPins: (shown) => { this.pins.element.hidden = !shown; },
      onMeasure: (on) => this.measuring.toggle(on),
      onPicture: () => this.save(),
      onHome: () => viewer.orbit.reset(),
    }));
    this.noteSize();
    this.arrange({ layout: viewer.state.layout });
    this.colour(colour);
  }

  into(point) {
    const { centre } = this.report.frame;
    return point.map((value, axis) => (value - centre[axis]) / this.radius);
  }

  /** Fetch once more what could not be had. */
  again() {
    this.able(true);
    this.overlay.replaceChildren(loading());
    this.canvas.focus();
    return this.start();
  }

  /** Say why there is no viewer; there is nowhere to fly to then. */
  say(...content) {
    this.cover(...content);
    this.able(false);
  }

  able(isAble) {
    for (const button of this.buttons) button.disabled = !isAble;
    this.onAble(isAble);
  }

  cover(...content) {
    this.overlay.hidden = false;
    this.overlay.replaceChildren(h("p", { class: "notice", role: "alert" }, content));
  }

  uncover() {
    this.overlay.hidden = true;
    this.overlay.replaceChildren();
  }

  /** Say in a corner what went wrong besides the view; without words, how much of the mesh is shown. */
  tell(text = "") {
    this.note.textContent = text || this.size;
    this.note.hidden = this.note.textContent === "";
    this.note.classList.toggle("error", text !== "");
  }

  arrange(changes) {
    this.viewer.set(changes);
    const { layout } = this.viewer.state;
    this.wipe.hidden = layout !== "wipe";
    this.turn.hidden = layout !== "blink";
  }

  colour(colour) {
    this.viewer.set({ colour, scale: this.legend.show(colour) });
  }

  /** Put everything where the viewer has just drawn what it belongs to. */
  drawn(panes) {
    this.label(panes);
    this.pins.place(this.viewer);
    this.axes.place(this.viewer.orbit);
    keepInLink(this.viewer.state, this.viewer.orbit.state());
  }

  /** Put the names of the panes where the viewer has drawn them. */
  label(panes) {
    const { layout } = this.viewer.state;
    const place = ({ names, clip }, index) => {
      const side = index === 1 && layout === "wipe" ? { right: "52px" } : { left: `${clip.x}px` };
      const [name] = names;
      const worst = names.length === 1 && this.report.quality[name]?.point_to_surface.max * this.radius;
      return h("div", { class: "pane-label", "data-pane": name, style: { ...side, top: `${clip.y}px` } }, names.map((each) => TITLES[each]).join(" under "), worst ? h("span", { class: "soft" }, ` · worst ${number(worst)} ${this.unit}`) : null);
    };
    const lines = layout === "wipe"
      ? [h("div", { class: "wipe-line", style: { left: `${panes[1].clip.x - 1}px` } })]
      : panes.slice(1).map(({ view }) => h("div", { class: "pane-line", style: view.x ? { left: `${view.x}px`, top: "0", bottom: "0", width: "1px" } : { top: `${view.y}px`, left: "0", right: "0", height: "1px" } }));
    this.labels.replaceChildren(...panes.map(place), ...lines);
  }

  save() {
    const legend = this.legend.ends();
    const labels = this.viewer.panes().map(({ names, clip }) => ({ x: clip.x, y: clip.y, text: names.map((name) => TITLES[name]).join(" under ") }));
    const name = `${this.report.inputs.source.name.replace(/^.*\//, "").replace(/\.[^.]*$/, "")}.view.png`;
    savePicture(this.viewer, { name, labels, legend }).then(() => this.tell(), (error) => this.tell(`There is no picture: ${error.message}`));
  }

  noteSize() {
    const { leading } = this.viewer;
    const shown = this.preview.surfaces[leading].index.length / 3;
    const whole = this.preview.faces[leading];
    if (shown >= whole) return;
    this.size = `preview: ${number(shown)} of ${number(whole)} triangles`;
    this.tell();
    if (this.loadWhole) this.tools.append(this.wholeButton(leading, whole));
  }

  wholeButton(name, whole) {
    const button = h("button", {
      type: "button", class: "quiet", onclick: async () => {
        button.disabled = true;
        button.textContent = "Loading …";
        try {
          this.viewer.replace(name, readHeatmap(await this.loadWhole(), this.radius));
          this.size = `${TITLES[name].toLowerCase()}: all ${number(whole)} triangles`;
          this.tell();
          button.remove();
        } catch (error) {
          button.disabled = false;
          button.textContent = "Show every triangle";
          this.tell(`The whole mesh cannot be shown: ${error.message}`);
        }
      },
    }, "Show every triangle");
    return button;
  }

  /** Fly to a place in model units; what was found there is the one that is chosen. */
  goTo(position) {
    const index = findingAt(this.findings, position, this.radius);
    if (index >= 0) this.choose(index);
    else this.viewer?.orbit.flyTo(this.into(position));
    this.element.scrollIntoView({ block: "nearest" });
  }

  /** Show one part alone, or for null all. */
  isolate(name) {
    this.viewer?.isolate(name);
    this.element.scrollIntoView({ block: "nearest" });
  }

  choose(index) {
    for (const [number, button] of this.buttons.entries()) button.setAttribute("aria-pressed", String(number === index));
    const { position, closest } = this.findings[index];
    this.pins.chosen = index;
    this.viewer?.connect([[this.into(position), this.into(closest)]]);
    this.viewer?.orbit.flyTo(this.into(position));
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
      this.buttons.length > 0 && h("p", { class: "hint foot" }, `In ${this.unit}; choose one to fly there.`));
  }
}
