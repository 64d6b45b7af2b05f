// One surface as three.js draws it: its shape, its colours, its edges.

import { scaleBytes } from "meshcone/palette";

const SHAPE = 0xb9c4c8;
const OVERLAID = 0x0b8896;

export class Drawn {
  constructor(THREE, surface) {
    this.THREE = THREE;
    this.scene = new THREE.Scene();
    // As camera light: what is looked at is never in the dark.
    this.light = new THREE.DirectionalLight(0xffffff, 0.62);
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x9aa4ae, 0.5), this.light, this.light.target);
    // Flat: facets, not an impression of smoothness, are what is judged here.
    const flat = { flatShading: true, specular: 0, shininess: 0, side: THREE.DoubleSide, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 };
    this.material = new THREE.MeshPhongMaterial({ ...flat, color: SHAPE });
    this.veil = new THREE.MeshPhongMaterial({ ...flat, color: OVERLAID, transparent: true, opacity: 0.42, depthWrite: false });
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
  colour(values, scale) {
    const { BufferAttribute, DataTexture } = this.THREE;
    this.material.map?.dispose();
    this.material.map = null;
    if (values !== null) {
      const bytes = scaleBytes(scale);
      this.material.map = new DataTexture(bytes, bytes.length / 4, 1);
      this.material.map.needsUpdate = true;
      const places = new Float32Array(2 * values.length).fill(0.5);
      for (let index = 0; index < values.length; index += 1) places[2 * index] = Math.min(Math.max((values[index] - scale.low) / (scale.top - scale.low), 0), 1);
      this.mesh.geometry.setAttribute("uv", new BufferAttribute(places, 2));
    }
    this.material.color.set(values === null ? SHAPE : 0xffffff);
    this.material.needsUpdate = true;
  }

  /** Draw it over what is there already, so that both can be seen. */
  veiled(veiled) {
    this.mesh.material = veiled ? this.veil : this.material;
  }
}
