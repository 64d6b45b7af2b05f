// Refines a pair with openapi-fetch and the types of openapi-typescript: URL, source, reference, out.
import { readFileSync, writeFileSync } from "node:fs";
import { basename, join } from "node:path";
import createClient from "openapi-fetch";
import type { components, paths } from "./meshcone";

type Job = components["schemas"]["Job"];

const [url, source, reference, out] = process.argv.slice(2);
const client = createClient<paths>({ baseUrl: url });
const file = (path: string) => new File([readFileSync(path)], basename(path));

function asForm(body: Record<string, unknown>): FormData {
  const form = new FormData();
  for (const [name, value] of Object.entries(body)) {
    for (const each of Array.isArray(value) ? value : [value]) form.append(name, each);
  }
  return form;
}

function required<T>(answer: { data?: T; error?: unknown }): T {
  if (answer.data === undefined) throw new Error(JSON.stringify(answer.error));
  return answer.data;
}

async function main() {
  const body = { source: file(source), reference: file(reference), options: JSON.stringify({ effort: "fast" }), label: ["generated", "typescript"] };
  let job: Job = required(await client.POST("/v1/jobs", { params: { header: { Prefer: "wait=5" } }, body, bodySerializer: asForm }));
  while (job.state === "queued" || job.state === "running") {
    await new Promise((resolve) => setTimeout(resolve, 100));
    job = required(await client.GET("/v1/jobs/{job_id}", { params: { path: { job_id: job.id } } }));
  }
  const path = { job_id: job.id };
  const listed = required(await client.GET("/v1/jobs", { params: { query: { label: ["typescript"], name: basename(source) } } }));
  const report = required(await client.GET("/v1/jobs/{job_id}/report", { params: { path } }));
  const mesh: Blob = required(await client.GET("/v1/jobs/{job_id}/mesh", { params: { path }, parseAs: "blob" }));
  const certificate: Blob = required(await client.GET("/v1/jobs/{job_id}/certificate", { params: { path }, parseAs: "blob" }));
  const sent: Blob = required(await client.GET("/v1/jobs/{job_id}/source", { params: { path }, parseAs: "blob" }));
  for (const [name, made] of [["refined.obj", mesh], ["certificate.npz", certificate], ["source.obj", sent]] as const) {
    writeFileSync(join(out, name), Buffer.from(await made.arrayBuffer()));
  }
  const outcome = "outcome" in report ? report.outcome : null;
  console.log(JSON.stringify({ id: job.id, state: job.state, listed: listed.jobs.map((each) => each.id), outcome }));
}

main();
