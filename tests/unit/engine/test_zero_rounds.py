"""Without a round nothing moves, and what does not move is not rewritten."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from meshcone.files import MeshFile
from meshcone.options import parse_options
from meshcone.pair import read_pair
from meshcone.verbs.refine import refine
from tests.unit.assets.builders import cube_gltf, cube_obj
from tests.unit.engine.pairs import smooth

TURNED = {"rotation": [0.1, 0.7, 0.1, 0.7], "scale": [2, -3, 0.5], "translation": [1, 2, 3]}
SOURCES = [
    MeshFile("cube.obj", cube_obj()),
    MeshFile("cube.glb", cube_gltf(**TURNED).glb()),
    MeshFile("cube.gltf", cube_gltf(**TURNED).embedded()),
]


@pytest.mark.parametrize("effort", ["fast", "best"])
@pytest.mark.parametrize("source", SOURCES, ids=lambda source: source.name)
def test_zero_rounds_return_the_same_bytes(source: MeshFile, effort: str) -> None:
    unchanged(source, {"effort": effort})


@pytest.mark.parametrize("source", SOURCES, ids=lambda source: source.name)
def test_zero_rounds_return_the_same_bytes_wherever_a_motion_was_found(source: MeshFile) -> None:
    unchanged(source, {"align": "rigid"})


def unchanged(source: MeshFile, options: dict[str, Any]) -> None:
    answer = refine(source, smooth(), parse_options({**options, "surface": {"fairness": []}}))

    assert answer.data == source.data
    assert answer.report.outcome == "unchanged"
    assert answer.report.solver.rounds == []
    assert answer.report.certificate is None
    json.loads(answer.report.model_dump_json())


@pytest.mark.parametrize("source", SOURCES, ids=lambda source: source.name)
def test_a_vertex_that_stays_in_the_frame_stays_in_the_file(source: MeshFile) -> None:
    pair = read_pair(source, smooth(), parse_options({}))
    positions = pair.source.vertices.copy()
    positions[0] += 0.1

    written = pair.read_patched(pair.patched(positions))

    stayed = pair.source_asset.weld != 0
    assert np.array_equal(written.positions[stayed], pair.source_asset.positions[stayed])
