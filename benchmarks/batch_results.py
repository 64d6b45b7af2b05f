"""What the verdicts of a large batch cost: processor time and memory of each of its documents.

The ledger is filled by its own steps, with the reports of two measurements, so that no job is run.
Each document is then made in a process of its own, as the API makes it.

    python benchmarks/batch_results.py 10000
"""

from __future__ import annotations

import argparse
import multiprocessing
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from functools import partial
from itertools import islice
from pathlib import Path

from rich.console import Console
from rich.table import Table

# A script beside this one has the name of the package, which is to be found first.
sys.path.insert(0, str(Path(__file__).parents[1]))
from meshcone.files import MeshFile
from meshcone.gates.formats.junit import to_junit
from meshcone.gates.formats.markdown import to_markdown
from meshcone.gates.formats.sarif import to_sarif
from meshcone.gates.results import GateRun
from meshcone.options import parse_options
from meshcone.verbs.measure import measurement
from service.api.batch_results import result_of
from service.api.context import Context, open_context
from service.settings import ServiceSettings
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.batches import BatchRecord
from worker.jobs.identifiers import ids_in_order, new_job_id
from worker.jobs.records import Artifact, JobRecord, StoredFile
from worker.run.artifacts import JobFiles, of_measurement

MEBIBYTE = 2**20
_TINY = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
_MOVED = _TINY.replace(b"v 0 0 1", b"v 0 0 1.1")
_GATES = {
    "deviation.max": {"max": 0.01},
    "point_to_surface.p95": {"max": 0.005},
    "normal_consistency": {"min": 0.95, "severity": "warning"},
    "changes.lost.uv_sets": {"max": 0},
}
_FAILING = 10  # one pair in so many
_THREADS = 8
_AT_ONCE = 100  # jobs that are staged in one step

DOCUMENTS: dict[str, Callable[[GateRun], bytes]] = {
    "result": lambda run: run.model_dump_json().encode(),
    "junit.xml": to_junit,
    "sarif.json": to_sarif,
    "summary.md": to_markdown,
}


def main(argv: Sequence[str] | None = None) -> int:
    """Fill a ledger, make each document, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("pairs", type=int, nargs="?", default=10_000)
    parser.add_argument(
        "--reports", action="store_true", help="read every report, as after older workers"
    )
    arguments = parser.parse_args(argv)
    table = Table(title=f"A batch of {arguments.pairs:,} pairs, four gates")
    for column in ("document", "processor s", "s", "MiB more than before", "MB sent"):
        table.add_column(column, justify="left" if column == "document" else "right")
    with (
        tempfile.TemporaryDirectory(prefix="meshcone-benchmark-") as name,
        EmbeddedBroker(Path(name)) as broker,
    ):
        settings = ServiceSettings(data_dir=Path(name), redis_url=broker.url)
        with open_context(settings) as context:
            before = _broker_memory(context)
            batch = fill(context, arguments.pairs, keeps=not arguments.reports)
            used = _broker_memory(context) - before
        for document in DOCUMENTS:
            with multiprocessing.get_context("spawn").Pool(1) as process:
                row = process.apply(made, (document, batch, name, broker.url))
            table.add_row(document, *row)
    Console(width=None if sys.stdout.isatty() else 100).print(table)
    print(f"The broker holds {used / MEBIBYTE:.0f} MiB for it.")
    return 0


def _broker_memory(context: Context) -> int:
    return int(context.redis.info("memory")["used_memory"])


def fill(context: Context, pairs: int, *, keeps: bool) -> str:
    """Have a batch whose jobs have all ended; its id."""
    record = BatchRecord(id=new_job_id(), created=datetime.now(UTC), pairs=pairs, name="nightly")
    jobs = list(_jobs(record))
    for start in range(0, pairs, _AT_ONCE):
        context.batches.stage(record.id, jobs[start : start + _AT_ONCE])
    context.batches.commit(record, capacity=pairs)
    while context.batches.carry_on(record.id)[1]:
        pass
    options = parse_options({"mode": "measure", "audit": False, "gates": _GATES})
    reference = MeshFile("mug.obj", _TINY)
    good, bad = (
        of_measurement("mug.obj", measurement(MeshFile("mug.obj", data), reference, options))
        for data in (_TINY, _MOVED)
    )
    with ThreadPoolExecutor(_THREADS) as several:
        made = (good if number % _FAILING else bad for number in range(pairs))
        list(several.map(partial(_end, context, keeps), jobs, made))
    return record.id


def _jobs(batch: BatchRecord) -> Iterator[JobRecord]:
    file = StoredFile(name="mug.obj", digest="0" * 64, size=len(_TINY))
    for number, job_id in enumerate(islice(ids_in_order(), batch.pairs)):
        yield JobRecord(
            id=job_id,
            created=batch.created,
            source=file,
            reference=file,
            options={"mode": "measure", "audit": False, "gates": _GATES},
            batch=batch.id,
            name=f"pair-{number}",
        )


def _end(context: Context, keeps: bool, job: JobRecord, files: JobFiles) -> None:
    report = files.files["report"]
    digest = context.blobs.put(report.data, job.id)
    artifact = Artifact(
        digest=digest,
        media_type=report.media_type,
        filename=report.filename,
        size=len(report.data),
    )
    context.ledger.succeed(
        job.id,
        context.ledger.begin(job.id),
        {"report": artifact},
        verdict=files.verdict,
        summary=files.summary,
        judgement=files.judgement if keeps else None,
    )


def made(document: str, batch: str, directory: str, url: str) -> tuple[str, ...]:
    """Make one document, and say what that cost."""
    settings = ServiceSettings(data_dir=Path(directory), redis_url=url)
    with open_context(settings) as context:
        record = context.batches.get(batch)
        used, began, before = time.process_time(), time.monotonic(), _highest()
        size = len(DOCUMENTS[document](result_of(record, context)))
        used, took = time.process_time() - used, time.monotonic() - began
    return (
        f"{used:.2f}",
        f"{took:.2f}",
        f"{(_highest() - before) / MEBIBYTE:.0f}",
        f"{size / 1e6:.2f}",
    )


def _highest() -> int:
    """Bytes of memory that this process has held at most (Linux)."""
    text = Path("/proc/self/status").read_text(encoding="ascii")
    return int(text.partition("VmHWM:")[2].split()[0]) * 1024


if __name__ == "__main__":
    raise SystemExit(main())
