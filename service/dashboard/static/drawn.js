// One surface as three.js draws it: its shape, its colours, its edges.

import { checker, cornersOf, inColours } from "meshcone/corners";
import { scaleBytes } from "meshcone/palette";
import { surfaceMaterial } from "meshcone/surface-material";

const SHAPE = 0xb9c4c8;
const OVERLAID = 0x0b8896;

export class Drawn {
  constructor(THREE, surface) {
    this.THREE = THREE;
    this.scene = new THREE.Scene();
    this.material = surfaceMaterial(THREE, SHAPE);
    this.veil = surfaceMaterial(THREE, OVERLAID, 0.42);
    this.lines = new THREE.MeshBasicMaterial({ color: 0x10202a, wireframe: true, transparent: true, opacity: 0.38 });
    this.replace(surface);
  }

  replace(surface) {
    const { BufferAttribute, BufferGeometry, Mesh } = this.THREE;
    this.surface = surface;
    this.mesh?.geometry.dispose();
    this.shared = new BufferGeometry();
    this.shared.setAttribute("position", new BufferAttribute(surface.position, 3));
    this.shared.setIndex(new BufferAttribute(surface.index, 1));
    if (this.mesh) this.scene.remove(this.mesh, this.wire);
    this.mesh = new Mesh(this.shared, this.material);
    this.wire = new Mesh(this.shared, this.lines);
    this.scene.add(this.mesh, this.wire);
    this.isolate(this.part ?? null);
  }

  /**
   * Colour by values, by an image at the corners ("skin", "uv", or "contrast" between colours), or
   * plainly, as far as there are any. A surface without a contrast shows the colours that it has.
   */
  colour(name, scale) {
    this.map?.dispose();
    this.map = null;
    if (this.mesh.geometry !== this.shared) this.mesh.geometry.dispose();
    this.mesh.geometry = this.shared;
    const { skin, uv, contrast, [name]: found } = this.surface;
    if (name === "uv" && uv) this.#image(uv, checker(), { repeats: true });
    else if (name === "contrast" && contrast) this.#image(contrast, inColours(contrast, scale), { blends: false });
    else if (["skin", "contrast"].includes(name)) skin && this.#image(skin, skin.bitmap);
    else if (found && scale) this.#values(found, scale);
    this.material.uniforms.map.value = this.map;
    this.material.uniforms.mapped.value = this.map !== null;
    this.isolate(this.part);
  }

  /**
   * Values are looked up in the scale at each pixel: between colours of vertices there would be
   * colours that the scale does not have.
   */
  #values(values, scale) {
    const { BufferAttribute, DataTexture } = this.THREE;
    const bytes = scaleBytes(scale);
    this.map = new DataTexture(bytes, bytes.length / 4, 1);
    this.map.needsUpdate = true;
    const places = new Float32Array(2 * values.length).fill(0.5);
    for (let index = 0; index < values.length; index += 1) places[2 * index] = Math.min(Math.max((values[index] - scale.low) / (scale.top - scale.low), 0), 1);
    this.shared.setAttribute("uv", new BufferAttribute(places, 2));
  }

  /** An image has its place at each corner of each triangle, not at a vertex. */
  #image(places, picture, { repeats = false, blends = true } = {}) {
    const { BufferAttribute, BufferGeometry, CanvasTexture, LinearFilter, NearestFilter, RepeatWrapping } = this.THREE;
    const { position, index } = this.surface;
    const positions = new Float32Array(3 * index.length);
    for (let corner = 0; corner < index.length; corner += 1) for (let axis = 0; axis < 3; axis += 1) positions[3 * corner + axis] = position[3 * index[corner] + axis];
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(positions, 3));
    geometry.setAttribute("uv", new BufferAttribute(cornersOf(places), 2));
    this.mesh.geometry = geometry;
    const map = new CanvasTexture(picture);
    map.flipY = false;
    if (repeats) map.wrapS = map.wrapT = RepeatWrapping;
    else {
      map.generateMipmaps = false;
      map.minFilter = blends ? LinearFilter : NearestFilter;
      map.magFilter = map.minFilter;
    }
    this.map = map;
  }

  /** Draw one part alone, which may be nothing here; or, for null, all. */
  isolate(name) {
    this.part = name;
    const part = name === null ? { first: 0, count: Infinity } : this.surface.parts?.find((each) => each.name === name) ?? { first: 0, count: 0 };
    for (const geometry of new Set([this.shared, this.mesh.geometry])) geometry.setDrawRange(3 * part.first, 3 * part.count);
  }

  /** Middle and radius of what is drawn. */
  extent() {
    const { start, count } = this.shared.drawRange;
    const { index, position } = this.surface;
    const corners = Array.from(index.subarray(start, Math.min(start + count, index.length)), (vertex) => Array.from(position.subarray(3 * vertex, 3 * vertex + 3)));
    const [low, high] = [Math.min, Math.max].map((end) => [0, 1, 2].map((axis) => corners.reduce((so, corner) => end(so, corner[axis]), corners[0][axis])));
    const middle = low.map((value, axis) => (value + high[axis]) / 2);
    return [middle, Math.hypot(...high.map((value, axis) => value - low[axis])) / 2];
  }

  /** Draw it over what is there already, so that both can be seen. */
  veiled(veiled) {
    this.mesh.material = veiled ? this.veil : this.material;
  }
}
