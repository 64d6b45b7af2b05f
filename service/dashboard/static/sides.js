// Two meshes and the files they name: whose each is, and how a command tells them apart.

export const MESHES = /\.(obj|gltf|glb|ply|stl|off|zip|step|stp|3mf|usd[acz]?|xyz)$/i;
// Meshes, scenes and archives that nothing here reads. Beside a mesh they would pass for what it names.
const UNREAD = /\.(fbx|dae|blend|3ds|max|ma|mb|abc|ifc|igs|iges|x3d|wrl|c4d|lwo|7z|rar|tar|t?gz|bz2|xz)$/i;
const LIKE_A_REFERENCE = /(ref|reference|target|truth|gt|clean|hi|high|highpoly|original)([^a-z]|$)/i;

/** The files of a drop, those in folders too, each with the path of its folder ("" or "new/"). */
export async function droppedFiles(transfer) {
  // Asked for at once: a drop's items are gone after the first wait.
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry?.()).filter(Boolean);
  if (!entries.some((entry) => entry.isDirectory)) return [...transfer.files].map((file) => ({ file, folder: "" }));
  return (await Promise.all(entries.map((entry) => filesIn(entry, "")))).flat();
}

async function filesIn(entry, folder) {
  const read = (ask) => new Promise((resolve, reject) => ask(resolve, reject)).catch((error) => {
    throw new Error(`${folder}${entry.name} cannot be read, so nothing of what was dropped was taken: ${error.message}`);
  });
  if (!entry.isDirectory) return [{ file: await read((...told) => entry.file(...told)), folder }];
  const reader = entry.createReader();
  const inside = [];
  for (let some = null; some === null || some.length;) { // a folder is read a hundred entries at a time
    some = await read((...told) => reader.readEntries(...told));
    inside.push(...some);
  }
  return (await Promise.all(inside.map((each) => filesIn(each, `${folder}${entry.name}/`)))).flat();
}

/**
 * Decide what the files are.
 * @param {{file: File, folder: string}[]} files what came together
 * @param {{side: ?string, free: string}} where the side that was meant, if one was, and the one
 *   that a single mesh fills otherwise
 * @returns {{meshes: Object, beside: Object, leftOut: Object[], unread: Object[]}} by side, the meshes
 *   and the files they name; those that may belong to either are under "both". A third mesh has no
 *   side. What is unread is of a kind that cannot be
 */
export function sorted(files, { side, free }) {
  const found = files.filter(({ file }) => MESHES.test(file.name));
  const unread = files.filter(({ file }) => UNREAD.test(file.name));
  const others = files.filter(({ file }) => !MESHES.test(file.name) && !UNREAD.test(file.name));
  const meshes = {};
  if (found.length === 1) [meshes[side ?? free]] = found;
  else if (found.length > 1) {
    const [first, second] = found;
    [meshes.source, meshes.reference] = likeAReference(first) && !likeAReference(second) ? [second, first] : [first, second];
  }
  const beside = { source: [], reference: [], both: [] };
  for (const other of others) beside[whose(other, meshes, side)].push(other.file);
  return { meshes, beside, leftOut: found.slice(2), unread };
}

const likeAReference = ({ file, folder }) => LIKE_A_REFERENCE.test(file.name) || LIKE_A_REFERENCE.test(folder);

/** A file belongs to the mesh in the nearest folder around it; two in one folder share it. */
function whose({ folder }, meshes, side) {
  const sides = Object.keys(meshes);
  if (sides.length < 2) return sides[0] ?? side ?? "both";
  const depths = sides.map((each) => (folder.startsWith(meshes[each].folder) ? meshes[each].folder.length : -1));
  if (depths[0] === depths[1]) return "both";
  return sides[depths[0] > depths[1] ? 0 : 1];
}

/** The paths at which commands find the files of a job: in a folder for each side where both have a name. */
export function pathsOf({ source, reference }) {
  const shared = new Set(source.filter((name) => reference.includes(name)));
  if (!shared.size) return { apart: false, source: (name) => name, reference: (name) => name };
  return { apart: true, source: (name) => `source/${name}`, reference: (name) => `reference/${name}` };
}
