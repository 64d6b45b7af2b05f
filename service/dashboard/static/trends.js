// Runs of the same assets over time: how each value went, and who got worse since the run before.

import { pairWords } from "meshcone/job-words";

export const WORTH_TELLING = 1.05;  // a change of less is told apart from noise by nobody
const BETTER_IF_LARGER = new Set(["normal_consistency", "fscore"]);
const DISTANCES = new Set(["point_to_surface.mean", "point_to_surface.rms", "point_to_surface.p95", "point_to_surface.max", "hausdorff", "emd"]);
// Of samples of both surfaces, which tell less than the exact distances of all vertices where both are there.
const SAMPLED = new Set(["hausdorff", "hausdorff95", "emd", "chamfer", "chamfer_l1", "fscore", "normal_consistency"]);
const EXACT = "point_to_surface.max";
const FIRST = ["point_to_surface.max", "point_to_surface.p95", "point_to_surface.mean", "normal_deviation_deg"];

export const largerIsBetter = (metric) => BETTER_IF_LARGER.has(metric);

/** What a value is given in, and what leads to it from the value of a summary. */
export function scaleOfMetric(metric, radius) {
  if (DISTANCES.has(metric)) return { name: "model units", scale: radius };
  if (metric === "chamfer") return { name: "square model units", scale: radius * radius };
  return { name: "", scale: 1 };  // degrees are in the name
}

/** How much worse a value is than another: above 1 is worse, whichever way the metric goes. */
export function worsening(metric, before, after) {
  if (BETTER_IF_LARGER.has(metric)) return (1 - after + 1e-9) / (1 - before + 1e-9);
  return (after + 1e-12) / (before + 1e-12);
}

/** A factor as people say it: "5.8× worse"; null where nothing is worth telling. */
export function changeWords(factor) {
  if (factor > WORTH_TELLING) return { kind: "worse", words: factor > 100 ? "over 100× worse" : `${Number(factor.toPrecision(2))}× worse` };
  if (factor < 1 / WORTH_TELLING) return { kind: "better", words: factor < 0.01 ? "over 100× better" : `${Number((1 / factor).toPrecision(2))}× better` };
  return null;
}

/** What became of a job: its verdict, or that it could not be done; of one that is not done, its state. */
export function endingOf(job) {
  if (job.state === "failed") return "error";
  return job.state === "succeeded" ? job.verdict ?? "done" : job.state;
}

export const isBad = (ending) => ending === "fail" || ending === "error";

/** What is a worse end than each: less is known of the asset, or worse. */
const WORSE_ENDS = { pass: ["not_tested", "fail", "error"], not_tested: ["fail", "error"], done: ["fail", "error"], fail: ["error"], error: [] };

const measured = (job) => Object.keys(job.summary?.metrics ?? {}).length > 0;

/** What a sender calls a pair of a batch, else the names of its files. */
export const pairName = (job) => job.name ?? pairWords(job);

/** One asset: its runs from the oldest to the newest, and what has changed with the last. */
class Asset {
  constructor(name, runs) {
    this.name = name;
    this.runs = runs;
    [this.before, this.last] = runs.length > 1 ? runs.slice(-2) : [null, runs.at(-1)];
    this.measured = runs.filter(measured);
    this.ending = endingOf(this.last);
    this.brokeNow = this.before !== null && WORSE_ENDS[endingOf(this.before)].includes(this.ending);
    this.stoppedPassing = this.brokeNow && endingOf(this.before) === "pass";
    this.changes = new Map(this.#changes());
    this.telling = new Map([...this.changes].filter(([metric]) => !(SAMPLED.has(metric) && this.changes.has(EXACT))));
    this.worst = Math.max(0, ...this.telling.values());
  }

  /** Each metric of the last run with how much worse it is than in the run before. */
  #changes() {
    if (!measured(this.last)) return [];
    const before = this.measured.at(-2)?.summary.metrics ?? {};
    return Object.entries(this.last.summary.metrics).filter(([metric]) => metric in before)
      .map(([metric, now]) => [metric, worsening(metric, before[metric], now)]);
  }

  get state() {
    if (this.runs.length < 2) return "new";
    if (this.brokeNow || this.worst > WORTH_TELLING) return "worse";
    return [...this.telling.values()].some((factor) => factor < 1 / WORTH_TELLING) ? "better" : "same";
  }

  /** The metrics, what got worse most before all others. */
  get metrics() {
    const known = [...new Set(this.measured.flatMap((job) => Object.keys(job.summary.metrics)))];
    const place = (metric) => (FIRST.includes(metric) ? FIRST.indexOf(metric) : FIRST.length);
    const worse = (metric) => Math.max(this.telling.get(metric) ?? 0, WORTH_TELLING);
    return known.sort((a, b) => worse(b) - worse(a) || place(a) - place(b));
  }
}

/** Where an asset stands among the others: what broke now, then what got worse, then what is bad still. */
const rank = (asset) => [!asset.brokeNow, asset.state !== "worse", !isBad(asset.ending)].map(Number);

/**
 * The assets of jobs that have ended, regressions first.
 * @param {Object[]} jobs in any order
 */
export function assetsOf(jobs) {
  const runs = new Map();
  const ofBatches = new Map();
  for (const job of [...jobs].sort((a, b) => new Date(a.created) - new Date(b.created))) {
    // Pairs of one batch are assets of their own, whatever their files are called.
    const place = JSON.stringify([job.batch ?? job.id, pairName(job)]);
    const count = (ofBatches.get(place) ?? 0) + 1;
    ofBatches.set(place, count);
    const name = count > 1 ? `${pairName(job)} (${count})` : pairName(job);
    if (!runs.has(name)) runs.set(name, []);
    runs.get(name).push(job);
  }
  const assets = [...runs].map(([name, of]) => new Asset(name, of));
  const byRank = (a, b) => rank(a).reduce((found, value, index) => found || value - rank(b)[index], 0);
  return assets.sort((a, b) => byRank(a, b) || b.worst - a.worst || a.name.localeCompare(b.name));
}
