"""Numbers as people read them, and commands as programs do."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

from playwright.sync_api import Page

from meshcone.files import MeshFile
from service.api.schemas import Job
from service.client import Client
from tests.acceptance.dashboard.browsing import open_tab

WORDS = {
    "bytes(999)": "999 bytes",
    "bytes(999400)": "999 kB",
    "bytes(999900)": "1.00 MB",
    "bytes(999999999)": "1.00 GB",
    "bytes(5e15)": "5,000 TB",
    "seconds(0.9996)": "1.00 s",
    "seconds(90)": "90.0 s",
    "seconds(5400)": "90 min",
    "seconds(7200)": "2 h",
    "age(0, 61000)": "1 min",
    "age(0, 119000)": "1 min",
    "age(0, 5400000)": "1 h",
}


def test_sizes_and_times_are_rounded_as_they_are_read(page: Page) -> None:
    page.goto("/docs")

    calls = ", ".join(f"format.{call}" for call in WORDS)
    said = page.evaluate(f"import('meshcone/format').then(format => [{calls}])")

    assert dict(zip(WORDS, said, strict=True)) == WORDS


def test_the_curl_command_names_files_whose_names_mean_something_to_curl(
    page: Page, client: Client, tmp_path: Path
) -> None:
    names = "chair, oak; new.obj", "paints/dark,light.mtl"
    mesh = f"mtllib {names[1]}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".encode()
    chair = MeshFile(names[0], mesh, {names[1]: b"newmtl oak\n"})
    (tmp_path / "paints").mkdir()
    for name, data in ((chair.name, chair.data), *chair.resources.items()):
        (tmp_path / name).write_bytes(data)
    job = client.wait(client.submit(chair, None, {"mode": "audit"}).id)
    page.goto(f"/jobs/{job.id}")
    open_tab(page, "Files")
    shown = page.get_by_role("region", name="Command that repeats this job")

    done = subprocess.run(
        ["sh", "-c", shown.inner_text()], cwd=tmp_path, capture_output=True, text=True, timeout=60
    )

    assert done.returncode == 0, done.stdout + done.stderr
    again = Job.model_validate_json(done.stdout)
    assert files_of(again) == files_of(job)
    client.wait(again.id)  # or it would keep the one worker from what comes next


def files_of(job: Job) -> list[Any]:
    return [(file.name, file.sha256) for file in (job.source, *job.source_resources)]
