"""A long list of pinned vertices, as a file sent with the source."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from meshcone.files import MeshFile
from meshcone.options import parse_options
from meshcone.verbs.refine import refine
from service.api.submission.parts import OPTIONS_BYTES
from service.client import Client, ServiceError

OPTIONS = {"effort": "fast", "cones": {"pin": {"vertices_file": "pins.txt"}}}
PINNED = ("0 3 17\n" * OPTIONS_BYTES).encode()  # longer than the options may be


def test_a_list_too_long_for_the_options_is_sent_as_a_file(
    client: Client, rough_ball: MeshFile, ball: MeshFile
) -> None:
    source = replace(rough_ball, resources={"pins.txt": PINNED})

    job = client.wait(client.submit(source, ball, OPTIONS).id)

    assert job.state == "succeeded"
    assert client.mesh(job.id) == refine(source, ball, parse_options(OPTIONS)).data
    [sent] = job.source_resources
    assert client.report(job.id)["inputs"]["source"]["resources"] == {"pins.txt": sent.sha256}


def test_a_list_beside_the_source_is_sent_with_it(
    client: Client, rough_ball: MeshFile, ball: MeshFile, tmp_path: Path
) -> None:
    (tmp_path / "rough.obj").write_bytes(rough_ball.data)
    (tmp_path / "pins.txt").write_bytes(PINNED)

    job = client.submit(tmp_path / "rough.obj", ball, OPTIONS)

    assert [file.name for file in job.source_resources] == ["pins.txt"]


def test_a_list_that_is_none_is_refused_before_the_job_is_accepted(
    client: Client, rough_ball: MeshFile, ball: MeshFile
) -> None:
    source = replace(rough_ball, resources={"pins.txt": b"first, second"})

    with pytest.raises(ServiceError) as refused:
        client.submit(source, ball, OPTIONS)

    assert refused.value.problem.status == 422
    assert refused.value.problem.file == "pins.txt"
    assert "expected indices of vertices" in refused.value.problem.detail
