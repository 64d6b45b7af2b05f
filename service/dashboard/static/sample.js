// A pair to try the service with: a vase, and the same vase as a careless scan would have it.

const PROFILE = [[0, 0], [.42, 0], [.5, .05], [.58, .2], [.72, .5], [.74, .8], [.6, 1.15], [.4, 1.45], [.36, 1.65], [.46, 1.85], [.52, 1.9], [.46, 1.88], [.32, 1.66], [.34, 1.44], [.52, 1.14], [.66, .8], [.64, .5], [.5, .22], [.3, .1], [0, .1]];
const AROUND = 36;
const FINER = 3;  // rows between two points of the profile
const NOISE = 0.012;

/** Random numbers that are the same each time (mulberry32). */
function random(seed) {
  let state = seed;
  return () => {
    state = (state + 0x6d2b79f5) | 0;
    let mixed = Math.imul(state ^ (state >>> 15), 1 | state);
    mixed = (mixed + Math.imul(mixed ^ (mixed >>> 7), 61 | mixed)) ^ mixed;
    return ((mixed ^ (mixed >>> 14)) >>> 0) / 2 ** 32;
  };
}

/** Rows of the vase from axis to axis: a point at both ends, rings between. */
function rows() {
  const between = PROFILE.slice(1).flatMap(([radius, height], index) => {
    const [before, below] = PROFILE[index];
    return Array.from({ length: FINER }, (_, step) => {
      const share = (step + 1) / FINER;
      return [before + share * (radius - before), below + share * (height - below)];
    });
  });
  return [PROFILE[0], ...between];
}

function vase(noise) {
  const next = random(7);
  const section = rows();
  const moved = (value) => (value + noise * (next() + next() + next() - 1.5)).toFixed(6);
  const vertices = section.flatMap(([radius, height]) => {
    const count = radius === 0 ? 1 : AROUND;
    return Array.from({ length: count }, (_, step) => {
      const angle = (2 * Math.PI * step) / AROUND;
      return `v ${moved(radius * Math.cos(angle))} ${moved(height)} ${moved(-radius * Math.sin(angle))}`;
    });
  });
  const last = vertices.length;
  const ring = (row, step) => 2 + (row - 1) * AROUND + (step % AROUND);
  const faces = [];
  for (let step = 0; step < AROUND; step += 1) {
    faces.push(`f 1 ${ring(1, step + 1)} ${ring(1, step)}`);
    for (let row = 1; row < section.length - 2; row += 1) {
      faces.push(`f ${ring(row, step)} ${ring(row, step + 1)} ${ring(row + 1, step + 1)}`, `f ${ring(row, step)} ${ring(row + 1, step + 1)} ${ring(row + 1, step)}`);
    }
    faces.push(`f ${last} ${ring(section.length - 2, step)} ${ring(section.length - 2, step + 1)}`);
  }
  return [...vertices, ...faces, ""].join("\n");
}

/** Source and reference, as if they had been dropped. */
export const samplePair = () => [["vase_scan.obj", NOISE], ["vase.obj", 0]].map(([name, noise]) => ({ file: new File([vase(noise)], name), folder: "" }));
