// Many jobs of one label: what got worse first, then each metric over time.

import { getJson, said } from "meshcone/api";
import { byId, embedded, h, svg } from "meshcone/dom";
import { dateTime, number } from "meshcone/format";

const MOST = 1000;  // jobs; the newest
const WORTH_TELLING = 1.05;  // a change of less is told apart from noise by nobody
const BETTER_IF_LARGER = new Set(["normal_consistency", "fscore"]);
const DISTANCES = new Set(["point_to_surface.mean", "point_to_surface.rms", "point_to_surface.p95", "point_to_surface.max", "hausdorff", "emd"]);
const [WIDTH, HEIGHT] = [420, 190];
const EDGE = { left: 60, right: 84, top: 12, bottom: 26 };

const place = byId("comparison");
const names = embedded("words");
const named = (metric) => names[metric] ?? metric;

/** How much worse a value is than another: above 1 is worse, whichever way the metric goes. */
function worsening(metric, before, after) {
  if (BETTER_IF_LARGER.has(metric)) return (1 - after + 1e-9) / (1 - before + 1e-9);
  return (after + 1e-12) / (before + 1e-12);
}

async function jobsOf(label) {
  const jobs = [];
  let cursor = null;
  do {
    const query = new URLSearchParams({ label, state: "succeeded", limit: "200" });
    if (cursor) query.set("cursor", cursor);
    const page = await getJson(`/v1/jobs?${query}`);
    jobs.push(...page.jobs.filter((job) => Object.keys(job.summary?.metrics ?? {}).length));
    cursor = page.next;
  } while (cursor && jobs.length < MOST);
  return jobs.sort((a, b) => new Date(a.created) - new Date(b.created));
}

/** For each pair of files and each metric, the latest value beside the one before. */
function changes(jobs) {
  const pairs = Map.groupBy ? Map.groupBy(jobs, pairName) : group(jobs);
  return [...pairs].flatMap(([pair, runs]) => {
    if (runs.length < 2) return [];
    const [before, after] = runs.slice(-2);
    return Object.keys(after.summary.metrics).map((metric) => {
      const [was, now] = [before, after].map((job) => job.summary.metrics[metric]);
      return { pair, metric, was, now, job: after, radius: after.summary.radius, factor: worsening(metric, was, now) };
    });
  }).sort((a, b) => b.factor - a.factor);
}

const pairName = (job) => `${job.source.name} → ${job.reference.name}`;

function group(jobs) {
  const pairs = new Map();
  for (const job of jobs) pairs.set(pairName(job), [...(pairs.get(pairName(job)) ?? []), job]);
  return pairs;
}

function regressions(all) {
  const worse = all.filter(({ factor }) => factor > WORTH_TELLING);
  const better = all.filter(({ factor }) => factor < 1 / WORTH_TELLING).length;
  if (!all.length) return h("section", { class: "card" }, h("h2", null, "Regressions"), h("p", { class: "soft" }, "No pair of files has been sent twice under this label, so nothing can have become worse."));
  if (!worse.length) return h("section", { class: "card verdict pass" }, h("p", { class: "headline" }, "Nothing got worse"), h("p", { class: "soft" }, `${better} values are better than in the run before by more than 5 %.`));
  const value = ({ metric, radius }, figure) => number(DISTANCES.has(metric) ? figure * radius : figure);
  return h("section", { class: "card verdict fail", "aria-labelledby": "worse-title" },
    h("h2", { id: "worse-title" }, `${worse.length} ${worse.length === 1 ? "value is" : "values are"} worse than in the run before`),
    h("div", { class: "scroll", tabindex: "0", role: "region", "aria-labelledby": "worse-title" }, h("table", null,
      h("thead", null, h("tr", null, ["Pair", "Metric"].map((head) => h("th", { scope: "col" }, head)), ["Before", "Now", "Worse by"].map((head) => h("th", { scope: "col", class: "number" }, head)))),
      h("tbody", null, worse.slice(0, 30).map((change) => h("tr", null,
        h("th", { scope: "row" }, h("a", { href: `/jobs/${change.job.id}` }, change.pair)),
        h("td", null, named(change.metric)),
        h("td", { class: "number" }, value(change, change.was)),
        h("td", { class: "number worse" }, value(change, change.now)),
        h("td", { class: "number worse" }, change.factor > 100 ? "over 100 times" : `${number(change.factor, 3)} times`)))))),
    h("p", { class: "hint" }, "Distances in model units. A metric that is best at 1 is compared by how much it falls short of it."));
}

const middle = (sorted, share) => sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))];

/** A metric over the runs, on a log axis where it is a distance, and its quartiles beside it. */
function chart(metric, jobs, worst) {
  const values = jobs.map((job) => job.summary.metrics[metric]);
  const positive = !BETTER_IF_LARGER.has(metric) && values.every((value) => value > 0);
  const scale = positive ? Math.log10 : (value) => value;
  const scaled = values.map(scale);
  const low = Math.min(...scaled);
  const high = Math.max(...scaled);
  const span = high - low || Math.abs(high) || 1;
  const y = (value) => HEIGHT - EDGE.bottom - ((scale(value) - low + 0.08 * span) / (1.16 * span)) * (HEIGHT - EDGE.top - EDGE.bottom);
  const x = (index) => EDGE.left + ((index + 0.5) / jobs.length) * (WIDTH - EDGE.left - EDGE.right);
  const sorted = [...values].sort((a, b) => a - b);
  const [quarter, half, threeQuarters] = [0.25, 0.5, 0.75].map((share) => middle(sorted, share));
  const box = WIDTH - EDGE.right + 14;
  const bad = new Set(worst.filter((change) => change.metric === metric && change.factor > WORTH_TELLING).map(({ job }) => job.id));
  const dots = jobs.map((job, index) => svg("a", { href: `/jobs/${job.id}`, "aria-label": `${pairName(job)}, ${dateTime(job.created)}: ${number(values[index])}` },
    svg("circle", { class: bad.has(job.id) ? "dot bad" : "dot", cx: x(index), cy: y(values[index]), r: 4 }, svg("title", null, `${pairName(job)}\n${dateTime(job.created)}\n${number(values[index])}`))));
  const level = (value) => [svg("text", { x: EDGE.left - 6, y: y(value) + 4, "text-anchor": "end" }, number(value))];
  return h("section", { class: "card" },
    h("h3", { style: { marginTop: "0" } }, named(metric)[0].toUpperCase() + named(metric).slice(1)),
    svg("svg", { class: "plot", viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "group", "aria-label": `${named(metric)} of ${jobs.length} jobs over time` },
      jobs.length > 3 && svg("rect", { class: "band", x: EDGE.left, width: WIDTH - EDGE.left - EDGE.right, y: y(threeQuarters), height: Math.max(1, y(quarter) - y(threeQuarters)) }),
      svg("line", { class: "median", x1: EDGE.left, x2: WIDTH - EDGE.right, y1: y(half), y2: y(half) }),
      level(sorted[0]), sorted.length > 1 && y(sorted[0]) - y(sorted.at(-1)) > 16 && level(sorted.at(-1)),
      jobs.length > 3 && svg("rect", { class: "band", x: box, width: 16, y: y(threeQuarters), height: Math.max(2, y(quarter) - y(threeQuarters)) }),
      jobs.length > 3 && svg("line", { class: "median", x1: box, x2: box + 16, y1: y(half), y2: y(half) }),
      jobs.length > 3 && svg("text", { x: box + 20, y: y(half) + 4 }, "median"),
      svg("text", { x: EDGE.left, y: HEIGHT - 8 }, "oldest"),
      svg("text", { x: WIDTH - EDGE.right, y: HEIGHT - 8, "text-anchor": "end" }, "newest"),
      dots));
}

async function compare(label) {
  place.replaceChildren(h("p", { class: "loading", role: "status" }, "Loading the jobs …"));
  try {
    const jobs = await jobsOf(label);
    if (!jobs.length) {
      place.replaceChildren(h("div", { class: "card empty" }, h("strong", null, "No finished job has this label"), "Jobs get their labels when they are sent: in the form of the page Jobs, or by ", h("code", null, "meshcone submit --label"), "."));
      return;
    }
    const all = changes(jobs);
    const worstOf = (metric) => Math.max(0, ...all.filter((change) => change.metric === metric).map(({ factor }) => factor));
    const metrics = Object.keys(jobs.at(-1).summary.metrics).sort((a, b) => worstOf(b) - worstOf(a));
    place.replaceChildren(
      h("p", { class: "soft", role: "status" }, `${jobs.length} finished ${jobs.length === 1 ? "job" : "jobs"}, from ${dateTime(jobs[0].created)} to ${dateTime(jobs.at(-1).created)}`),
      regressions(all),
      h("h2", { style: { margin: "18px 0 10px" } }, "Each metric over time"),
      h("div", { class: "charts" }, metrics.map((metric) => chart(metric, jobs.filter((job) => metric in job.summary.metrics), all))),
      h("p", { class: "hint" }, "Band: the middle half of all values. Red: worse than the run before of the same files. Distances relative to the radius."));
  } catch (error) {
    place.replaceChildren(h("p", { class: "notice error", role: "alert" }, said(error), " ", h("button", { type: "button", onclick: () => compare(label) }, "Try again")));
  }
}

async function offerLabels(input) {
  const page = await getJson("/v1/jobs?limit=200");
  const labels = [...new Set(page.jobs.flatMap((job) => job.labels))].sort();
  if (!labels.length) {
    place.replaceChildren(h("div", { class: "card empty" }, h("strong", null, "No job has a label yet"), "Give jobs that belong together the same label, such as the name of a nightly run."));
    return;
  }
  place.replaceChildren(h("p", { class: "chips" }, h("span", { class: "soft" }, "Labels of the newest jobs:"), labels.map((label) => h("a", { class: "tag", href: `/compare?label=${encodeURIComponent(label)}` }, label))));
  input.focus();
}

const choose = byId("choose");
const label = new URLSearchParams(location.search).get("label");
choose.addEventListener("submit", (event) => {
  event.preventDefault();
  const wanted = choose.elements.label.value.trim();
  history.pushState(null, "", `?${new URLSearchParams({ label: wanted })}`);
  compare(wanted);
});
if (label) {
  choose.elements.label.value = label;
  compare(label);
} else {
  offerLabels(choose.elements.label).catch((error) => place.replaceChildren(h("p", { class: "notice error", role: "alert" }, said(error))));
}
