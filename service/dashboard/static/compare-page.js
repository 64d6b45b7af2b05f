// Many jobs of one label, each asset over time; or two jobs side by side.

import { getJson, said } from "meshcone/api";
import { assetTrend } from "meshcone/asset-trend";
import { byId, h } from "meshcone/dom";
import { counted, dateTime } from "meshcone/format";
import { hasEnded } from "meshcone/job-words";
import { assetsOf, isBad } from "meshcone/trends";
import { showTwo } from "meshcone/two-jobs";

const MOST = 1000;  // jobs; the newest
const AT_A_TIME = 25;  // assets

const place = byId("comparison");
let choosing = new AbortController();

/** What fills the page until something else is chosen: an answer that comes later is not shown under its name. */
function filler() {
  choosing.abort();
  choosing = new AbortController();
  const { signal } = choosing;
  const put = (...parts) => {
    if (!signal.aborted) place.replaceChildren(...parts);
    return !signal.aborted;
  };
  return { put, signal };
}

async function jobsOf(label, signal) {
  const jobs = [];
  let cursor = null;
  do {
    const query = new URLSearchParams({ label, limit: "200" });
    if (cursor) query.set("cursor", cursor);
    const page = await getJson(`/v1/jobs?${query}`, { signal });
    jobs.push(...page.jobs.filter((job) => hasEnded(job) && job.state !== "canceled"));
    cursor = page.next;
  } while (cursor && jobs.length < MOST);
  return jobs.slice(0, MOST);
}

const failing = (count) => `${counted(count, "asset")} ${count === 1 ? "fails" : "fail"}`;

/** What a person comes for, in one sentence. */
function headline(assets) {
  const of = (state) => assets.filter((asset) => asset.state === state).length;
  const worse = of("worse");
  const stopped = assets.filter(({ stoppedPassing }) => stoppedPassing).length;
  const broke = assets.filter(({ brokeNow }) => brokeNow).length - stopped;
  const compared = assets.length - of("new");
  const stillFail = assets.filter(({ brokeNow, before, ending }) => !brokeNow && before && isBad(ending)).length;
  const failAtFirst = assets.filter(({ before, ending }) => !before && isBad(ending)).length;
  const undecided = assets.filter(({ brokeNow, ending }) => !brokeNow && ending === "not_tested").length;
  const facts = [stopped && `${counted(stopped, "asset")} stopped passing`, broke && `${counted(broke, "asset")} came to a worse end`, of("better") && `${counted(of("better"), "asset")} got better and no worse`, of("new") && `${counted(of("new"), "asset")} ran only once`, stillFail && `${failing(stillFail)} still`, failAtFirst && `${failing(failAtFirst)} in the only run`, undecided && `${counted(undecided, "asset")} not decided`];
  const words = compared === 0 ? "Nothing to compare yet: no asset has run twice" : worse === 0 ? "Nothing got worse" : `${worse} of ${counted(compared, "asset")} got worse`;
  // Green is for assets that are well, not for those that fail as they did.
  const isWell = stillFail + failAtFirst + undecided === 0;
  const kind = compared === 0 ? "" : worse ? "fail" : isWell ? "pass" : "";
  return h("section", { class: `card verdict ${kind}`, "data-testid": "headline" },
    h("h2", { class: "headline" }, words),
    h("p", { class: "soft" }, [...facts.filter(Boolean), "compared with the run before, by more than 5 %"].join(" · ")));
}

/** Cards for the assets, some at a time. */
function list(assets) {
  const cards = h("div");
  const button = h("button", { type: "button", onclick: more }, "Show more");
  let shown = 0;
  function more() {
    cards.append(...assets.slice(shown, shown + AT_A_TIME).map(assetTrend));
    shown += AT_A_TIME;
    button.hidden = shown >= assets.length;
  }
  more();
  return [cards, h("p", { class: "actions centred" }, button)];
}

async function compare(label, { put, signal }) {
  put(h("p", { class: "loading", role: "status" }, "Loading the jobs …"));
  const jobs = await jobsOf(label, signal);
  if (!jobs.length) {
    put(h("div", { class: "card empty" }, h("strong", null, "No finished job has this label"), "Jobs get their labels when they are sent: in the form of the page Jobs, or by ", h("code", null, "meshcone submit --label"), "."));
    return;
  }
  const assets = assetsOf(jobs);
  const times = jobs.map((job) => new Date(job.created).getTime());
  put(
    headline(assets),
    h("p", { class: "soft", role: "status" }, `${counted(jobs.length, "run")} of ${counted(assets.length, "asset")}, ${dateTime(Math.min(...times))} to ${dateTime(Math.max(...times))}. Regressions first; red: worse than the run before.`),
    ...list(assets));
}

async function offerLabels(input, { put, signal }) {
  put(h("p", { class: "loading", role: "status" }, "Loading the labels …"));
  const page = await getJson("/v1/jobs?limit=200", { signal });
  const labels = [...new Set(page.jobs.flatMap((job) => job.labels))].sort();
  if (!labels.length) {
    put(h("div", { class: "card empty" }, h("strong", null, "No job has a label yet"), "Give jobs that belong together the same label, such as the name of a nightly run."));
    return;
  }
  if (put(h("p", { class: "chips" }, h("span", { class: "soft" }, "Labels of the newest jobs:"), labels.map((label) => h("a", { class: "tag", href: `/compare?${new URLSearchParams({ label })}` }, label))))) input.focus();
}

const choose = byId("choose");
choose.addEventListener("submit", (event) => {
  event.preventDefault();
  const wanted = choose.elements.label.value.trim();
  history.pushState(null, "", `?${new URLSearchParams({ label: wanted })}`);
  start();
});
addEventListener("popstate", start);

function start() {
  const query = new URLSearchParams(location.search);
  const label = query.get("label") ?? "";
  const two = query.get("jobs")?.split(",") ?? [];
  choose.elements.label.value = label;
  choose.hidden = two.length === 2;
  const filling = filler();
  const shown = two.length === 2 ? showTwo(two, filling) : label ? compare(label, filling) : offerLabels(choose.elements.label, filling);
  shown.catch((error) => filling.put(h("p", { class: "notice error", role: "alert" }, said(error), " ", h("button", { type: "button", onclick: start }, "Try again"))));
}
start();
