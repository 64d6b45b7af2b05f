// Two jobs side by side: their meshes under one camera, and their values with the difference.

import { getJson, request, said } from "meshcone/api";
import { h } from "meshcone/dom";
import { dateTime, number } from "meshcone/format";
import { chip, hasEnded } from "meshcone/job-words";
import { hasWebGl, LOST, threeJs } from "meshcone/library";
import { colourOf, cssColour } from "meshcone/palette";
import { quantile, readPreview } from "meshcone/scene-file";
import { thumbnail } from "meshcone/thumbnail";
import { metricName } from "meshcone/trend-chart";
import { changeWords, endingOf, pairName, scaleOfMetric, worsening } from "meshcone/trends";
import { Viewer } from "meshcone/viewer";

const SIDES = ["Before", "After"];
const PANES = ["input", "refined"];  // the names under which the viewer draws two meshes
const SHOWN = 0.99;  // share of the vertices within the scale
const STOPS = 24;  // colours of the legend
const COLOURS = [["deviation", "Deviation"], ["difference", "Difference"], ["shape", "Shape"]];

/** The mesh that a job is judged by, its deviation in model units. */
async function judgedMesh(job) {
  const { surfaces, radius } = readPreview(await (await request(job.links.preview)).arrayBuffer());
  const surface = surfaces.refined ?? surfaces.input;
  return { ...surface, deviation: surface.deviation.map((value) => value * radius) };
}

/** How much farther off the later of two meshes is at each vertex; null where they have not the same. */
function differenceOf([before, after]) {
  if (before.deviation.length !== after.deviation.length || before.index.length !== after.index.length) return null;
  return after.deviation.map((value, index) => value - before.deviation[index]);
}

/** The scale that shows nearly all of some values: from zero, or from minus to plus where they have a sign. */
function scaleOf(values, signed) {
  const top = Math.max(...values.map((each) => quantile(each.map(Math.abs), SHOWN))) || 1e-9;
  return { low: signed ? -top : 0, top, threshold: null };
}

const loading = () => h("p", { class: "loading", role: "status" }, "Loading the meshes …");

class PairView {
  constructor(jobs) {
    this.jobs = jobs;
    this.canvas = h("canvas", { tabindex: "0", role: "application", "aria-label": "Both meshes in three dimensions: arrow keys turn them, plus and minus zoom" });
    this.over = h("div", { class: "over" }, loading());
    this.tools = h("div", { class: "tools", role: "toolbar", "aria-label": "How the meshes are shown" });
    this.legend = h("div", { class: "pair-scale" });
    this.view = h("div", { class: "pair-view", "data-testid": "two-view" }, this.canvas, ...SIDES.map((side, index) => h("span", { class: `side-name ${PANES[index]}` }, side)), this.over);
    this.element = h("section", { class: "card pair", "aria-label": "Meshes" }, this.tools, this.view, this.legend);
  }

  async start() {
    if (!hasWebGl()) return this.say("This browser draws nothing in three dimensions: WebGL is off.");
    let loaded;
    try {
      loaded = await Promise.all([threeJs(), ...this.jobs.map(judgedMesh)]);
    } catch (error) {
      return this.say(`The meshes cannot be shown: ${said(error)} `, h("button", { type: "button", onclick: () => this.again() }, "Try again"));
    }
    try {
      const [THREE, ...meshes] = loaded;
      const difference = differenceOf(meshes);
      for (const mesh of meshes) mesh.difference = difference;
      this.scales = { deviation: scaleOf(meshes.map(({ deviation }) => deviation), false), difference: difference && scaleOf([difference], true), shape: null };
      this.viewer = new Viewer(THREE, this.canvas, { surfaces: Object.fromEntries(meshes.map((mesh, index) => [PANES[index], mesh])) });
      this.viewer.onLost = (lost) => { if (lost) this.say(LOST); else this.over.hidden = true; };
      this.tools.replaceChildren(h("div", { class: "choice", role: "group", "aria-label": "Colour" }, COLOURS.map(([colour, words]) => h("button", {
        type: "button", "data-colour": colour, disabled: colour === "difference" && !difference, title: colour === "difference" && !difference ? "The meshes have other vertices" : undefined, onclick: () => this.colour(colour),
      }, words))), h("button", { type: "button", class: "quiet", onclick: () => this.viewer.orbit.reset() }, "Reset"));
      this.over.hidden = true;
      this.colour("deviation");
      this.view.dataset.ready = "true";
    } catch (error) {
      this.say(`The meshes cannot be shown: ${error.message}`);
    }
    return undefined;
  }

  colour(colour) {
    for (const button of this.tools.querySelectorAll("[data-colour]")) button.setAttribute("aria-pressed", String(button.dataset.colour === colour));
    const scale = this.scales[colour];
    this.viewer.set({ colour, scale });
    this.legend.hidden = scale === null;
    if (scale === null) return;
    const { low, top } = scale;
    const stops = Array.from({ length: STOPS }, (_, stop) => cssColour(colourOf(low + (stop / (STOPS - 1)) * (top - low), scale)));
    const ends = [low, top].map((value) => h("span", null, number(value)));
    const strip = h("span", { class: "strip-of-colours", role: "img", "aria-label": `colours from ${number(low)} to ${number(top)} model units`, style: { background: `linear-gradient(to right, ${stops.join(", ")})` } });
    const words = low < 0 ? "after less before, model units: warm is farther off than it was" : "deviation, model units";
    this.legend.replaceChildren(ends[0], strip, ends[1], h("span", { class: "hint" }, words));
  }

  /** Fetch once more what could not be had. */
  again() {
    this.over.replaceChildren(loading());
    this.canvas.focus();
    return this.start();
  }

  say(...content) {
    this.over.hidden = false;
    this.over.replaceChildren(h("p", { class: "notice", role: "alert" }, content));
  }
}

function head(job, side) {
  return h("div", { class: "asset-head" }, thumbnail(job),
    h("div", null, h("span", { class: "hint" }, `${side} · ${dateTime(job.created)}`),
      h("h3", null, h("a", { href: `/jobs/${job.id}` }, pairName(job))),
      h("div", { class: "chips" }, chip(endingOf(job), endingOf(job) === "done" ? "no gates" : undefined), h("span", { class: "soft" }, job.summary?.worst?.words ?? job.error?.detail ?? ""))));
}

/** What keeps two jobs from having values to compare. */
function whyNone(jobs) {
  const reason = (job) => {
    if (!hasEnded(job)) return "has not ended yet";
    if (job.state === "canceled") return "was canceled";
    if (job.state === "failed") return "could not be done";
    return job.mode === "audit" ? "was audited by itself" : null;
  };
  const told = jobs.map((job, index) => reason(job) && `the one ${SIDES[index].toLowerCase()} ${reason(job)}`).filter(Boolean);
  return told.join(", and ") || "other things were measured of each";
}

/** The values of both with their difference, what got worse most first. */
function table(before, after) {
  const of = (job) => job.summary?.metrics ?? {};
  const factor = (metric) => worsening(metric, of(before)[metric], of(after)[metric]);
  const metrics = Object.keys(of(after)).filter((metric) => metric in of(before)).sort((a, b) => factor(b) - factor(a));
  if (!metrics.length) return h("p", { class: "card soft" }, `The two have no value in common: ${whyNone([before, after])}.`);
  const row = (metric) => {
    const [was, now] = [before, after].map((job) => of(job)[metric] * scaleOfMetric(metric, job.summary.radius).scale);
    const change = changeWords(factor(metric));
    const unit = scaleOfMetric(metric, 1).name;
    return h("tr", null,
      h("th", { scope: "row" }, metricName(metric), unit && h("span", { class: "hint" }, ` ${unit}`)),
      [was, now].map((value) => h("td", { class: "number" }, number(value))),
      h("td", { class: "number" }, `${now > was ? "+" : ""}${number(now - was)}`),
      h("td", { class: change?.kind ?? "soft" }, change?.words ?? "about the same"));
  };
  return h("section", { class: "card", "aria-labelledby": "values-title" },
    h("h2", { id: "values-title" }, "Values"),
    h("div", { class: "scroll", tabindex: "0", role: "region", "aria-labelledby": "values-title" }, h("table", null,
      h("thead", null, h("tr", null, h("th", { scope: "col" }, "Value"), [...SIDES, "Difference"].map((title) => h("th", { scope: "col", class: "number" }, title)), h("th", { scope: "col" }, "Change"))),
      h("tbody", null, metrics.map(row)))));
}

/**
 * Show two jobs.
 * @param {string[]} ids of the jobs; the older one comes first
 * @param {{put: Function, signal: AbortSignal}} filling `put` fills the page and says whether it did;
 *   nothing more is asked for once the signal aborts
 */
export async function showTwo(ids, { put, signal }) {
  put(h("p", { class: "loading", role: "status" }, "Loading the jobs …"));
  const jobs = await Promise.all(ids.map((id) => getJson(`/v1/jobs/${encodeURIComponent(id)}`, { signal })));
  jobs.sort((a, b) => new Date(a.created) - new Date(b.created));
  const shared = jobs[0].labels.filter((label) => jobs[1].labels.includes(label));
  const view = jobs.every((job) => job.links.preview) ? new PairView(jobs) : null;
  const shown = put(
    h("p", { class: "chips" }, shared.map((label) => h("a", { class: "tag", href: `/compare?${new URLSearchParams({ label })}` }, `All runs of ${label}`))),
    h("div", { class: "columns" }, jobs.map((job, index) => h("section", { class: `card verdict ${endingOf(job)}`, "aria-label": SIDES[index] }, head(job, SIDES[index])))),
    ...(view ? [view.element] : []),
    table(...jobs));
  if (shown) await view?.start();
}
