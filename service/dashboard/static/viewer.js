// Source, refined mesh and reference in one canvas, beside, over or instead of each other.

import { OrbitCamera } from "meshcone/camera";
import { Drawn } from "meshcone/drawn";
import { paneAt, panesOf } from "meshcone/panes";

const LINE = 0xff2d95;
const BLINK = 700;  // milliseconds for each of the two
const SLOW = 45;  // milliseconds for a picture: above, fewer triangles are drawn while the meshes move
const REST = 120;  // milliseconds without a change, after which the picture is drawn smoothly

export class Viewer {
  /**
   * @param {Object} THREE the library
   * @param {HTMLCanvasElement} canvas
   * @param {Object} preview as `readPreview` returns it
   */
  constructor(THREE, canvas, preview) {
    this.THREE = THREE;
    this.canvas = canvas;
    this.names = ["input", "refined", "reference"].filter((name) => preview.surfaces[name]);
    this.drawn = Object.fromEntries(this.names.map((name) => [name, new Drawn(THREE, preview.surfaces[name])]));
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: false, alpha: true });
    this.renderer.setScissorTest(true);
    this.renderer.autoClear = false;
    this.orbit = new OrbitCamera(THREE, canvas, () => this.redraw());
    this.state = {
      layout: "side", shown: this.leading, over: [this.leading === "refined" ? "input" : this.leading, this.leading === "refined" ? "refined" : "reference"],
      turn: 0, wipe: 0.5, colour: "shape", scale: null, wireframe: false,
    };
    this.lines = [];
    this.onDraw = () => {};
    this.onLost = () => {};  // told true when the browser takes the graphics away, false when it gives them back
    canvas.addEventListener("webglcontextlost", () => this.onLost(true));
    canvas.addEventListener("webglcontextrestored", () => this.#restored());
    new ResizeObserver(() => this.redraw()).observe(canvas);
    this.set({});
  }

  /** The library has made its own things anew; what was asked of it for all pictures is gone. */
  #restored() {
    this.renderer.setScissorTest(true);
    this.onLost(false);
    this.redraw();
  }

  /** The surface that is judged. */
  get leading() {
    return this.names.includes("refined") ? "refined" : "input";
  }

  /** Change how the meshes are shown. */
  set(changes) {
    Object.assign(this.state, changes);
    const { colour, scale, wireframe, layout } = this.state;
    for (const drawn of Object.values(this.drawn)) {
      drawn.wire.visible = wireframe;
      if ("colour" in changes || "scale" in changes) drawn.colour(colour, scale);
    }
    if ("layout" in changes) this.#blink(layout === "blink");
    this.redraw();
  }

  /** Show one of two and then the other; by itself only for those who did not ask for less motion. */
  #blink(on) {
    clearInterval(this.blinking);
    if (on && !matchMedia("(prefers-reduced-motion: reduce)").matches) this.blinking = setInterval(() => this.turnOver(), BLINK);
  }

  /** Show the other one of two that blink. */
  turnOver() {
    this.set({ turn: 1 - this.state.turn });
  }

  /** Put another mesh, such as one with every triangle, in the place of one. */
  replace(name, surface) {
    this.drawn[name].replace(surface);
    this.set({ colour: this.state.colour });
  }

  /** Draw one part alone in every pane, and look at it; null for all of them again. */
  isolate(name) {
    for (const drawn of Object.values(this.drawn)) drawn.isolate(name);
    const there = Object.values(this.drawn).find(({ surface }) => surface.parts?.some((part) => part.name === name));
    if (there) this.orbit.frame(...there.extent());
    else if (name === null) this.orbit.reset();
    this.redraw();
  }

  /** Draw lines between points of the frame, over everything; those drawn before go. */
  connect(pairs) {
    const { BufferAttribute, BufferGeometry, LineBasicMaterial, LineSegments } = this.THREE;
    for (const line of this.lines) { line.removeFromParent(); line.geometry.dispose(); }
    const geometry = new BufferGeometry().setAttribute("position", new BufferAttribute(new Float32Array(pairs.flat(2)), 3));
    this.lines = Object.values(this.drawn).map(({ scene }) => {
      const line = new LineSegments(geometry, new LineBasicMaterial({ color: LINE, depthTest: false }));
      line.renderOrder = 2;
      scene.add(line);
      return line;
    });
    this.redraw();
  }

  panes() {
    return panesOf(this.state, this.names, this.canvas.clientWidth, this.canvas.clientHeight);
  }

  /** Where a point of the frame is on the canvas, in each pane that draws one of some surfaces. */
  project(point, names) {
    return this.panes().filter((pane) => pane.names.some((name) => names.includes(name))).map(({ view, clip }) => {
      const at = new this.THREE.Vector3(...point).project(this.orbit.for(view.width / view.height));
      const x = view.x + ((at.x + 1) / 2) * view.width;
      const y = view.y + ((1 - at.y) / 2) * view.height;
      return { x, y, seen: at.z < 1 && x >= clip.x && x <= clip.x + clip.width && y >= clip.y && y <= clip.y + clip.height };
    });
  }

  /** The nearest point of a surface under a point of the canvas, in the frame; null beside it. */
  pick(x, y) {
    const found = paneAt(this.panes(), x, y);
    if (!found) return null;
    const { Raycaster, Vector2 } = this.THREE;
    const { names, view } = found.pane;
    const ray = new Raycaster();
    ray.setFromCamera(new Vector2(found.at.x, found.at.y), this.orbit.for(view.width / view.height));
    const [hit] = ray.intersectObjects(names.map((name) => this.drawn[name].mesh));
    return hit ? hit.point.toArray() : null;
  }

  /** Draw with the next picture of the screen, and once more, smoothly, when all is at rest. */
  redraw() {
    if (this.waiting) return;
    this.waiting = true;
    this.canvas.dataset.rest = "false";
    clearTimeout(this.resting);
    requestAnimationFrame((now) => {
      this.waiting = false;
      const goesOn = this.orbit.advance(now);
      this.draw(1);
      requestAnimationFrame((next) => this.#time(next - now));
      if (goesOn) this.redraw();
      else this.resting = setTimeout(() => { this.draw(2); this.canvas.dataset.rest = "true"; }, REST);
    });
  }

  /** Two pictures in a row that took long make the next ones, while the meshes move, coarser. */
  #time(took) {
    this.late = took > SLOW ? (this.late ?? 0) + 1 : 0;
    this.hurried ||= this.late > 1;
  }

  /**
   * Draw now; what the canvas holds can be read until the browser shows it.
   * @param {number} finer pixels for one of a plain screen, along either axis: two smooth the edges
   */
  draw(finer = 2) {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (width === 0 || height === 0) return;
    const ratio = Math.min(Math.max(devicePixelRatio, finer), 2);
    const size = this.renderer.getSize(new this.THREE.Vector2());
    if (size.x !== width || size.y !== height || this.renderer.getPixelRatio() !== ratio) {
      this.renderer.setPixelRatio(ratio);
      this.renderer.setSize(width, height, false);
    }
    const panes = this.panes();
    for (const { names, view, clip } of panes) {
      if (clip.width < 1) continue;
      const camera = this.orbit.for(view.width / view.height);
      const upward = ({ x, y, width: w, height: h }) => [x, height - y - h, w, h];
      this.renderer.setViewport(...upward(view));
      this.renderer.setScissor(...upward(clip));
      this.renderer.clear();
      for (const [layer, name] of names.entries()) {
        const drawn = this.drawn[name];
        drawn.hurry(this.hurried === true && finer === 1);
        drawn.veiled(layer > 0);
        this.renderer.render(drawn.scene, camera);
      }
    }
    this.onDraw(panes);
  }
}
