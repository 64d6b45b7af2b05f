"""``meshcone audit`` as its user sees it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.commands import assert_refused, meshcone
from tests.whole_asset import whole


@pytest.fixture
def directory(tmp_path: Path) -> Path:
    """A directory with an asset, and a copy of it that has lost its animation."""
    document = whole()
    (tmp_path / "master.gltf").write_bytes(document.to_bytes())
    del document.json["animations"]
    (tmp_path / "asset.gltf").write_bytes(document.to_bytes())
    return tmp_path


def test_an_asset_is_described_by_the_names_that_gates_use(directory: Path) -> None:
    finished = meshcone(directory, "audit", "asset.gltf")

    lines = {line.split()[0]: line for line in finished.stdout.splitlines()}
    assert finished.returncode == 0
    assert "triangles 4, vertices 8, draw_calls 2" in lines["budget"]
    assert set(lines) >= {"size", "geometry", "shading", "uv", "textures", "materials", "motion"}


def test_what_changed_against_a_reference_fails_its_gate(directory: Path) -> None:
    (directory / "gates.toml").write_text(
        '[gates]\n"changes.lost.animations" = { max = 0 }\n"asset.budget.triangles" = { max = 4 }\n'
    )

    finished = meshcone(
        directory,
        *("audit", "asset.gltf", "--reference", "master.gltf"),
        *("--gates", "gates.toml", "--report", "out.json"),
    )

    report = json.loads((directory / "out.json").read_text())
    assert finished.returncode == 1
    assert (
        "FAILED      changes.lost.animations 1, allowed 0: animation 'swing' is missing"
        in finished.stdout.splitlines()
    )
    assert "ok          asset.budget.triangles 4, allowed 4" in finished.stdout.splitlines()
    assert (report["schema"], report["mode"]) == ("meshcone.report/2", "audit")
    assert report["gates"]["verdict"] == "fail"


def test_a_gate_that_needs_a_measurement_is_refused(directory: Path) -> None:
    (directory / "gates.toml").write_text("[gates]\nfscore.min = 1\n")

    finished = meshcone(directory, "audit", "asset.gltf", "--gates", "gates.toml")

    assert_refused(finished, "only a measurement or a refinement has this value")


def test_what_is_to_be_kept_is_named_with_commas(directory: Path) -> None:
    against = ("audit", "asset.gltf", "--reference", "master.gltf")

    kept = meshcone(directory, *against, "--keep", "uvs,materials")
    lost = meshcone(directory, *against, "--keep", "uvs,animations")
    unknown = meshcone(directory, *against, "--keep", "uvz")

    assert kept.returncode == 0
    assert lost.returncode == 1
    assert (
        "FAILED      changes.lost.animations 1, allowed 0: animation 'swing' is missing"
        in lost.stdout.splitlines()
    )
    assert_refused(unknown, "unknown 'uvz'")


def test_an_image_that_was_sent_with_neither_file_is_said_not_to_be_compared(
    directory: Path,
) -> None:
    document = whole()
    document.json["images"][0] = {"uri": "wood.png"}
    (directory / "asset.gltf").write_bytes(document.to_bytes())

    finished = meshcone(directory, "audit", "asset.gltf", "--reference", "asset.gltf")

    assert "not tested  images or materials that were sent with neither file" in finished.stdout
