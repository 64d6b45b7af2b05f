"""The command line as its user sees it: files, one-line errors and exit codes."""

from __future__ import annotations

import json
import signal
import socket
from importlib.metadata import version
from pathlib import Path

import pytest

from meshcone.files import MeshFile
from tests import shapes
from tests.commands import assert_refused, meshcone
from tests.integration.waiting import wait_for
from tests.processes import children_of, has_ended
from tests.serving import serving


@pytest.fixture
def directory(tmp_path: Path, rough_ball: MeshFile, ball: MeshFile) -> Path:
    """A directory with a pair of meshes in it."""
    (tmp_path / "rough.obj").write_bytes(rough_ball.data)
    (tmp_path / "ball.obj").write_bytes(ball.data)
    return tmp_path


def test_refine_writes_the_mesh_and_its_report(directory: Path) -> None:
    finished = meshcone(
        directory, "refine", "rough.obj", "ball.obj", "-o", "out.obj", "--report", "out.json"
    )

    report = json.loads((directory / "out.json").read_text())
    assert (finished.returncode, finished.stderr) == (0, "")
    assert (directory / "out.obj").read_bytes().startswith(b"v ")
    assert (directory / "out.certificate.npz").read_bytes().startswith(b"PK")
    assert report["outcome"] == "improved"
    proven, outcome, deviation, certificate, files = finished.stdout.splitlines()
    before, after = (report["quality"][name]["point_to_surface"] for name in ("input", "refined"))
    assert proven == report["statement"]
    assert outcome.startswith("outcome        improved: on average the refined surface lies ")
    assert f"mean {before['mean']:.3g} → {after['mean']:.3g}," in deviation
    assert f"worst vertex {before['max']:.3g} → {after['max']:.3g}," in deviation
    assert certificate == "certificate    holds"
    assert files == "files          out.obj, out.json, out.certificate.npz"


def test_measure_exits_by_its_gates(directory: Path) -> None:
    (directory / "gates.toml").write_text("gates.asset.budget.triangles.max = 3")

    finished = meshcone(
        directory, "measure", "rough.obj", "ball.obj", "--profile", "web", "--gates", "gates.toml"
    )

    assert (finished.returncode, finished.stderr) == (1, "")
    assert "FAILED         asset.budget.triangles" in finished.stdout
    assert "ok             asset.budget.total_bytes" in finished.stdout


def test_refine_takes_options_one_by_one(directory: Path) -> None:
    finished = meshcone(
        directory,
        *("refine", "rough.obj", "ball.obj", "-o", "out.obj", "--report", "out.json", "--quiet"),
        *("--formulation", "centroid", "--set", "seed=5", "--set", "quality.samples=100"),
    )

    assert (finished.returncode, finished.stdout, finished.stderr) == (0, "", "")
    options = json.loads((directory / "out.json").read_text())["options"]
    assert (options["formulation"], options["seed"]) == ("centroid", 5)
    assert options["quality"]["samples"] == 100


def test_refine_finds_the_buffer_beside_a_gltf(directory: Path) -> None:
    vertices, faces = shapes.sphere()
    document, buffer = shapes.gltf(shapes.noisy(vertices), faces, "rough%20data.bin")
    (directory / "rough.gltf").write_bytes(document)
    (directory / "rough data.bin").write_bytes(buffer)

    assert meshcone(directory, "refine", "rough.gltf", "ball.obj", "-o", "out.gltf").returncode == 0
    assert "buffers" in json.loads((directory / "out.gltf").read_text())


def test_refine_does_not_follow_a_gltf_out_of_its_directory(directory: Path) -> None:
    inside = directory / "inside"
    inside.mkdir()
    document, buffer = shapes.gltf(*shapes.sphere(1), "../secret.bin")
    (directory / "secret.bin").write_bytes(buffer)
    (inside / "ball.gltf").write_bytes(document)

    finished = meshcone(inside, "refine", "ball.gltf", "../ball.obj", "-o", "out.gltf")

    assert_refused(finished, "is not the name of a file sent along")


def test_measure_prints_numbers_or_json(directory: Path) -> None:
    table = meshcone(directory, "measure", "rough.obj", "ball.obj")
    document = meshcone(directory, "measure", "rough.obj", "ball.obj", "--json")

    rows = {line.split()[0]: line.split()[1:] for line in table.stdout.splitlines() if line.strip()}
    measured = json.loads(document.stdout)
    mean = measured["quality"]["input"]["point_to_surface"]["mean"]
    assert rows["metric"] == ["input", "floor", "unit"]
    assert rows["point_to_surface.mean"] == [f"{mean:.3g}", "0", "radius"]
    assert rows["validity.watertight"] == ["yes", "yes"]
    assert rows["outcome"][0] == "different:"
    assert measured["outcome"] == "different"


def test_measure_of_a_mesh_against_itself_is_at_the_floor(directory: Path) -> None:
    table = meshcone(directory, "measure", "ball.obj", "ball.obj")

    rows = [line.split() for line in table.stdout.splitlines() if line.startswith(" ")]
    values = [row[1:3] for row in rows if row and "." in row[0]]
    assert len(values) > 10
    assert all(measured == floor for measured, floor in values)
    assert "outcome        indistinguishable" in table.stdout


def test_measure_scores_baselines_within_the_width_of_a_log(directory: Path) -> None:
    table = meshcone(directory, "measure", "rough.obj", "ball.obj", "--set", "baselines=true")

    lines = [line for line in table.stdout.splitlines() if "point_to_surface.mean" in line]
    assert len(lines[0].split()) == 5
    assert len(lines[0]) <= 80


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nowhere.obj", "ball.obj", "-o", "out.obj"], "nowhere.obj: cannot be read"),
        (["bad.obj", "ball.obj", "-o", "out.obj"], "bad.obj"),
        (["rough.obj", "bad.obj", "-o", "out.obj"], "bad.obj"),
        (["rough.obj", "ball.obj", "-o", "out.glb"], "its name must end in '.obj'"),
        (["rough.obj", "ball.obj", "-o", "nowhere/out.obj"], "its directory does not exist"),
        (["rough.obj", "ball.obj"], "Missing option"),
        (["rough.obj"], "Missing argument"),
        (["rough.obj", "ball.obj", "-o", "out.obj", "--set", "sed=1"], "did you mean 'seed'"),
        (["rough.obj", "ball.obj", "-o", "out.obj", "--set", "seed"], "expected KEY=VALUE"),
        (["rough.obj", "ball.obj", "-o", "out.obj", "--formulation", "x"], "'formulation'"),
        (["rough.obj", "ball.obj", "-o", "out.obj", "--bogus"], "No such option"),
        (["rough.obj", "ball.obj", "-o", "out.obj", "--set", "mode=measure"], "meshcone measure"),
    ],
)
def test_what_cannot_be_refined_is_told_in_one_line_and_leaves_nothing_behind(
    directory: Path, arguments: list[str], said: str
) -> None:
    (directory / "bad.obj").write_text("Dear diary,\n")
    before = sorted(directory.iterdir())

    assert_refused(meshcone(directory, "refine", *arguments), said)
    assert sorted(directory.iterdir()) == before


def test_an_existing_file_survives_a_refusal(directory: Path) -> None:
    (directory / "out.obj").write_text("precious")
    (directory / "bad.obj").write_text("Dear diary,\n")

    meshcone(directory, "refine", "bad.obj", "ball.obj", "-o", "out.obj")

    assert (directory / "out.obj").read_text() == "precious"


def test_an_unknown_command_is_told_in_one_line(directory: Path) -> None:
    assert_refused(meshcone(directory, "bogus"), "No such command")


def test_it_states_its_version(directory: Path) -> None:
    answer = meshcone(directory, "--version")

    assert (answer.returncode, answer.stdout) == (0, f"meshcone {version('meshcone')}\n")


def test_without_arguments_it_shows_its_help(directory: Path) -> None:
    assert "Commands:" in meshcone(directory).stderr


def test_a_worker_without_a_broker_says_what_to_do(directory: Path) -> None:
    for command in ("worker", "api"):
        finished = meshcone(directory, command, MESHCONE_REDIS_URL="")
        assert_refused(finished, "MESHCONE_REDIS_URL is not set")


def test_a_setting_that_cannot_be_used_is_named(directory: Path) -> None:
    attempts = meshcone(directory, "serve", MESHCONE_ATTEMPTS="many")
    broker = meshcone(directory, "serve", MESHCONE_REDIS_URL="localhost:6379")
    limit = meshcone(directory, "measure", "rough.obj", "ball.obj", MESHCONE_LIMIT_VERTICES="many")

    assert_refused(attempts, "environment variable MESHCONE_ATTEMPTS")
    assert_refused(broker, "environment variable MESHCONE_REDIS_URL")
    assert_refused(limit, "environment variable MESHCONE_LIMIT_VERTICES")


def test_serve_on_a_taken_port_is_told_in_one_line(directory: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        finished = meshcone(directory, "serve", "--port", str(port))

    assert_refused(finished, f"cannot listen on 127.0.0.1 port {port}")
    assert not (directory / "meshcone-data").exists()


def test_serve_ends_when_told_to_and_takes_everything_with_it(tmp_path: Path) -> None:
    with serving(tmp_path) as service:
        children = children_of(service.process.pid)
        service.process.send_signal(signal.SIGTERM)

        assert service.process.wait(timeout=240) == 0

    assert len(children) == 5  # broker, worker, webhooks, transfers, API
    assert all(has_ended(pid) for pid in children)


def test_nothing_outlives_a_serve_that_was_killed(tmp_path: Path) -> None:
    with serving(tmp_path) as service:
        children = children_of(service.process.pid)
        service.process.kill()

    wait_for(lambda: all(has_ended(pid) for pid in children))


def test_openapi_check_tells_a_stale_file(tmp_path: Path) -> None:
    (tmp_path / "openapi.json").write_text("{}")

    stale = meshcone(tmp_path, "openapi", "-o", "openapi.json", "--check")
    written = meshcone(tmp_path, "openapi", "-o", "openapi.json")
    current = meshcone(tmp_path, "openapi", "-o", "openapi.json", "--check")

    assert_refused(stale, "is not current", code=1)
    assert (written.returncode, current.returncode) == (0, 0)


@pytest.mark.parametrize("mode", ["audit", "refine"])
def test_a_measurement_is_no_other_work(directory: Path, mode: str) -> None:
    told = meshcone(directory, "measure", "rough.obj", "ball.obj", "--set", f"mode={mode}")

    assert_refused(told, f"the mode '{mode}' is not this command's: use `meshcone {mode}`")


def test_a_tolerance_is_reached_and_proven_or_exits_with_1_and_places(directory: Path) -> None:
    quick = ("--set", "effort=fast", "--set", "quality.samples=500")
    kept = meshcone(
        directory, "refine", "rough.obj", "ball.obj", "-o", "kept.obj", "--within", "0.5mm", *quick
    )
    missed = meshcone(
        directory, "refine", "rough.obj", "ball.obj", "-o", "far.obj", "--within", "1e-9%", *quick
    )

    assert kept.returncode == 0
    assert " mm of the reference" in kept.stdout.splitlines()[0]
    assert missed.returncode == 1
    assert missed.stderr.startswith("not within 1e-9%, after 3 refinements")
    assert "place  " in missed.stderr
    assert " units off near (" in missed.stderr
    assert (directory / "far.obj").exists()


def test_detail_adds_faces_says_how_many_and_is_replayed(directory: Path) -> None:
    source, reference = (shapes.obj(*shapes.sphere(level)) for level in (2, 4))
    (directory / "coarse.obj").write_bytes(source)
    (directory / "fine.obj").write_bytes(reference)
    files = ("coarse.obj", "fine.obj")
    quick = ("--set", "effort=fast", "--set", "quality.samples=500")

    made = meshcone(
        directory,
        *("refine", *files, "-o", "out.obj", "--report", "out.json", "--detail", "3x", *quick),
    )
    named = ("--source", files[0], "--reference", files[1], "--refined", "out.obj")
    proof = meshcone(directory, "verify", "out.json", *named, "--replay")

    assert (made.returncode, made.stderr) == (0, "")
    (line,) = (line for line in made.stdout.splitlines() if line.startswith("detail "))
    found = json.loads((directory / "out.json").read_text())["detail"]
    assert line == f"detail         128 → {found['faces_after']} faces, in 3 levels; budget"
    assert 380 <= found["faces_after"] <= 384
    assert (proof.returncode, proof.stderr) == (0, "")
    assert "gives the same bytes" in proof.stdout


@pytest.mark.parametrize(
    ("detail", "said"),
    [
        ("auto", "--detail auto needs a tolerance to reach: add --within"),
        ("lots", "'lots' is not an amount of detail"),
        ("100x", "detail.growth"),
    ],
)
def test_detail_that_means_nothing_is_refused(directory: Path, detail: str, said: str) -> None:
    finished = meshcone(
        directory, "refine", "rough.obj", "ball.obj", "-o", "out.obj", "--detail", detail
    )
    assert_refused(finished, said)
