// Colours for values: viridis up to a threshold, and from there on colours it does not have.

// Viridis at nine even places (S. van der Walt, N. Smith; CC0); the other end by hand.
const BELOW = [[68, 1, 84], [71, 44, 122], [59, 81, 139], [44, 113, 142], [33, 144, 141], [39, 173, 129], [92, 200, 99], [170, 220, 50], [253, 231, 37]];
const ABOVE = [[255, 150, 90], [240, 70, 70], [200, 20, 90]];

function between(stops, share) {
  const place = Math.min(Math.max(share, 0), 1) * (stops.length - 1);
  const low = Math.min(Math.floor(place), stops.length - 2);
  return stops[low].map((value, channel) => (value + (stops[low + 1][channel] - value) * (place - low)) / 255);
}

/** The colour, (r, g, b) in [0, 1], of a value on a scale up to `top`, with a threshold or none. */
export function colourOf(value, top, threshold) {
  if (threshold === null || threshold >= top) return between(BELOW, top > 0 ? value / (threshold ?? top) : 0);
  if (value <= threshold) return between(BELOW, threshold > 0 ? value / threshold : 0);
  return between(ABOVE, (value - threshold) / (top - threshold));
}

const STEPS = 1024;

/** The scale from left to right, four bytes a step. */
export function scaleBytes(top, threshold) {
  const made = new Uint8Array(4 * STEPS);
  for (let step = 0; step < STEPS; step += 1) {
    const colour = colourOf(((step + 0.5) / STEPS) * top, top, threshold);
    made.set([...colour.map((channel) => Math.round(255 * channel)), 255], 4 * step);
  }
  return made;
}

/** Paint the scale from left to right. */
export function paintScale(canvas, top, threshold) {
  canvas.width = STEPS;
  canvas.height = 1;
  canvas.getContext("2d").putImageData(new ImageData(new Uint8ClampedArray(scaleBytes(top, threshold)), STEPS, 1), 0, 0);
}
