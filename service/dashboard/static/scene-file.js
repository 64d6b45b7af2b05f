// Reading the GLB files of a job: binary glTF 2.0 with plain accessors, as the worker writes them.

const TYPES = { 5121: Uint8Array, 5123: Uint16Array, 5125: Uint32Array, 5126: Float32Array };
const WIDTHS = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4 };

function parse(buffer) {
  const header = new DataView(buffer);
  if (buffer.byteLength < 28 || header.getUint32(0, true) !== 0x46546c67) throw new Error("the preview is no GLB file");
  const length = header.getUint32(12, true);
  const document = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 20, length)));
  const binary = 20 + length + 8;
  const accessor = (index) => {
    const { bufferView, componentType, count, type } = document.accessors[index];
    const { byteOffset = 0 } = document.bufferViews[bufferView];
    return new TYPES[componentType](buffer, binary + byteOffset, count * WIDTHS[type]);
  };
  const image = (number) => {
    const { bufferView, mimeType } = document.images[number];
    const { byteOffset = 0, byteLength } = document.bufferViews[bufferView];
    return new Blob([new Uint8Array(buffer, binary + byteOffset, byteLength)], { type: mimeType });
  };
  const meshes = document.meshes.map(({ name, primitives: [{ attributes, indices }], extras: { parts = [], skin, uv, contrast } = {} }) => ({
    name,
    position: accessor(attributes.POSITION),
    index: accessor(indices),
    deviation: accessor(attributes._DEVIATION),
    signed: attributes._SIGNED === undefined ? null : accessor(attributes._SIGNED),
    tension: attributes._TENSION === undefined ? null : accessor(attributes._TENSION),
    parts,
    skin: skin && { image: image(skin.image), side: skin.side, corners: accessor(skin.corners) },
    uv: uv && { ...uv, corners: accessor(uv.corners) },
    contrast: contrast && { ...contrast, image: image(contrast.image), corners: accessor(contrast.corners) },
  }));
  return { meshes, extras: document.asset.extras };
}

/**
 * Input, refined mesh and reference of a preview, in the frame: the reference has radius 1.
 * @returns {{surfaces: Object, centre: number[], radius: number, faces: Object}}
 */
export function readPreview(buffer) {
  const { meshes, extras } = parse(buffer);
  return { surfaces: Object.fromEntries(meshes.map((mesh) => [mesh.name, mesh])), ...extras };
}

/** The whole mesh of a heat map, brought from model units into the frame of a preview. */
export function readHeatmap(buffer, radius) {
  const [mesh] = parse(buffer).meshes;
  const scaled = (values) => values.map((value) => value / radius);
  return { ...mesh, position: scaled(mesh.position), deviation: scaled(mesh.deviation) };
}

/** The value below which a share of the values lies. */
export function quantile(values, share) {
  if (values.length === 0) return 0;
  const sorted = Float32Array.from(values).sort();
  return sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))];
}

/** The area of each triangle, (m,). */
export function faceAreas({ position, index }) {
  const found = new Float64Array(index.length / 3);
  for (let corner = 0; corner < index.length; corner += 3) {
    const [a, b, c] = [index[corner], index[corner + 1], index[corner + 2]];
    const edge = (from, to) => [0, 1, 2].map((axis) => position[3 * to + axis] - position[3 * from + axis]);
    const [ux, uy, uz] = edge(a, b);
    const [vx, vy, vz] = edge(a, c);
    found[corner / 3] = Math.hypot(uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx) / 2;
  }
  return found;
}

/** A third of the area of its triangles for each vertex, (n,). */
export function areas(surface) {
  const shares = new Float64Array(surface.position.length / 3);
  for (const [triangle, area] of faceAreas(surface).entries()) {
    for (let corner = 0; corner < 3; corner += 1) shares[surface.index[3 * triangle + corner]] += area / 3;
  }
  return shares;
}
