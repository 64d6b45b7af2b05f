// One camera for all panes, turned about a target by mouse, touch or keys.

const TURN = 0.008;  // radians a pixel
const KEY_TURN = 0.12;  // radians a key
const NEAREST = 0.02;
const FARTHEST = 40;
const FLIGHT = 650;  // milliseconds
const FIELD = 35;  // degrees, of the shorter side

export class OrbitCamera {
  /** @param {Object} THREE the library  @param {HTMLElement} element what is dragged  @param {Function} onChange called after each move */
  constructor(THREE, element, onChange) {
    this.THREE = THREE;
    this.onChange = onChange;
    this.camera = new THREE.PerspectiveCamera(FIELD, 1, 0.01, 100);
    this.pointers = new Map();
    this.reset(false);
    element.addEventListener("pointerdown", (event) => this.#down(event, element));
    element.addEventListener("pointermove", (event) => this.#move(event));
    for (const name of ["pointerup", "pointercancel"]) element.addEventListener(name, (event) => this.pointers.delete(event.pointerId));
    element.addEventListener("wheel", (event) => { event.preventDefault(); this.zoom(Math.exp(event.deltaY * 0.0012)); }, { passive: false });
    element.addEventListener("contextmenu", (event) => event.preventDefault());
    element.addEventListener("keydown", (event) => this.#key(event));
  }

  reset(announce = true) {
    const { Vector3 } = this.THREE;
    this.flight = null;
    this.target = new Vector3();
    this.distance = 3.6;
    this.rotation = this.#lookingFrom(new Vector3(0.55, 0.42, 1));
    if (announce) this.onChange();
  }

  /** From the target to the eye. */
  back() {
    return new this.THREE.Vector3(0, 0, 1).applyQuaternion(this.rotation);
  }

  /** An axis of the model, 0 for x, as the camera sees it: rightwards, upwards, towards the eye. */
  seen(axis) {
    return new this.THREE.Vector3().setComponent(axis, 1).applyQuaternion(this.rotation.clone().invert());
  }

  /** Eight numbers that `restore` takes. */
  state() {
    return [...this.target.toArray(), this.distance, ...this.rotation.toArray()];
  }

  /** Look as a camera did once. */
  restore([x, y, z, distance, ...rotation]) {
    this.target.set(x, y, z);
    this.distance = Math.min(FARTHEST, Math.max(NEAREST, distance));
    this.rotation.fromArray(rotation).normalize();
  }

  /** Place the camera for a pane of a shape; called before each pane is drawn. */
  for(aspect) {
    this.camera.aspect = aspect;
    // In a narrow pane the field is that of its width, so that the mesh fits.
    const half = Math.tan((FIELD / 2) * Math.PI / 180) / Math.min(aspect, 1);
    this.camera.fov = (2 * Math.atan(half) * 180) / Math.PI;
    this.camera.near = this.distance / 100;
    this.camera.far = this.distance + 20;
    this.camera.updateProjectionMatrix();
    this.camera.quaternion.copy(this.rotation);
    this.camera.position.copy(this.target).addScaledVector(this.back(), this.distance);
    this.camera.updateMatrixWorld();
    return this.camera;
  }

  turn(dx, dy) {
    const { Quaternion, Vector3 } = this.THREE;
    this.flight = null;
    const yaw = new Quaternion().setFromAxisAngle(new Vector3(0, 1, 0), -dx);
    const pitch = new Quaternion().setFromAxisAngle(new Vector3(1, 0, 0), -dy);
    this.rotation.multiply(yaw).multiply(pitch).normalize();
    this.onChange();
  }

  zoom(factor) {
    this.flight = null;
    this.distance = Math.min(FARTHEST, Math.max(NEAREST, this.distance * factor));
    this.onChange();
  }

  pan(dx, dy) {
    this.flight = null;
    const step = this.distance * 0.0016;
    this.target.add(new this.THREE.Vector3(-dx * step, dy * step, 0).applyQuaternion(this.rotation));
    this.onChange();
  }

  /** Move to a point of the frame, seen from outside, over half a second or at once. */
  flyTo([x, y, z]) {
    const { Vector3 } = this.THREE;
    const point = new Vector3(x, y, z);
    const outward = point.length() > 1e-3 ? point.clone().normalize() : new Vector3(0, 0, 1);
    // A little from the side: looking straight down on a bump hides its height.
    const eye = outward.add(new Vector3(0.25, 0.3, 0.1)).normalize();
    this.#fly({ target: point, distance: 1.2, rotation: this.#lookingFrom(eye) });
  }

  /** Move so that a ball fills the view, from where it is looked from now. */
  frame(middle, radius) {
    this.#fly({ target: new this.THREE.Vector3(...middle), distance: Math.min(FARTHEST, Math.max(NEAREST, 3.6 * radius)), rotation: this.rotation.clone() });
  }

  #fly(end) {
    if (matchMedia("(prefers-reduced-motion: reduce)").matches) Object.assign(this, end);
    else this.flight = { start: performance.now(), from: { target: this.target.clone(), distance: this.distance, rotation: this.rotation.clone() }, end };
    this.onChange();
  }

  /** Go on with a flight; true as long as it lasts. */
  advance(now) {
    if (this.flight === null) return false;
    const { start, from, end } = this.flight;
    const share = Math.min(1, (now - start) / FLIGHT);
    const eased = share * share * (3 - 2 * share);
    this.target.lerpVectors(from.target, end.target, eased);
    this.distance = from.distance + (end.distance - from.distance) * eased;
    this.rotation.slerpQuaternions(from.rotation, end.rotation, eased);
    if (share === 1) this.flight = null;
    return this.flight !== null;
  }

  #lookingFrom(direction) {
    const { Matrix4, Quaternion, Vector3 } = this.THREE;
    return new Quaternion().setFromRotationMatrix(new Matrix4().lookAt(direction, new Vector3(), new Vector3(0, 1, 0)));
  }

  #down(event, element) {
    element.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
  }

  #move(event) {
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    const here = { x: event.clientX, y: event.clientY };
    const [dx, dy] = [here.x - before.x, here.y - before.y];
    if (this.pointers.size === 2) {
      const [other] = [...this.pointers].filter(([id]) => id !== event.pointerId).map(([, place]) => place);
      const span = (place) => Math.hypot(place.x - other.x, place.y - other.y);
      this.zoom(span(before) / Math.max(span(here), 1));
      this.pan(dx / 2, dy / 2);
    } else if (event.shiftKey || event.buttons === 2 || event.buttons === 4) this.pan(dx, dy);
    else this.turn(dx * TURN, dy * TURN);
    this.pointers.set(event.pointerId, here);
  }

  #key(event) {
    const turns = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    const turn = turns[event.key];
    if (turn && event.shiftKey) this.pan(-20 * turn[0], -20 * turn[1]);
    else if (turn) this.turn(KEY_TURN * turn[0], KEY_TURN * turn[1]);
    else if (event.key === "+" || event.key === "=") this.zoom(0.85);
    else if (event.key === "-") this.zoom(1 / 0.85);
    else if (event.key === "0" || event.key === "Home") this.reset();
    else return;
    event.preventDefault();
  }
}
