"""``meshcone submit`` and ``meshcone keys``: a service used, and guarded, from a shell."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import httpx2
import pytest

from meshcone.files import MeshFile
from service.client import Client
from service.stack import Stack
from tests import commands
from tests.commands import Finished
from worker.settings import WorkerSettings


def meshcone(*arguments: str, **environment: str) -> Finished:
    return commands.meshcone(Path.cwd(), *arguments, **environment)


@pytest.fixture
def pair(tmp_path: Path, rough_ball: MeshFile, ball: MeshFile) -> list[str]:
    paths = [tmp_path / "rough.obj", tmp_path / "ball.obj"]
    for path, file in zip(paths, (rough_ball, ball), strict=True):
        path.write_bytes(file.data)
    return [str(path) for path in paths]


def test_a_tolerance_that_a_service_does_not_reach_exits_with_1_and_places(
    stack: Stack, pair: list[str], tmp_path: Path
) -> None:
    quick = ("--set", "effort=fast", "--set", "quality.samples=500")
    out = tmp_path / "out.obj"
    send = ("submit", *pair, "--server", stack.url, "-o", str(out), *quick)

    missed = meshcone(*send, "--set", "within=1e-9%")
    reached = meshcone(*send, "--set", "within=0.5mm")

    assert missed.returncode == 1
    assert missed.stderr.startswith("not within 1e-9%, after 3 refinements")
    assert "place  " in missed.stderr
    assert out.exists()
    assert (reached.returncode, reached.stderr) == (0, "")


def test_a_gate_that_a_service_does_not_find_passed_exits_with_1(
    stack: Stack, pair: list[str], tmp_path: Path
) -> None:
    report = tmp_path / "out.json"
    gates = '{"point_to_surface.max": {"max": 1e-9}}'

    done = meshcone(
        *("submit", *pair, "--server", stack.url, "--report", str(report)),
        *("--set", "mode=measure", "--set", f"gates={gates}"),
    )

    assert done.returncode == 1
    assert done.stderr.startswith("FAILED")
    assert report.exists()


@pytest.fixture(scope="module")
def guarded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Stack, Path]]:
    """A service that asks for keys, and its data directory."""
    directory = tmp_path_factory.mktemp("guarded")
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("MESHCONE_REQUIRE_KEYS", "always")
        with Stack(WorkerSettings(data_dir=directory), log=directory / "log") as running:
            yield running, directory


def test_a_mesh_comes_back_refined_with_its_proof(
    stack: Stack, pair: list[str], tmp_path: Path
) -> None:
    out, report = tmp_path / "out.obj", tmp_path / "out.json"

    done = meshcone("submit", *pair, "--server", stack.url, "-o", str(out), "--report", str(report))
    verified = meshcone(
        *("verify", str(report), "--source", pair[0], "--reference", pair[1]),
        *("--refined", str(out)),
    )

    assert (done.returncode, done.stderr) == (0, "")
    assert json.loads(report.read_bytes())["outcome"] == "improved"
    assert verified.returncode == 0, verified.stdout


def test_without_a_place_for_results_it_only_sends(stack: Stack, pair: list[str]) -> None:
    done = meshcone("submit", *pair, "--server", stack.url, "--label", "nightly", "--label", "mugs")

    job = httpx2.get(done.stdout.strip(), trust_env=False, timeout=60).json()
    assert done.returncode == 0
    assert job["labels"] == ["nightly", "mugs"]


def test_options_go_with_it(stack: Stack, pair: list[str], tmp_path: Path) -> None:
    report = tmp_path / "out.json"

    done = meshcone(
        *("submit", *pair, "--server", stack.url, "--report", str(report)),
        *("--set", "mode=measure"),
    )

    assert (done.returncode, done.stderr) == (0, "")
    assert json.loads(report.read_bytes())["schema"] == "meshcone.report/2"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--server", "http://127.0.0.1:9"], "no MeshCone service answers at http://127.0.0.1:9"),
        (["--server", "nonsense"], "no MeshCone service answers at nonsense"),
        (["--server", "{url}", "--webhook", "http://10.0.0.1/"], "begins with https://"),
        (["--server", "{url}", "--set", "sed=1"], "did you mean 'seed'?"),
        (["--server", "{url}", "--set", "mode=measure", "-o", "out.obj"], "leave out --out"),
    ],
)
def test_what_cannot_be_sent_is_one_line(
    stack: Stack, pair: list[str], arguments: list[str], said: str
) -> None:
    done = meshcone("submit", *pair, *(each.format(url=stack.url) for each in arguments))

    assert done.returncode == 2
    assert said in done.stderr
    assert done.stderr.count("\n") == 1


def test_a_key_opens_the_service_until_it_is_revoked(
    guarded: tuple[Stack, Path], pair: list[str], tmp_path: Path
) -> None:
    stack, directory = guarded
    out = str(tmp_path / "out.obj")
    refused = meshcone("submit", *pair, "--server", stack.url, "-o", out)

    made = meshcone("keys", "create", "release pipeline", "--data-dir", str(directory))
    words = dict(
        line.split(maxsplit=1) for line in made.stdout.replace("webhook ", "").splitlines()
    )
    listed = meshcone("keys", "list", "--data-dir", str(directory))
    done = meshcone(
        "submit", *pair, "--server", stack.url, "-o", out, MESHCONE_API_KEY=words["key"]
    )
    revoked = meshcone("keys", "revoke", words["id"], "--data-dir", str(directory))

    assert refused.returncode == 2
    assert "set MESHCONE_API_KEY" in refused.stderr
    assert words["secret"].startswith("whsec_")
    assert "release pipeline" in listed.stdout
    assert words["key"] not in listed.stdout
    assert (done.returncode, done.stderr) == (0, "")
    assert revoked.returncode == 0
    with Client(stack.url, api_key=words["key"]) as client, pytest.raises(Exception, match="key"):
        client.jobs()


def test_a_scope_that_is_none_is_told_so(guarded: tuple[Stack, Path]) -> None:
    _, directory = guarded

    done = meshcone("keys", "create", "x", "--scopes", "submit,raed", "--data-dir", str(directory))

    assert done.returncode == 2
    assert "unknown scope 'raed'; did you mean 'read'?" in done.stderr


def test_a_key_that_may_submit_alone_submits(guarded: tuple[Stack, Path], pair: list[str]) -> None:
    stack, directory = guarded
    made = meshcone(
        "keys", "create", "sender", "--scopes", "submit", "--data-dir", str(directory)
    ).stdout
    key = next(line.split()[1] for line in made.splitlines() if line.startswith("key "))

    done = meshcone("submit", *pair, "--server", stack.url, MESHCONE_API_KEY=key)

    assert (done.returncode, done.stderr) == (0, "")
    assert "/v1/jobs/" in done.stdout
