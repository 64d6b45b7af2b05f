"""A batch from a pipeline's view: sent once, followed by one state, read as one verdict."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import jsonschema
import junitparser
import pytest

from meshcone.files import MeshFile
from service.client import Client
from service.stack import Stack
from tests.acceptance.test_submit import meshcone
from tests.integration.file_server import FileServer
from tests.unit.gates.sarif_schema import LOG

QUICK = {"mode": "measure", "quality": {"samples": 256, "emd_samples": 64}}
GATES = {"point_to_surface.max": {"max": 0.01}}
PAIRS = 12


@pytest.fixture
def document(server: FileServer, ball: MeshFile, rough_ball: MeshFile) -> dict[str, Any]:
    """A batch of which one pair fails its gate, and one has no source."""
    good, bad = server.has("/ball.obj", ball.data), server.has("/rough.obj", rough_ball.data)
    sources = [good] * PAIRS
    sources[3], sources[7] = bad, f"{server.url}/nowhere.obj"
    pairs = [
        {"name": f"ball-{number}", "source": {"url": source}, "reference": {"url": good}}
        for number, source in enumerate(sources)
    ]
    return {"name": "nightly", "labels": ["main"], "options": QUICK, "gates": GATES, "pairs": pairs}


def test_a_batch_by_url_has_one_verdict_and_says_which_pairs_are_to_blame(
    fetching: Stack, document: dict[str, Any]
) -> None:
    pairs = document.pop("pairs")
    with Client(fetching.url) as client:
        sent = client.submit_batch(pairs, document)
        batch = client.wait_for_batch(sent.id, interval=0.2)

        result = client.batch_result(batch.id)
        junit = junitparser.JUnitXml.fromstring(client.batch_summary(batch.id, "junit.xml"))
        sarif = json.loads(client.batch_summary(batch.id, "sarif.json"))
        summary = client.batch_summary(batch.id, "summary.md").decode()
        failed = [job.name for job in client.batch_jobs(batch.id, state="failed")]
        client.delete_batch(batch.id)
        left = list(client.all_jobs(label="main"))

    assert (batch.verdict, batch.counts["succeeded"], batch.counts["failed"]) == ("error", 11, 1)
    assert batch.verdicts == {"pass": 10, "fail": 1, "not_tested": 0}
    assert [asset.name for asset in result.assets] == [pair["name"] for pair in pairs]
    assert {asset.name: asset.ending for asset in result.assets if asset.ending != "pass"} == {
        "ball-3": "fail",
        "ball-7": "error",
    }
    assert (junit.failures, junit.errors, len(list(junit))) == (1, 1, PAIRS)
    jsonschema.validate(sarif, LOG)
    assert "nightly" in summary
    assert failed == ["ball-7"]
    assert left == []


def test_a_shell_sends_a_batch_and_exits_by_its_verdict(
    fetching: Stack, document: dict[str, Any], tmp_path: Path
) -> None:
    del document["pairs"][7]
    file, report = tmp_path / "batch.json", tmp_path / "result.json"
    file.write_text(json.dumps(document))

    done = meshcone(
        *("submit", "--batch", str(file), "--server", fetching.url, "--report", str(report))
    )

    assert done.returncode == 1, done.stderr
    assert f"{PAIRS - 1} assets: 1 FAILED, {PAIRS - 2} pass" in done.stdout
    assert "ball-3: " in done.stdout
    assert json.loads(report.read_text())["counts"]["fail"] == 1


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["a.obj", "--batch", "batch.json"], "all else is in it"),
        (["--batch", "nowhere.json"], "cannot be read"),
        ([], "SOURCE is missing"),
    ],
)
def test_what_a_shell_cannot_send_is_said(arguments: list[str], said: str) -> None:
    done = meshcone("submit", *arguments, "--server", "http://127.0.0.1:9")

    assert done.returncode == 2
    assert said in done.stderr
