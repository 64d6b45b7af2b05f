// Input, refined mesh and reference in one canvas: side by side, or one wiped over another.

import { OrbitCamera } from "meshcone/camera";
import { scaleBytes } from "meshcone/palette";

const SHAPE = 0x9fb3bb;
const MARK = 0xff2d95;

/** A surface as three.js draws it. */
class Drawn {
  constructor(THREE, surface) {
    this.THREE = THREE;
    this.scene = new THREE.Scene();
    // As camera light: what is looked at is never in the dark.
    this.light = new THREE.DirectionalLight(0xffffff, 0.75);
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x8a94a0, 0.42), this.light, this.light.target);
    // Flat: facets, not an impression of smoothness, are what is judged here.
    this.material = new THREE.MeshPhongMaterial({ color: SHAPE, flatShading: true, specular: 0, shininess: 0, side: THREE.DoubleSide, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 });
    this.lines = new THREE.MeshBasicMaterial({ color: 0x10202a, wireframe: true, transparent: true, opacity: 0.38 });
    this.replace(surface);
  }

  replace(surface) {
    const { BufferAttribute, BufferGeometry, Mesh } = this.THREE;
    this.surface = surface;
    this.mesh?.geometry.dispose();
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(surface.position, 3));
    geometry.setIndex(new BufferAttribute(surface.index, 1));
    if (this.mesh) this.scene.remove(this.mesh, this.wire);
    this.mesh = new Mesh(geometry, this.material);
    this.wire = new Mesh(geometry, this.lines);
    this.scene.add(this.mesh, this.wire);
  }

  /**
   * Colour by values, or plainly for null. Values are looked up in the scale at each pixel:
   * between colours of vertices there would be colours that the scale does not have.
   */
  colour(values, top, threshold) {
    const { BufferAttribute, DataTexture } = this.THREE;
    this.material.map?.dispose();
    this.material.map = null;
    if (values !== null) {
      const bytes = scaleBytes(top, threshold);
      this.material.map = new DataTexture(bytes, bytes.length / 4, 1);
      this.material.map.needsUpdate = true;
      const places = new Float32Array(2 * values.length).fill(0.5);
      for (let index = 0; index < values.length; index += 1) places[2 * index] = Math.min(values[index] / top, 1);
      this.mesh.geometry.setAttribute("uv", new BufferAttribute(places, 2));
    }
    this.material.color.set(values === null ? SHAPE : 0xffffff);
    this.material.needsUpdate = true;
  }
}

/** A white disc with a dark rim, which is what marks a point. */
function disc(THREE) {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 32;
  const context = canvas.getContext("2d");
  context.arc(16, 16, 12, 0, 2 * Math.PI);
  context.fillStyle = "#fff";
  context.fill();
  context.lineWidth = 4;
  context.strokeStyle = "#222";
  context.stroke();
  return new THREE.CanvasTexture(canvas);
}

export class Viewer {
  /**
   * @param {Object} THREE the library
   * @param {HTMLCanvasElement} canvas
   * @param {Object} preview as `readPreview` returns it
   */
  constructor(THREE, canvas, preview) {
    this.THREE = THREE;
    this.canvas = canvas;
    this.preview = preview;
    this.names = ["input", "refined", "reference"].filter((name) => preview.surfaces[name]);
    this.drawn = Object.fromEntries(this.names.map((name) => [name, new Drawn(THREE, preview.surfaces[name])]));
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.renderer.setScissorTest(true);
    this.renderer.autoClear = false;
    this.orbit = new OrbitCamera(THREE, canvas, () => this.redraw());
    this.state = { layout: "side", wipe: 0.5, over: this.names.includes("refined") ? ["input", "refined"] : ["input", "reference"], colour: "shape", wireframe: false, top: 1, threshold: null };
    this.marks = [];
    this.disc = disc(THREE);
    this.onPanes = () => {};
    new ResizeObserver(() => this.redraw()).observe(canvas);
    this.set({});
  }

  /** Change how the meshes are shown. */
  set(changes) {
    Object.assign(this.state, changes);
    const { colour, top, threshold, wireframe } = this.state;
    for (const [name, drawn] of Object.entries(this.drawn)) {
      drawn.wire.visible = wireframe;
      if (["colour", "top", "threshold"].some((key) => key in changes)) {
        const values = colour === "shape" ? null : drawn.surface[colour] ?? null;
        drawn.colour(values, top, colour === "deviation" ? threshold : null);
      }
      drawn.name = name;
    }
    this.redraw();
  }

  /** Put another mesh, such as one with every triangle, in the place of one. */
  replace(name, surface) {
    this.drawn[name].replace(surface);
    this.set({ colour: this.state.colour });
  }

  /** Mark a point and the closest one of the other surface, and fly there. */
  show(point, closest) {
    this.mark(point, closest);
    this.orbit.flyTo(point);
  }

  /** Mark a point, with a line to another; what was marked before is marked no more. */
  mark(point, closest) {
    const { BufferAttribute, BufferGeometry, Line, LineBasicMaterial, Points, PointsMaterial } = this.THREE;
    for (const mark of this.marks) { mark.removeFromParent(); mark.geometry.dispose(); }
    const geometry = () => new BufferGeometry().setAttribute("position", new BufferAttribute(new Float32Array([...point, ...closest]), 3));
    const first = geometry();
    first.setDrawRange(0, 1);
    this.marks = Object.values(this.drawn).flatMap(({ scene }) => {
      const dot = new Points(first, new PointsMaterial({ color: MARK, map: this.disc, transparent: true, size: 16, sizeAttenuation: false, depthTest: false }));
      const line = new Line(geometry(), new LineBasicMaterial({ color: MARK, depthTest: false }));
      dot.renderOrder = line.renderOrder = 2;
      scene.add(dot, line);
      return [dot, line];
    });
  }

  /** The panes in CSS pixels: which surface, the rectangle it is drawn for, the one it shows in. */
  panes() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const whole = { x: 0, y: 0, width, height };
    if (this.state.layout === "wipe") {
      const [left, right] = this.state.over;
      const at = Math.round(width * this.state.wipe);
      return [
        { name: left, view: whole, clip: { ...whole, width: at } },
        { name: right, view: whole, clip: { ...whole, x: at, width: width - at } },
      ];
    }
    const stacked = height > width;
    const count = this.names.length;
    return this.names.map((name, number) => {
      const view = stacked
        ? { x: 0, y: (height / count) * number, width, height: height / count }
        : { x: (width / count) * number, y: 0, width: width / count, height };
      return { name, view, clip: view };
    });
  }

  redraw() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame((now) => {
      this.waiting = false;
      const goesOn = this.orbit.advance(now);
      this.#draw();
      if (goesOn) this.redraw();
    });
  }

  #draw() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (width === 0 || height === 0) return;
    const size = this.renderer.getSize(new this.THREE.Vector2());
    if (size.x !== width || size.y !== height) {
      this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
      this.renderer.setSize(width, height, false);
    }
    const panes = this.panes();
    for (const { name, view, clip } of panes) {
      if (clip.width < 1) continue;
      const camera = this.orbit.for(view.width / view.height);
      const { scene, light } = this.drawn[name];
      light.position.copy(camera.position);
      light.target.position.copy(this.orbit.target);
      const upward = ({ x, y, width: w, height: h }) => [x, height - y - h, w, h];
      this.renderer.setViewport(...upward(view));
      this.renderer.setScissor(...upward(clip));
      this.renderer.clear();
      this.renderer.render(scene, camera);
    }
    this.onPanes(panes);
  }
}
