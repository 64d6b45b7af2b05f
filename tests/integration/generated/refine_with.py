"""Refines a pair with the client that openapi-python-client makes: URL, source, reference, out."""

from __future__ import annotations

import json
import sys
import time
from io import BytesIO
from pathlib import Path

from meshcone_client import Client
from meshcone_client.api.inputs import get_source
from meshcone_client.api.jobs import get_job, list_jobs, submit_job
from meshcone_client.api.results import get_certificate, get_mesh, get_report
from meshcone_client.models import Job, SubmitJobFilesBody
from meshcone_client.types import File

url, source, reference, out = sys.argv[1], *map(Path, sys.argv[2:])


def file(path: Path) -> File:
    return File(BytesIO(path.read_bytes()), path.name, "application/octet-stream")


with Client(url, httpx_args={"trust_env": False}) as client:
    options = json.dumps({"effort": "fast"})
    body = SubmitJobFilesBody(file(source), file(reference), options, label=["generated", "python"])
    job = submit_job.sync(client=client, body=body, prefer="wait=5")
    while isinstance(job, Job) and job.state in ("queued", "running"):
        time.sleep(0.1)
        job = get_job.sync(job.id, client=client)
    assert isinstance(job, Job), job

    listed = list_jobs.sync(client=client, label=["python"], name=source.name)
    report = get_report.sync(job.id, client=client)
    (out / "refined.obj").write_bytes(get_mesh.sync(job.id, client=client).payload.read())
    (out / "certificate.npz").write_bytes(
        get_certificate.sync(job.id, client=client).payload.read()
    )
    (out / "source.obj").write_bytes(get_source.sync(job.id, client=client).payload.read())

answer = {
    "id": job.id,
    "state": job.state,
    "listed": [each.id for each in listed.jobs],
    "outcome": report.outcome,
}
print(json.dumps(answer))
