// For openapi-typescript, which has to be told that a file is a Blob:
//   node openapi/typescript-client.mjs openapi/openapi.json meshcone.d.ts
import { readFileSync, writeFileSync } from "node:fs";
import openapiTS, { astToString } from "openapi-typescript";
import ts from "typescript";

const [description, types] = process.argv.slice(2);
const blob = ts.factory.createTypeReferenceNode(ts.factory.createIdentifier("Blob"));
const made = await openapiTS(JSON.parse(readFileSync(description, "utf8")), {
  transform: (schema) => (schema.format === "binary" ? blob : undefined),
});
writeFileSync(types, astToString(made));
