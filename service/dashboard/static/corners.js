// What images need at the corners of triangles, and the image that shows how coordinates run.

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

/** Decode the images of the skins of surfaces, once each. */
export async function decodeSkins(surfaces) {
  await Promise.all(Object.values(surfaces).map(async ({ skin }) => {
    if (skin) skin.bitmap = await createImageBitmap(skin.image);
  }));
}
