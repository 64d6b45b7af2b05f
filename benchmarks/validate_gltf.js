// Runs Khronos' glTF validator over files. Standard input: a JSON array of paths. Standard
// output: a JSON array of reports, an issue each by severity, code and pointer.
//
//     node validate_gltf.js DIRECTORY_WITH_NODE_MODULES < paths.json
'use strict';

const fs = require('fs');
const path = require('path');

const validator = require(path.join(path.resolve(process.argv[2]), 'node_modules', 'gltf-validator'));

function beside(file) {
  return (uri) =>
    new Promise((resolve, reject) => {
      fs.readFile(path.join(path.dirname(file), decodeURIComponent(uri)), (error, data) =>
        error ? reject(String(error)) : resolve(new Uint8Array(data)),
      );
    });
}

async function validate(file) {
  const options = { maxIssues: 0, externalResourceFunction: beside(file) };
  const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)), options);
  return report.issues.messages.map(({ severity, code, pointer, message }) => ({
    severity,
    code,
    pointer: pointer || '',
    message,
  }));
}

async function main() {
  const reports = [];
  for (const file of JSON.parse(fs.readFileSync(0, 'utf8'))) {
    reports.push(await validate(file));
  }
  process.stdout.write(JSON.stringify(reports));
}

main().catch((error) => {
  console.error(error);
  process.exit(1);
});
