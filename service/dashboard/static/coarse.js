// Fewer triangles that stand for a surface while it moves, where drawing all of them takes too long.

import { faceAreas } from "meshcone/scene-file";

const HALF = 65536;  // cells on either side of the middle, along each axis

/**
 * The triangles whose corners lie in three cells of a grid, one of them for each three cells.
 * @param {{position: Float32Array, index: Uint32Array}} surface
 * @param {number} most triangles, about
 * @returns {{faces: Uint32Array, corners: Uint32Array}} numbers of triangles of the surface, and the three vertices that each is drawn between
 */
export function coarser(surface, most) {
  const { position, index } = surface;
  const area = faceAreas(surface).reduce((sum, each) => sum + each, 0);
  // A plane goes through one and a half cells for each that its area has room for, and two triangles are left in each.
  const side = Math.sqrt((3 * area) / most);
  const cells = new Map();
  const standing = [];  // for each cell, the vertex that stands for all of it
  const cellOf = Uint32Array.from({ length: position.length / 3 }, (_, vertex) => {
    const [x, y, z] = [0, 1, 2].map((axis) => Math.floor(position[3 * vertex + axis] / side) + HALF);
    const key = (x * 2 * HALF + y) * 2 * HALF + z;
    if (!cells.has(key)) cells.set(key, standing.push(vertex) - 1);
    return cells.get(key);
  });
  const faces = [];
  const corners = [];
  const seen = new Set();
  for (let face = 0; face < index.length / 3; face += 1) {
    const of = [0, 1, 2].map((corner) => cellOf[index[3 * face + corner]]);
    if (of[0] === of[1] || of[1] === of[2] || of[2] === of[0]) continue;
    const [low, middle, high] = [...of].sort((one, other) => one - other);
    const key = (low * standing.length + middle) * standing.length + high;
    if (seen.has(key)) continue;
    seen.add(key);
    faces.push(face);
    corners.push(...of.map((cell) => standing[cell]));
  }
  return { faces: Uint32Array.from(faces), corners: Uint32Array.from(corners) };
}
