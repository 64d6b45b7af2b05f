// Where each surface is drawn: rectangles in CSS pixels, for each way of comparing.

/**
 * The panes of a view.
 * @param {{layout: string, shown: string, over: string[], wipe: number, turn: number}} state
 * @param {string[]} names of all surfaces
 * @returns {{names: string[], view: Object, clip: Object}[]} what is drawn over each other, the
 *   rectangle it is drawn for, and the one that it shows in
 */
export function panesOf({ layout, shown, over, wipe, turn }, names, width, height) {
  const whole = { x: 0, y: 0, width, height };
  if (layout === "one") return [{ names: [shown], view: whole, clip: whole }];
  if (layout === "blink") return [{ names: [over[turn]], view: whole, clip: whole }];
  if (layout === "overlay") return [{ names: over, view: whole, clip: whole }];
  if (layout === "wipe") {
    const at = Math.round(width * wipe);
    return [
      { names: [over[0]], view: whole, clip: { ...whole, width: at } },
      { names: [over[1]], view: whole, clip: { ...whole, x: at, width: width - at } },
    ];
  }
  const stacked = height > width;
  return names.map((name, number) => {
    const view = stacked
      ? { x: 0, y: (height / names.length) * number, width, height: height / names.length }
      : { x: (width / names.length) * number, y: 0, width: width / names.length, height };
    return { names: [name], view, clip: view };
  });
}

/** The pane a point of the canvas is in, and the point as cameras have it, in [-1, 1]². */
export function paneAt(panes, x, y) {
  const inside = ({ clip }) => x >= clip.x && x < clip.x + clip.width && y >= clip.y && y < clip.y + clip.height;
  const pane = panes.find(inside);
  if (!pane) return null;
  const { view } = pane;
  return { pane, at: { x: (2 * (x - view.x)) / view.width - 1, y: 1 - (2 * (y - view.y)) / view.height } };
}
