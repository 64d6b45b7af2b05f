// The bounds that gates set: in which unit each is, and how it is written.

import { number } from "meshcone/format";
import { unitOf } from "meshcone/job-words";

// Lengths of the units in metres, as gates know them (meshcone/gates/units.py).
const METRES = { m: 1, mm: 0.001, cm: 0.01, um: 1e-6, km: 1000, in: 0.0254, ft: 0.3048 };

/** What a check's bound in model units is in, and how long one of that is in the unit of the files. */
function unitOfBound(report, key) {
  const own = unitOf(report);
  const name = report.options?.gates?.[key]?.unit ?? own;
  // What the unit of other files is nobody knows: there a unit is a name.
  return { name, length: own in METRES ? METRES[name] / METRES[own] : 1 };
}

const inModelUnits = ({ bound }) => bound.endsWith("_model");

/** A bound as it was set, with the unit where it has one: "max_model 10 mm". */
export function boundWords(report, check) {
  const { key, bound, allowed } = check;
  const value = typeof allowed === "number" ? number(allowed) : [allowed].flat().join(", ");
  return `${bound} ${value}${inModelUnits(check) ? ` ${unitOfBound(report, key).name}` : ""}`;
}

/** The upper bounds on values of a kind that are numbers, as they were compared. */
const upperBounds = (report, kind) => (report.gates?.checks ?? []).filter(({ key, bound, limit }) => key.startsWith(`${kind}.`) && bound.startsWith("max") && typeof limit === "number");

/** The bound that gates put on a distance, relative to the radius; null if there is none. */
export function distanceThreshold(report) {
  const bounds = upperBounds(report, "point_to_surface");
  const check = bounds.find(({ key }) => key.endsWith(".max")) ?? bounds[0];
  if (!check) return null;
  return inModelUnits(check) ? (check.limit * unitOfBound(report, check.key).length) / report.frame.radius : check.limit;
}

/** The bound that gates put on the difference of colours; null if there is none. */
export const contrastThreshold = (report) => upperBounds(report, "appearance.color_difference")[0]?.limit ?? null;
