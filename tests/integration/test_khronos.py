"""What is refined passes Khronos' validator wherever its source did.

Needs node and the npm package gltf-validator: `make validator` installs it.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from tests import shapes
from tests.unit.assets.builders import Gltf, compress, cube_gltf

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
VALIDATOR = Path(os.environ.get("MESHCONE_GLTF_VALIDATOR", sys.prefix))

ball_positions, ball_faces = shapes.sphere(2)


def ball(positions: np.ndarray | None = None, **primitive: object) -> Gltf:
    gltf = Gltf()
    values = ball_positions.astype("f4") if positions is None else positions
    attributes = {"POSITION": gltf.accessor(values)}
    indices = gltf.accessor(ball_faces.reshape(-1).astype("u2"))
    gltf.node(mesh=gltf.mesh({"attributes": attributes, "indices": indices, **primitive}))
    return gltf


def with_tangents() -> Gltf:
    gltf = cube_gltf(rotation=[0.5, 0.5, 0.5, 0.5], scale=[2, 3, -0.5])
    normals = np.frombuffer(bytes(gltf.binary), "<f4", 72, 24 * 12).reshape(-1, 3)
    tangents = np.column_stack([np.roll(normals, 1, axis=1), np.ones(24, "f4")])
    attributes = gltf.json["meshes"][0]["primitives"][0]["attributes"]
    attributes["TANGENT"] = gltf.accessor(tangents.astype("f4"))
    return gltf


def interleaved() -> Gltf:
    gltf = Gltf()
    rows = np.zeros(len(ball_positions), dtype=[("position", "<f4", 3), ("normal", "<f4", 3)])
    rows["position"], rows["normal"] = ball_positions, ball_positions / 2
    view = gltf.view(rows.tobytes(), stride=24)
    attributes = {
        "POSITION": gltf.accessor(rows["position"], view),
        "NORMAL": gltf.accessor(rows["normal"], view, offset=12),
    }
    indices = gltf.accessor(ball_faces.reshape(-1).astype("u2"))
    gltf.node(mesh=gltf.mesh({"attributes": attributes, "indices": indices}))
    return gltf


def sparse() -> Gltf:
    gltf = ball()
    gltf.json["accessors"][0]["sparse"] = {
        "count": 2,
        "indices": {"bufferView": gltf.view(b"\1\0\7\0"), "componentType": 5123},
        "values": {"bufferView": gltf.view(ball_positions[[1, 7]].astype("f4").tobytes())},
    }
    return gltf


def morphed() -> Gltf:
    gltf = ball()
    target = gltf.accessor(np.tile(np.float32([0, 0, 0.5]), (len(ball_positions), 1)))
    gltf.json["meshes"][0]["primitives"][0]["targets"] = [{"POSITION": target}]
    return gltf


def skinned() -> Gltf:
    gltf = ball()
    count = len(ball_positions)
    attributes = gltf.json["meshes"][0]["primitives"][0]["attributes"]
    attributes["JOINTS_0"] = gltf.accessor(np.zeros((count, 4), "u1"))
    attributes["WEIGHTS_0"] = gltf.accessor(np.tile(np.float32([1, 0, 0, 0]), (count, 1)))
    joint = gltf.node()
    gltf.json["skins"] = [{"joints": [joint]}]
    gltf.json["nodes"][0]["skin"] = 0
    return gltf


def quantized() -> Gltf:
    rows = np.zeros((len(ball_positions), 4), dtype="i2")
    rows[:, :3] = np.rint(ball_positions / 2 * 32767)
    gltf = ball()
    view = gltf.view(rows.tobytes(), stride=8)
    position = gltf.accessor(rows[:, :3], view)
    gltf.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = position
    gltf.json["nodes"][0]["scale"] = [2 / 32767] * 3
    gltf.json["extensionsUsed"] = gltf.json["extensionsRequired"] = ["KHR_mesh_quantization"]
    return gltf


def instanced() -> Gltf:
    gltf = with_tangents()
    gltf.node(mesh=0, translation=[9, 0, 0], scale=[-1, 1, 1])
    return gltf


def overlapping() -> Gltf:
    """Positions that colours, unused data and a second mesh read as well."""
    gltf = cube_gltf()
    [primitive] = gltf.json["meshes"][0]["primitives"]
    positions = dict(gltf.json["accessors"][0])
    gltf.json["accessors"] += [positions, positions | {"count": 23}]
    part = primitive | {"attributes": {"POSITION": 5}}
    gltf.json["accessors"].append(gltf.json["accessors"][3] | {"count": 30, "max": [19]})
    primitive["attributes"]["COLOR_0"] = 4
    gltf.node(mesh=gltf.mesh(part | {"indices": 6}), translation=[3, 0, 0])
    return gltf


FILES: dict[str, Callable[[], Gltf]] = {
    "tangents.glb": with_tangents,
    "interleaved.glb": interleaved,
    "sparse.glb": sparse,
    "morphed.glb": morphed,
    "skinned.glb": skinned,
    "quantized.glb": quantized,
    "instanced.glb": instanced,
    "overlapping.glb": overlapping,
    "draco.glb": lambda: compress(cube_gltf()),
}


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A directory with files of every kind."""
    if not (VALIDATOR / "node_modules" / "gltf-validator").is_dir():
        pytest.skip("gltf-validator is not installed: make validator")
    data = tmp_path_factory.mktemp("khronos")
    for name, make in FILES.items():
        (data / name).write_bytes(make().glb())
    gltf = cube_gltf()
    (data / "separate.gltf").write_bytes(gltf.separate("my%20cube.bin"))
    (data / "my cube.bin").write_bytes(gltf.binary)
    embedded = cube_gltf().embedded().replace(b"model/x", b"application/octet-stream")
    (data / "embedded.gltf").write_bytes(embedded)
    return data


def benchmark(data: Path, results: Path, *arguments: str) -> dict[str, dict]:
    """The benchmark's rows, by file and way of writing."""
    command = [sys.executable, str(BENCHMARKS / "khronos.py"), "--data", str(data), *arguments]
    done = subprocess.run(
        [*command, "--validator", str(VALIDATOR), "--json", str(results)],
        capture_output=True,
        text=True,
        timeout=280,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return {f"{row['file']} {row['note']}".strip(): row for row in json.loads(results.read_text())}


@pytest.fixture(scope="module")
def rows(data: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict]:
    return benchmark(data, tmp_path_factory.mktemp("rows") / "rows.json")


@pytest.mark.parametrize(
    "name",
    [
        *sorted(set(FILES) - {"draco.glb"}),
        "separate.gltf",
        "embedded.gltf",
        "draco.glb plain",
        "draco.glb encode",
    ],
)
def test_a_refined_file_is_as_valid_as_its_source(rows: dict[str, dict], name: str) -> None:
    row = rows[name]

    assert not row["refused"]
    assert row["faults"] == []
    errors = {
        side: [issue for issue in row[side] if issue.startswith("error")]
        for side in ("source", "refined")
    }
    assert not errors["refined"]
    # Data that positions and colours share is an error, which a copy for what moves takes away.
    assert bool(errors["source"]) == (name == "overlapping.glb")


def test_a_file_whose_faces_are_divided_brings_no_new_message(data: Path, tmp_path: Path) -> None:
    rows = benchmark(data, tmp_path / "rows.json", "--detail", "8", "--flips", "chart")

    assert len(rows) == len(FILES) + 2
    for row in rows.values():
        assert set(row["refined"]) <= set(row["source"])
        assert row["changes"]["new faces"] > 0
    assert any("of them swapped" in row["changes"] for row in rows.values())


@pytest.fixture
def gltf_diff(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    return import_module("gltf_diff")


def test_a_difference_nobody_needs_is_seen(gltf_diff: ModuleType) -> None:
    before = {"asset": {"version": "2.0", "extras": [1]}, "accessors": [{"min": [0], "count": 3}]}
    after = {"asset": {"version": "2.0", "extras": [1.0]}, "accessors": [{"min": [1], "count": 4}]}

    pointers = set(gltf_diff.json_changes(before, after))

    assert pointers == {"/asset/extras/0", "/accessors/0/min/0", "/accessors/0/count"}
    assert not any(gltf_diff.kind_of(pointer, before) for pointer in pointers)


def test_bounds_may_change_of_what_is_written_alone(gltf_diff: ModuleType) -> None:
    document = cube_gltf().json

    assert gltf_diff.kind_of("/accessors/0/min/2", document) == "bounds"
    assert gltf_diff.kind_of("/accessors/2/min", document) is None


def test_another_order_of_members_is_seen(gltf_diff: ModuleType) -> None:
    assert list(gltf_diff.json_changes({"a": 1, "b": 2}, {"b": 2, "a": 1})) == [
        ": order of members"
    ]


def test_bytes_that_changed_elsewhere_are_seen(gltf_diff: ModuleType) -> None:
    before, after = cube_gltf(), cube_gltf()
    after.binary[24 * 24] ^= 1  # in the texture coordinates
    after.binary[0] ^= 1  # in the positions

    assert list(gltf_diff.changed_elsewhere(before.glb(), after.glb(), {})) == ["/accessors/2"]
