// A job's state, outcome and verdict, in chips and in words.

import { h } from "meshcone/dom";
import { counted, number, times, words } from "meshcone/format";

const OUTCOMES = {
  improved: "closer to its reference than it was",
  indistinguishable: "on its reference, as closely as files store positions",
  undecided: "as close as it was, as far as samples can tell",
  unchanged: "no vertex moved",
  kept: "the input: every answer found was worse somewhere",
  misaligned: "the input: source and reference do not fit",
  reference_copy: "a copy of the reference, which is no refinement",
  worse: "farther from its reference than it was",
  different: "can be told from its reference",
};

export const chip = (kind, text = words(kind)) => h("span", { class: `chip ${kind}` }, text);

/** Whose a job is, where it matters: most installations have one project. */
export const projectTag = (job) => job.project !== "default" && h("span", { class: "tag", title: "project" }, job.project);

export const outcomeWords = (outcome) => OUTCOMES[outcome] ?? words(outcome);

export const hasEnded = (job) => ["succeeded", "failed", "canceled"].includes(job.state);

export const waitWords = (job) => (job.progress?.stage === "fetching" ? "Its files are being fetched" : job.needs_newer_worker ? "Waiting for a newer worker: those there are do not know its options" : "Waiting for a worker");

export function stageWords(progress) {
  if (!progress) return "starting";
  const round = progress.stage === "solve" && progress.rounds ? `, round ${progress.round} of ${progress.rounds}` : "";
  const said = { fetching: "fetching its files", read: "reading", solve: "solving", write: "writing", quality: "measuring", done: "done" };
  return (said[progress.stage] ?? progress.stage) + round;
}

/** What the gates say of a report, as one sentence. */
export function verdictSentence(gates) {
  if (!gates) return "No gates were set, so there is no verdict.";
  const { checks, verdict } = gates;
  const open = checks.filter(({ status }) => status !== "pass");
  const warned = open.filter(({ severity }) => severity === "warning").length;
  const withWarnings = warned ? `, with ${counted(warned, "warning")}` : "";
  if (verdict === "pass") {
    const held = checks.length - open.length;
    if (open.length) return `Passed${withWarnings}: ${held} of ${counted(checks.length, "check")} ${held === 1 || checks.length === 1 ? "holds" : "hold"}.`;
    return `Passed: ${checks.length === 1 ? "its check holds" : `${counted(checks.length, "check")} hold`}.`;
  }
  if (verdict === "fail") {
    // A warning decides nothing, so that it is not among those of which some failed.
    const deciding = checks.filter(({ severity }) => severity === "error");
    return `Failed${withWarnings}: ${deciding.filter(({ status }) => status === "fail").length} of ${counted(deciding.length, "check")}.`;
  }
  return `Not decided${withWarnings}: something could not be tested.`;
}

/** What lengths are told in: as the report's own sentences have it, by the formats of its files. */
export function unitOf({ inputs }) {
  const formats = [inputs.source, inputs.reference].filter(Boolean).map(({ format }) => format);
  if (formats.some((format) => ["gltf", "glb"].includes(format))) return "m";
  return formats.includes("step") ? "mm" : "units";
}

/** Whether a tolerance was reached, and where it was not. */
export function withinSentence({ asked, reached, attempts, places, unit }) {
  const tries = counted(attempts, "refinement");
  if (reached) return `Within ${asked}, as asked: reached with ${tries}.`;
  const worst = places[0];
  const where = worst ? ` Worst place: ${number(worst.distance_model)} ${unit} off near (${worst.position.map((each) => number(each)).join(", ")}).` : "";
  return `Not within ${asked} after ${tries}; this is the closest of them.${where}`;
}

/** The files of a job: source and, unless an asset was audited by itself, reference. */
export const pairWords = (job) => (job.reference ? `${job.source.name} → ${job.reference.name}` : job.source.name);

/** What became of the mesh, as one sentence. */
export function outcomeSentence(report) {
  if (report.mode === "audit") return report.changes ? changesSentence(report.changes) : "The asset was audited by itself.";
  const radius = report.frame.radius;
  const before = report.quality.input.point_to_surface.mean;
  const after = report.quality.refined?.point_to_surface.mean;
  const inUnits = (value) => number(value * radius);
  const unit = unitOf(report);
  if (after === undefined) return `The mesh lies ${inUnits(before)} ${unit} from its reference on average.`;
  if (report.outcome === "improved") {
    return `The refined mesh is ${times(before, after)} times closer to its reference: mean deviation ${inUnits(before)} → ${inUnits(after)} ${unit}.`;
  }
  return `The refined mesh is ${outcomeWords(report.outcome)}: mean deviation ${inUnits(before)} → ${inUnits(after)} ${unit}.`;
}

function changesSentence(changes) {
  const counts = ["lost", "added", "renamed", "moved", "altered"].flatMap((kind) => Object.values(changes[kind]));
  const count = counts.reduce((sum, each) => sum + (each ?? 0), 0);
  const told = count === 0 ? "Nothing but the surface differs" : `${count} ${count === 1 ? "thing differs" : "things differ"}`;
  const sentence = `${told} from the reference${count === 0 ? "" : " besides the surface"}.`;
  // Null: images or material libraries that both files name were not sent.
  return counts.includes(null) ? `${sentence} Images or materials that were not sent were not compared.` : sentence;
}

/** What is worst about a finished job, for a row of a table. */
export function worstWords({ summary, verdict }) {
  if (!summary) return "";
  const { worst } = summary;
  // What does not pass in a job that passes is a warning.
  if (worst) return `${worst.words}${verdict === "pass" && worst.status !== "pass" ? " (a warning)" : ""}`;
  if (summary.radius === null) return "";
  return `worst deviation ${number(summary.metrics["point_to_surface.max"] * summary.radius)}`;
}
