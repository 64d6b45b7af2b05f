// One surface as three.js draws it: its shape, its colours, its edges.

import { coarser } from "meshcone/coarse";
import { checker, cornersOf, inColours } from "meshcone/corners";
import { scaleBytes } from "meshcone/palette";
import { surfaceMaterial } from "meshcone/surface-material";

const SHAPE = 0xb9c4c8;
const OVERLAID = 0x0b8896;
const MOVING = 12000;  // triangles, about, while it moves where drawing is slow

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
    this.fewer = null;
    this.#forget();
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
    this.#forget();
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

  /** Draw fewer triangles for a moment, unless there are few, one part alone, or edges to be seen. */
  hurry(hurried) {
    const fits = hurried && this.part === null && !this.wire.visible && this.surface.index.length > 6 * MOVING;
    if (fits && !this.rough) {
      this.rough = this.#roughly();
      this.scene.add(this.rough);
    }
    if (this.rough) this.rough.visible = fits;
    this.mesh.visible = !fits;
  }

  /** Triangles between the corners of some of the surface's, each with the colours of the one that it was. */
  #roughly() {
    const { BufferAttribute, BufferGeometry, Mesh } = this.THREE;
    this.fewer ??= coarser(this.surface, MOVING);
    const { faces, corners } = this.fewer;
    const rows = (values, width, numbers) => Float32Array.from({ length: width * numbers.length }, (_, at) => values[width * numbers[Math.floor(at / width)] + (at % width)]);
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(rows(this.surface.position, 3, corners), 3));
    const { uv } = this.mesh.geometry.attributes;
    const own = this.mesh.geometry !== this.shared;
    if (uv) geometry.setAttribute("uv", new BufferAttribute(rows(uv.array, 2, own ? Uint32Array.from(corners, (_, corner) => 3 * faces[Math.floor(corner / 3)] + (corner % 3)) : corners), 2));
    return new Mesh(geometry, this.mesh.material);
  }

  /** The fewer triangles have other colours now, or another shape. */
  #forget() {
    this.rough?.removeFromParent();
    this.rough?.geometry.dispose();
    this.rough = null;
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
    if (this.rough) this.rough.material = this.mesh.material;
  }
}
