// One value of one asset over time, on axes of its own.

import { embedded, h, svg } from "meshcone/dom";
import { dateTime, number } from "meshcone/format";
import { changeWords, largerIsBetter, scaleOfMetric, WORTH_TELLING, worsening } from "meshcone/trends";

const [WIDTH, HEIGHT] = [270, 104];
const EDGE = { left: 62, right: 12, top: 10, bottom: 22 };
const WIDE = 30;  // largest by smallest, from which on the axis is logarithmic: one outlier flattens nothing
const DAY = 86_400_000;  // milliseconds

const names = embedded("words");

export const metricName = (metric) => {
  const name = names[metric] ?? metric;
  return name[0].toUpperCase() + name.slice(1);
};

/** A day, or a time where all of them are of one day. */
function dateLabel(time, span) {
  const form = span < DAY ? { hour: "2-digit", minute: "2-digit" } : { day: "numeric", month: "short" };
  return new Date(time).toLocaleString(undefined, form);
}

function axes(points) {
  const values = points.map(({ value }) => value);
  const [low, high] = [Math.min(...values), Math.max(...values)];
  const scale = low > 0 && high / low > WIDE ? Math.log10 : (value) => value;
  const [bottom, top] = [scale(low), scale(high)];
  const span = top - bottom || Math.abs(top) || 1;
  const [first, last] = [points[0].time, points.at(-1).time];
  return {
    low, high, first, last,
    x: (time) => EDGE.left + (last > first ? (time - first) / (last - first) : 0.5) * (WIDTH - EDGE.left - EDGE.right),
    y: (value) => HEIGHT - EDGE.bottom - (top > bottom ? 0.08 + (0.84 * (scale(value) - bottom)) / span : 0.5) * (HEIGHT - EDGE.top - EDGE.bottom),
  };
}

function drawing(metric, points, label) {
  const { low, high, first, last, x, y } = axes(points);
  const dots = points.map(({ value, time, job }, index) => {
    const isWorse = index > 0 && worsening(metric, points[index - 1].raw, points[index].raw) > WORTH_TELLING;
    return svg("circle", { class: isWorse ? "dot bad" : "dot", cx: x(time), cy: y(value), r: index === points.length - 1 ? 4 : 2.6 },
      svg("title", null, `${dateTime(job.created)}\n${number(value)}`));
  });
  const line = points.map(({ value, time }) => `${x(time)},${y(value)}`).join(" ");
  return svg("svg", { class: "plot", viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", "aria-label": label },
    svg("line", { class: "axis", x1: EDGE.left, x2: WIDTH - EDGE.right, y1: HEIGHT - EDGE.bottom, y2: HEIGHT - EDGE.bottom }),
    (high > low ? [low, high] : [low]).map((value) => svg("text", { x: EDGE.left - 8, y: y(value) + 4, "text-anchor": "end" }, number(value))),
    svg("text", { x: EDGE.left, y: HEIGHT - 6 }, dateLabel(first, last - first)),
    last > first && svg("text", { x: WIDTH - EDGE.right, y: HEIGHT - 6, "text-anchor": "end" }, dateLabel(last, last - first)),
    svg("polyline", { class: "trend", points: line }), dots);
}

/** A card's part: the value now, how it changed with the last run, and the way it went. */
export function trendChart(metric, asset) {
  const runs = asset.measured.filter((job) => metric in job.summary.metrics);
  const points = runs.map((job) => {
    const raw = job.summary.metrics[metric];
    return { raw, value: raw * scaleOfMetric(metric, job.summary.radius).scale, time: new Date(job.created).getTime(), job };
  });
  const { value, raw, job } = points.at(-1);
  const before = points.at(-2);
  const change = before && changeWords(worsening(metric, before.raw, raw));
  const unit = scaleOfMetric(metric, job.summary.radius).name;
  const told = `${metricName(metric)} of ${asset.name}: ${number(value)} ${unit} now, ${points.length} runs${largerIsBetter(metric) ? ", best at 1" : ""}`;
  return h("div", { class: "trend-chart" },
    h("div", { class: "trend-name", title: metricName(metric) }, metricName(metric)),
    h("div", { class: "trend-now" }, h("strong", null, number(value)), unit && h("span", { class: "hint" }, ` ${unit}`), change && h("span", { class: `change ${change.kind}` }, change.words)),
    drawing(metric, points, told));
}
