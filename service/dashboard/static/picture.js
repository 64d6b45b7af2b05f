// The view as a picture to keep: what is drawn, the names of the panes, and the scale.

import { h } from "meshcone/dom";
import { scaleBytes } from "meshcone/palette";

const EDGE = 16;
const STRIP = 64;

function paintScale(context, scale, { words, from, to }, top, width) {
  const bytes = new Uint8ClampedArray(scaleBytes(scale));
  const strip = h("canvas", { width: bytes.length / 4, height: 1 });
  strip.getContext("2d").putImageData(new ImageData(bytes, bytes.length / 4, 1), 0, 0);
  const span = Math.min(width - 2 * EDGE, 520);
  context.drawImage(strip, EDGE, top + 14, span, 12);
  context.textBaseline = "top";
  context.fillText(from, EDGE, top + 32);
  context.textAlign = "right";
  context.fillText(to, EDGE + span, top + 32);
  context.textAlign = "center";
  context.fillText(words, EDGE + span / 2, top + 32);
  context.textAlign = "left";
}

/**
 * Save the view as a PNG file.
 * @param {Viewer} viewer
 * @param {{name: string, labels: {x: number, y: number, text: string}[], legend: ?{words: string, from: string, to: string}}} around
 */
export async function savePicture(viewer, { name, labels, legend }) {
  const { canvas } = viewer;
  if (viewer.renderer.getContext().isContextLost()) throw new Error("the browser has taken the graphics away");
  viewer.draw();
  const ratio = viewer.renderer.getPixelRatio();
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  const picture = h("canvas", { width: Math.round(width * ratio), height: Math.round((height + (legend ? STRIP : 0)) * ratio) });
  const context = picture.getContext("2d");
  context.scale(ratio, ratio);
  const style = getComputedStyle(canvas.parentElement);
  context.fillStyle = style.backgroundColor;
  context.fillRect(0, 0, width, height + STRIP);
  context.drawImage(canvas, 0, 0, width, height);
  context.fillStyle = style.color;
  context.font = `600 14px ${style.fontFamily}`;
  for (const { x, y, text } of labels) context.fillText(text, x + EDGE, y + EDGE + 12);
  context.font = `13px ${style.fontFamily}`;
  if (legend) paintScale(context, viewer.state.scale, legend, height, width);
  return new Promise((resolve, reject) => {
    picture.toBlob((blob) => {
      if (!blob) return reject(new Error("the browser made no picture"));
      const url = URL.createObjectURL(blob);
      h("a", { href: url, download: name }).click();
      setTimeout(() => URL.revokeObjectURL(url), 60000);
      return resolve();
    }, "image/png");
  });
}
