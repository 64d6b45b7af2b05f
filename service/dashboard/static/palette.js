// Colours for values: even to the eye, light at zero in both themes, and hot beyond a threshold.

// Each ramp is at even steps of CIELAB along a path through OKLCH, from L* 96 down to 37: light
// where nothing deviates, and never so dark that it would be lost on a dark ground.
export const COOL = [[246, 244, 235], [208, 233, 208], [155, 220, 204], [101, 202, 207], [71, 180, 208], [61, 157, 206], [65, 132, 197], [73, 106, 183], [78, 78, 164]];
// What lies beyond a threshold, and nothing else, has one of these.
export const HOT = [[246, 140, 38], [241, 96, 23], [225, 58, 44], [202, 24, 63], [172, 6, 79]];
// The other side of a signed scale.
export const WARM = [[246, 244, 235], [241, 225, 187], [238, 202, 141], [236, 175, 99], [234, 145, 66], [230, 111, 42], [213, 75, 42], [192, 49, 51], [164, 27, 59]];

function between(stops, share) {
  const place = Math.min(Math.max(share, 0), 1) * (stops.length - 1);
  const low = Math.min(Math.floor(place), stops.length - 2);
  return stops[low].map((value, channel) => (value + (stops[low + 1][channel] - value) * (place - low)) / 255);
}

/**
 * The colour, (r, g, b) in [0, 1], of a value.
 * @param {{low: number, top: number, threshold: ?number}} scale of values from `low`, which is zero
 *   or, where values have a sign, minus `top`
 */
export function colourOf(value, { low, top, threshold }) {
  if (low < 0) return between(value < 0 ? COOL : WARM, Math.abs(value) / top);
  if (threshold === null || threshold >= top) return between(COOL, top > 0 ? value / (threshold ?? top) : 0);
  if (value <= threshold) return between(COOL, threshold > 0 ? value / threshold : 0);
  return between(HOT, (value - threshold) / (top - threshold));
}

/** A colour as style sheets write it. */
export const cssColour = (colour) => `rgb(${colour.map((channel) => Math.round(255 * channel)).join(" ")})`;

const STEPS = 1024;

/** The scale from left to right, four bytes a step. */
export function scaleBytes(scale) {
  const made = new Uint8Array(4 * STEPS);
  for (let step = 0; step < STEPS; step += 1) {
    const colour = colourOf(scale.low + ((step + 0.5) / STEPS) * (scale.top - scale.low), scale);
    made.set([...colour.map((channel) => Math.round(255 * channel)), 255], 4 * step);
  }
  return made;
}
