// What a ZIP holds, read in the browser: two exports in one archive can be shown, and sent, as two sides.

const END = 0x06054b50;
const ENTRY = 0x02014b50;
const LONGEST_END = 22 + 65535;  // bytes: the last record with the longest comment
const LARGEST = 2 ** 30;  // bytes unpacked; a larger archive is sent as it is
const [STORED, DEFLATED] = [0, 8];

const CRC = Uint32Array.from({ length: 256 }, (_, start) => {
  let value = start;
  for (let bit = 0; bit < 8; bit += 1) value = value & 1 ? 0xedb88320 ^ (value >>> 1) : value >>> 1;
  return value;
});

/** The checksum of some content, as archives have it. */
async function checksum(blob) {
  const reader = blob.stream().getReader();
  let crc = -1;
  for (let part = await reader.read(); !part.done; part = await reader.read()) {
    for (let at = 0; at < part.value.length; at += 1) crc = CRC[(crc ^ part.value[at]) & 255] ^ (crc >>> 8);
  }
  return ~crc >>> 0;
}

const viewOf = async (blob) => new DataView(await blob.arrayBuffer());

/** The files of an archive; null where it is none, or of a kind that only the service reads. */
async function entries(file) {
  const tail = await viewOf(file.slice(-LONGEST_END));
  let end = tail.byteLength - 22;
  while (end >= 0 && tail.getUint32(end, true) !== END) end -= 1;
  if (end < 0) return null;
  const [count, size, begin] = [tail.getUint16(end + 10, true), tail.getUint32(end + 12, true), tail.getUint32(end + 16, true)];
  const directory = await viewOf(file.slice(begin, begin + size));
  const found = [];
  for (let at = 0, left = count; left > 0; left -= 1) {
    if (at + 46 > directory.byteLength || directory.getUint32(at, true) !== ENTRY) return null;
    const [nameLength, extraLength, commentLength] = [28, 30, 32].map((offset) => directory.getUint16(at + offset, true));
    const path = new TextDecoder().decode(new Uint8Array(directory.buffer, at + 46, nameLength));
    found.push({ path, encrypted: directory.getUint16(at + 8, true) & 1, method: directory.getUint16(at + 10, true), crc: directory.getUint32(at + 16, true), packed: directory.getUint32(at + 20, true), size: directory.getUint32(at + 24, true), begin: directory.getUint32(at + 42, true) });
    at += 46 + nameLength + extraLength + commentLength;
  }
  return found.filter(({ path }) => !path.endsWith("/") && !/(^|\/)(__MACOSX\/|\.)/.test(path));
}

/** A file of an archive. Throws, in words for the sender, where the archive is damaged there. */
async function unpacked(file, entry) {
  const content = await contentOf(file, entry).catch(() => null);
  // What is sent of it has no checksum any more: the service cannot find what is not found here.
  const whole = content?.size === entry.size && await checksum(content) === entry.crc;
  if (!whole) throw new Error(`${file.name} is damaged: ${entry.path} in it cannot be unpacked. Nothing of it was taken; pack it again.`);
  return new File([content], entry.path.split("/").at(-1));
}

async function contentOf(file, { method, packed, begin }) {
  const head = await viewOf(file.slice(begin, begin + 30));
  const start = begin + 30 + head.getUint16(26, true) + head.getUint16(28, true);
  const data = file.slice(start, start + packed);
  return method === STORED ? data : new Response(data.stream().pipeThrough(new DecompressionStream("deflate-raw"))).blob();
}

/**
 * Open an archive that holds more than one mesh, as a folder would be.
 * @param {{file: File, folder: string}[]} files that came together
 * @param {RegExp} meshes what the names of meshes are like
 * @returns {Promise<{file: File, folder: string}[]>} the same, unless a ZIP is the only mesh of
 *   them and holds several. Throws where it is damaged
 */
export async function opened(files, meshes) {
  const like = files.filter(({ file }) => meshes.test(file.name));
  if (like.length !== 1 || !/\.zip$/i.test(like[0].file.name)) return files;
  const [archive] = like;
  const inside = await entries(archive.file).catch(() => null);
  if (inside === null || inside.filter(({ path }) => meshes.test(path)).length < 2) return files;
  const readable = inside.every(({ method, encrypted }) => !encrypted && (method === STORED || method === DEFLATED));
  if (!readable || inside.reduce((sum, { size }) => sum + size, 0) > LARGEST) return files;
  const folder = `${archive.folder}${archive.file.name}/`;
  const out = await Promise.all(inside.map(async (entry) => ({ file: await unpacked(archive.file, entry), folder: `${folder}${entry.path.slice(0, entry.path.lastIndexOf("/") + 1)}` })));
  return [...files.filter((each) => each !== archive), ...out];
}
