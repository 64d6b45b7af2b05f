"""The same file names on both sides: every way to send such a pair comes to the same verdict."""

from __future__ import annotations

import json
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import httpx2
import pytest

from meshcone.files import MeshFile
from service.client import Client
from service.stack import Stack
from tests.acceptance.two_exports import OPTIONS, two_exports, write_exports
from tests.commands import meshcone

QUICK = ("--set", "quality.samples=1000", "--set", "quality.emd_samples=64")


@pytest.fixture
def exports(tmp_path: Path) -> Path:
    write_exports(tmp_path)
    return tmp_path


@pytest.fixture(scope="module")
def expected() -> dict[str, Any]:
    """What the engine measures on this pair, as it is given here."""
    from meshcone.options import parse_options
    from meshcone.verbs.measure import measure

    return measure(*two_exports(), parse_options(OPTIONS)).model_dump(mode="json")


def run(directory: Path, *command: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command, cwd=directory, capture_output=True, text=True, check=False, timeout=240
    )


def assert_same_findings(report: dict[str, Any], expected: dict[str, Any]) -> None:
    """The verdict, what the gate found, and the hashes of both sides."""
    assert expected["gates"]["verdict"] == "fail"
    assert report["gates"] == expected["gates"]
    for side in ("source", "reference"):
        mine, other = (document["inputs"][side] for document in (report, expected))
        assert (mine["sha256"], mine["resources"]) == (other["sha256"], other["resources"])


@pytest.mark.parametrize("where", ["here", "on a service"])
@pytest.mark.parametrize(
    "pair", [("new/a.gltf", "old/a.gltf"), ("--manifest", "pairs.csv")], ids=["pair", "manifest"]
)
def test_gate_fails_a_spike_that_the_other_side_does_not_have(
    stack: Stack, exports: Path, expected: dict[str, Any], where: str, pair: tuple[str, str]
) -> None:
    server = () if where == "here" else ("--server", stack.url)

    done = meshcone(
        exports, "gate", *pair, "--gates", "gates.json", "--json", "gate.json", *QUICK, *server
    )

    assert done.returncode == 1, done.stderr
    [asset] = json.loads((exports / "gate.json").read_text())["assets"]
    assert asset["verdict"] == expected["gates"]


def test_submit_keeps_the_sides_apart(
    stack: Stack, exports: Path, expected: dict[str, Any]
) -> None:
    assignments = [("--set", f"{key}={json.dumps(value)}") for key, value in OPTIONS.items()]

    done = meshcone(
        exports,
        *("submit", "new/a.gltf", "old/a.gltf", "--server", stack.url, "--report", "r.json"),
        *sum(assignments, ()),
    )

    assert done.returncode == 1, done.stderr  # a gate of theirs is not passed
    assert_same_findings(json.loads((exports / "r.json").read_text()), expected)


def test_curl_sends_the_files_of_each_side(
    stack: Stack, exports: Path, expected: dict[str, Any]
) -> None:
    done = run(
        exports,
        *("curl", "-sS", "--noproxy", "*", "-H", "Prefer: wait=30", f"{stack.url}/v1/jobs"),
        *("-F", "source=@new/a.gltf", "-F", "source_resources=@new/a.bin"),
        *("-F", "reference=@old/a.gltf", "-F", "reference_resources=@old/a.bin"),
        *("--form-string", f"options={json.dumps(OPTIONS)}"),
    )

    job = json.loads(done.stdout)
    with Client(stack.url) as client:
        client.wait(job["id"])
        assert_same_findings(client.report(job["id"]), expected)
    for side in ("source", "reference"):
        [sent] = job[f"{side}_resources"]
        assert sent["name"] == "a.bin"
        assert sent["sha256"] == expected["inputs"][side]["resources"]["a.bin"]
    assert job["resources"] == []


def test_the_client_sends_each_mesh_with_its_own(client: Client, expected: dict[str, Any]) -> None:
    job = client.wait(client.submit(*two_exports(), OPTIONS).id)

    assert job.verdict == "fail"
    assert_same_findings(client.report(job.id), expected)


def test_files_sent_before_belong_to_their_side(client: Client, expected: dict[str, Any]) -> None:
    new, old = two_exports()
    buffers = [client.upload(MeshFile("a.bin", each.resources["a.bin"])) for each in (new, old)]

    job = client.submit(
        client.upload(new),
        client.upload(old),
        OPTIONS,
        source_resources=[buffers[0]],
        reference_resources=[buffers[1]],
    )

    client.wait(job.id)
    assert_same_findings(client.report(job.id), expected)


def test_a_file_for_both_is_sent_once(client: Client) -> None:
    """The client's way to say what the form's ``resources`` has always said."""
    new, _ = two_exports()
    bare = replace(new, resources={})
    buffer = MeshFile("a.bin", new.resources["a.bin"])

    job = client.wait(client.submit(bare, bare, OPTIONS, resources=[buffer]).id)

    assert job.verdict == "pass"
    assert [file.name for file in job.resources] == ["a.bin"]
    hashes = {side: client.report(job.id)["inputs"][side]["resources"] for side in SIDES}
    assert hashes["source"] == hashes["reference"] == new.resource_hashes


SIDES = ("source", "reference")


def test_the_same_files_on_exchanged_sides_are_another_request(stack: Stack) -> None:
    new, old = two_exports()

    with httpx2.Client(base_url=stack.url, timeout=60, trust_env=False) as http:
        first, second = (
            http.post(
                "/v1/jobs",
                files=[
                    ("source", (new.name, new.data)),
                    ("reference", (old.name, old.data)),
                    ("source_resources", ("a.bin", one.resources["a.bin"])),
                    ("reference_resources", ("a.bin", other.resources["a.bin"])),
                ],
                data={"options": json.dumps(OPTIONS)},
                headers={"Idempotency-Key": "sides exchanged"},
            )
            for one, other in ((new, old), (old, new))
        )

    assert first.status_code == 202
    assert second.status_code == 422
    assert second.json()["type"].endswith("key-reused")


def test_a_resource_may_have_a_name_in_other_letters_or_that_of_the_mesh(client: Client) -> None:
    new, old = two_exports()
    busy = replace(new, resources={**new.resources, "A.BIN": b"other", "a.gltf": b"itself"})

    job = client.wait(client.submit(busy, old, OPTIONS).id)

    assert job.verdict == "fail"
    assert client.report(job.id)["inputs"]["source"]["resources"] == busy.resource_hashes


def test_a_refinement_of_such_a_pair_is_verified_from_its_folders(
    stack: Stack, exports: Path
) -> None:
    files = ("--source", "new/a.gltf", "--reference", "old/a.gltf", "--refined", "out.gltf")

    done = meshcone(
        exports,
        *("submit", "new/a.gltf", "old/a.gltf", "--server", stack.url, *QUICK),
        *("-o", "out.gltf", "--report", "out.json", "--set", "effort=fast"),
    )
    verified = meshcone(exports, "verify", "out.json", *files)
    exchanged = meshcone(
        exports,
        *("verify", "out.json", "--source", "old/a.gltf", "--reference", "new/a.gltf"),
        *("--refined", "out.gltf"),
    )

    assert done.returncode == 0, done.stderr
    assert verified.returncode == 0, verified.stdout
    assert exchanged.returncode == 1
    assert "FAILED resource" in exchanged.stdout
