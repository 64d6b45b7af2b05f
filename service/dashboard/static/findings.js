// Where to look: the farthest points, failed checks and parts with a place, each once.

const SAME = 1e-9;  // of the radius: nearer than that, two findings are one place

/** Which of some findings is at a place; -1 if none is. Positions in model units. */
export const findingAt = (found, place, radius) => found.findIndex(({ position }) => Math.hypot(...position.map((value, axis) => value - place[axis])) <= SAME * radius);

const PARTS = { missing: "missing from the source", extra: "not in the reference" };

function candidates(report) {
  const { deviation, gates, quality } = report;
  const farthest = deviation?.max;
  const parts = (quality.per?.parts ?? []).filter(({ found }) => found !== "both").map((part) => {
    const { at, max } = part[part.found] ?? {};
    return { title: `${part.name || "a part"}, ${PARTS[part.found] ?? part.found}`, on: part.found === "missing" ? "reference" : "mesh", position: at, distance: max };
  });
  const proven = farthest?.upper > 0 ? [{ title: "farthest, proven", on: "mesh", position: farthest.at, distance: farthest.upper }] : [];
  const worst = quality.worst_points.map((point) => ({ ...point, title: point.on === "mesh" ? "on the mesh" : "on the reference" }));
  const failed = (gates?.checks ?? []).filter(({ status }) => status === "fail").map(({ key, position }) => ({ title: `fails ${key}`, on: "mesh", position, tag: "fails" }));
  return [...parts, ...proven, ...worst, ...failed].filter(({ position }) => position);
}

/**
 * The places worth a look, by what is most worth it.
 * @returns {{title: string, on: string, position: number[], closest: number[], distance: ?number, fails: boolean}[]}
 *   positions in model units, distances relative to the radius; `on` is "mesh" or "reference"
 */
export function findings(report) {
  const found = [];
  for (const candidate of candidates(report)) {
    const there = found[findingAt(found, candidate.position, report.frame.radius)];
    if (!there) {
      found.push({ closest: candidate.position, distance: null, ...candidate, fails: candidate.tag === "fails" });
      continue;
    }
    // A sampled point beside the proven one adds where the other surface is closest.
    if (candidate.closest) there.closest = candidate.closest;
    there.fails ||= candidate.tag === "fails";
  }
  return found;
}
