// What images need at the corners of triangles, and the images that are made here.

import { colourOf } from "meshcone/palette";

const STEPS = 65535;
const SQUARES = 8;
const SIDE = 64;  // pixels of a square

/** Where each corner is in its image, two numbers each: of a skin in texels, of coordinates in steps. */
export function cornersOf({ corners, side, low, high }) {
  const places = new Float32Array(corners.length);
  for (let index = 0; index < corners.length; index += 1) {
    const axis = index % 2;
    places[index] = side ? (corners[index] + 0.5) / side : low[axis] + (corners[index] / STEPS) * (high[axis] - low[axis]);
  }
  return places;
}

/** Squares whose hue says where along u they are, and whose lightness says where along v. */
export function checker() {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = SQUARES * SIDE;
  const context = canvas.getContext("2d");
  context.font = "600 22px sans-serif";
  context.textAlign = "center";
  context.textBaseline = "middle";
  for (let row = 0; row < SQUARES; row += 1) {
    for (let column = 0; column < SQUARES; column += 1) {
      const light = (row + column) % 2 ? 84 : 58 + 2 * row;
      context.fillStyle = `hsl(${column * 45} ${(row + column) % 2 ? 30 : 55}% ${light}%)`;
      context.fillRect(column * SIDE, row * SIDE, SIDE, SIDE);
      context.fillStyle = "rgb(20 30 36 / .75)";
      context.fillText(`${"ABCDEFGH"[column]}${row + 1}`, (column + 0.5) * SIDE, (row + 0.5) * SIDE);
    }
  }
  return canvas;
}

/** The values of an image of one channel, row after row: zero to `top`. */
async function valuesOf({ image, side, top }) {
  const bitmap = await createImageBitmap(image, { colorSpaceConversion: "none" });
  const context = Object.assign(document.createElement("canvas"), { width: side, height: side }).getContext("2d");
  context.drawImage(bitmap, 0, 0);
  const { data } = context.getImageData(0, 0, side, side);
  return Float32Array.from({ length: side * side }, (_, texel) => (data[4 * texel] / 255) * top);
}

/** Decode the images that surfaces have, once each. */
export async function decodeImages(surfaces) {
  await Promise.all(Object.values(surfaces).map(async ({ skin, contrast }) => {
    if (skin) skin.bitmap = await createImageBitmap(skin.image);
    if (contrast) contrast.values = await valuesOf(contrast);
  }));
}

/** An image of values in the colours of a scale. */
export function inColours({ values, side }, scale) {
  const canvas = Object.assign(document.createElement("canvas"), { width: side, height: side });
  const shades = new Map();
  const made = new ImageData(side, side);
  for (const [texel, value] of values.entries()) {
    if (!shades.has(value)) shades.set(value, [...colourOf(value, scale).map((channel) => Math.round(255 * channel)), 255]);
    made.data.set(shades.get(value), 4 * texel);
  }
  canvas.getContext("2d").putImageData(made, 0, 0);
  return canvas;
}

const SAMPLES = 20000;  // over all triangles, or one for each where there are more

/** Values of an image spread evenly over each triangle, which has the same number of them. */
export function spread({ values, side, corners }) {
  const triangles = corners.length / 6;
  const steps = Math.min(Math.max(Math.ceil(Math.sqrt(SAMPLES / triangles)), 1), 64);
  const inner = [];
  for (let i = 0; i < steps; i += 1) for (let j = 0; i + j < steps; j += 1) inner.push([(i + 1 / 3) / steps, (j + 1 / 3) / steps]);
  const found = new Float32Array(triangles * inner.length);
  for (let triangle = 0; triangle < triangles; triangle += 1) {
    const at = (share, other, axis) => {
      const [a, b, c] = [0, 1, 2].map((corner) => corners[6 * triangle + 2 * corner + axis]);
      return Math.round(a + share * (b - a) + other * (c - a));
    };
    for (const [number, [share, other]] of inner.entries()) found[triangle * inner.length + number] = values[side * at(share, other, 1) + at(share, other, 0)];
  }
  return { values: found, each: inner.length };
}
