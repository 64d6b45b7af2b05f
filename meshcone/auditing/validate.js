// Asks Khronos' glTF validator about one file.
//
//     node validate.js PATH_OF_THE_MODULE MESSAGES < input
//
// The input is the length of a JSON header (unsigned 32-bit, little-endian), the header
// {files: [{name, length}, …]}, and the files' bytes; the first is the glTF. The output is the
// validator's report, with as many of its messages as asked for, the worst first.
'use strict';

const fs = require('fs');
const path = require('path');

const validator = require(path.resolve(process.argv[2]));
const input = fs.readFileSync(0);
const headerLength = input.readUInt32LE(0);
const header = JSON.parse(input.toString('utf8', 4, 4 + headerLength));

const files = new Map();
let offset = 4 + headerLength;
for (const { name, length } of header.files) {
  // A copy: of a view, the validator reads the whole buffer behind it.
  files.set(name, new Uint8Array(input.subarray(offset, offset + length)));
  offset += length;
}

async function resource(uri) {
  const name = path.posix.normalize(decodeURIComponent(uri).replace(/\\/g, '/'));
  if (files.has(name)) return files.get(name);
  const longer = [...files.keys()].filter((each) => each.endsWith('/' + name));
  if (longer.length !== 1) throw new Error('was not sent');
  return files.get(longer[0]);
}

async function main() {
  const [first] = header.files;
  const report = await validator.validateBytes(files.get(first.name), {
    uri: first.name,
    maxIssues: 0,
    writeTimestamp: false,
    externalResourceFunction: resource,
  });
  const messages = report.issues.messages;
  messages.sort((one, other) => one.severity - other.severity);
  messages.length = Math.min(messages.length, Number(process.argv[3]));
  process.stdout.write(JSON.stringify(report));
}

main().catch((error) => {
  console.error(String(error));
  process.exit(1);
});
