// A dashboard in a terminal: the newest jobs of a service, and what their gates say.
// Node 22.6 or newer runs it as it stands: node --experimental-strip-types follow_jobs.ts http://127.0.0.1:8000

type Job = { id: string; state: string; verdict: string | null; source: { name: string } };
type JobList = { jobs: Job[] };

const MARKS: Record<string, string> = { pass: "✓", fail: "✗", not_tested: "?" };

const [server = "http://127.0.0.1:8000"] = process.argv.slice(2);

async function newest(): Promise<Job[]> {
  const answer = await fetch(`${server}/v1/jobs?limit=20`);
  if (!answer.ok) throw new Error(`${server} answered ${answer.status}: ${await answer.text()}`);
  return ((await answer.json()) as JobList).jobs;
}

for (const job of await newest()) {
  const mark = job.verdict === null ? " " : (MARKS[job.verdict] ?? " ");
  console.log(`${mark} ${job.state.padEnd(9)} ${job.source.name}  ${server}/jobs/${job.id}`);
}
