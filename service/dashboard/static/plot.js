// Lines on logarithmic axes, as SVG: what a residual plot needs, and no more.

import { h, svg } from "meshcone/dom";

const WIDTH = 560;
const HEIGHT = 240;
const EDGE = { left: 52, right: 12, top: 10, bottom: 34 };
const SMALLEST = 1e-17;

const power = (exponent) => `1e${exponent}`;

function decades(values) {
  const exponents = values.filter((value) => value > SMALLEST).map(Math.log10);
  if (!exponents.length) return [-1, 0];
  const low = Math.floor(Math.min(...exponents));
  return [low, Math.max(low + 1, Math.ceil(Math.max(...exponents)))];
}

/**
 * A plot of lines.
 * @param {{name: string, x: number[], y: number[]}[]} lines
 * @param {{label: string, xTitle: string, level: ?{value: number, name: string}}} options
 */
export function logPlot(lines, { label, xTitle, level = null }) {
  const [xLow, xHigh] = decades(lines.flatMap(({ x }) => x));
  const [yLow, yHigh] = decades([...lines.flatMap(({ y }) => y), ...(level ? [level.value] : [])]);
  const along = (value) => EDGE.left + ((Math.log10(Math.max(value, 10 ** xLow)) - xLow) / (xHigh - xLow)) * (WIDTH - EDGE.left - EDGE.right);
  const up = (value) => HEIGHT - EDGE.bottom - ((Math.log10(Math.max(value, 10 ** yLow)) - yLow) / (yHigh - yLow)) * (HEIGHT - EDGE.top - EDGE.bottom);
  const every = Math.ceil((yHigh - yLow) / 7);
  const grid = [];
  for (let exponent = yLow; exponent <= yHigh; exponent += every) {
    const y = up(10 ** exponent);
    grid.push(svg("line", { class: "axis", x1: EDGE.left, x2: WIDTH - EDGE.right, y1: y, y2: y }), svg("text", { x: EDGE.left - 6, y: y + 4, "text-anchor": "end" }, power(exponent)));
  }
  for (let exponent = xLow; exponent <= xHigh; exponent += 1) {
    const x = along(10 ** exponent);
    grid.push(svg("line", { class: "axis", x1: x, x2: x, y1: EDGE.top, y2: HEIGHT - EDGE.bottom }), svg("text", { x, y: HEIGHT - EDGE.bottom + 15, "text-anchor": "middle" }, (10 ** exponent).toLocaleString("en")));
  }
  grid.push(svg("text", { x: (WIDTH + EDGE.left) / 2, y: HEIGHT - 3, "text-anchor": "middle" }, xTitle));
  const drawn = lines.map(({ x, y }, index) => {
    const points = x.map((value, step) => [value, y[step]]).filter(([a, b]) => a > 0 && b > SMALLEST).map(([a, b]) => [along(a), up(b)]);
    if (points.length === 1) return svg("circle", { class: `series-${index}`, fill: "none", "stroke-width": 2, cx: points[0][0], cy: points[0][1], r: 4 });
    return svg("polyline", { class: `series-${index}`, fill: "none", "stroke-width": 1.8, points: points.map((point) => point.join(",")).join(" ") });
  });
  const bound = level && [svg("line", { class: "tolerance", x1: EDGE.left, x2: WIDTH - EDGE.right, y1: up(level.value), y2: up(level.value) }), svg("text", { x: WIDTH - EDGE.right - 4, y: up(level.value) - 4, "text-anchor": "end" }, level.name)];
  return h("div", null,
    svg("svg", { class: "plot", viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", "aria-label": label }, grid, bound, drawn),
    h("div", { class: "keys" }, lines.map(({ name }, index) => h("span", null, h("i", { class: `series-${index}` }), name))));
}
