"""PLY files whose header declares whole numbers for coordinates or normals keep to them."""

from __future__ import annotations

import io
import re
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from meshcone.assets import WritePolicy, read_asset
from meshcone.assets.policy import NormalsPolicy
from meshcone.errors import InputError
from tests import meshes
from tests.unit.assets.bisecting import bisected

BALL = meshes.sphere(1)
TYPES = {"float": "<f4", "char": "i1", "uchar": "u1", "short": "<i2", "int": "<i4"}


@dataclass(frozen=True)
class Table:
    """The rows of vertices of a PLY: coordinates and, where they have a type, normals."""

    encoding: str
    places: str = "float"
    normals: str | None = None

    @property
    def row(self) -> np.dtype[Any]:
        fields = [("p", TYPES[self.places], 3)]
        return np.dtype(fields + ([("n", TYPES[self.normals], 3)] if self.normals else []))

    def file(self, places: NDArray[Any], normals: NDArray[Any] | None = None) -> bytes:
        head = ["ply", f"format {self.encoding} 1.0", f"element vertex {len(places)}"]
        head += [f"property {self.places} {name}" for name in "xyz"]
        head += [f"property {self.normals} n{name}" for name in "xyz" if self.normals]
        head += [f"element face {len(BALL.faces)}", "property list uchar int vertex_indices"]
        start = "\n".join([*head, "end_header", ""]).encode()
        if self.encoding == "ascii":
            columns = places if normals is None else np.hstack([places, normals])
            rows = [" ".join(f"{word:g}" for word in row) for row in columns]
            rows += [f"3 {a} {b} {c}" for a, b, c in BALL.faces]
            return start + "\n".join([*rows, ""]).encode()
        table = np.zeros(len(places), self.row)
        table["p"] = places
        if normals is not None:
            table["n"] = normals
        faces = np.zeros(len(BALL.faces), [("size", "u1"), ("corners", "<i4", 3)])
        faces["size"], faces["corners"] = 3, BALL.faces
        return start + table.tobytes() + faces.tobytes()

    def normals_of(self, data: bytes) -> NDArray[np.float64]:
        head, _, body = data.partition(b"end_header\n")
        found = re.search(rb"element vertex (\d+)", head)
        assert found
        count = int(found[1])
        if self.encoding == "ascii":
            return np.array([line.split()[3:] for line in body.split(b"\n")[:count]], float)
        return np.frombuffer(body, self.row, count)["n"].astype(float)


ENCODINGS = ("ascii", "binary_little_endian")


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize(("kind", "scale"), [("char", 127), ("char", 100), ("short", 32767)])
def test_whole_normals_stay_as_long_as_they_were(encoding: str, kind: str, scale: int) -> None:
    table = Table(encoding, normals=kind)
    asset = read_asset("ball.ply", table.file(BALL.vertices, np.rint(BALL.vertices * scale)))

    found = table.normals_of(asset.patched(asset.vertices * (1, 1, 3)))

    lengths = np.linalg.norm(found, axis=1)
    assert np.abs(lengths - scale).max() < 2
    exact = BALL.vertices / (1, 1, 3)
    exact /= np.linalg.norm(exact, axis=1, keepdims=True)
    assert np.einsum("ij,ij->i", found / lengths[:, None], exact).min() > 0.9


def test_a_whole_normal_without_length_gets_that_of_the_longest() -> None:
    table = Table("binary_little_endian", normals="char")
    normals = np.rint(BALL.vertices * 90)
    normals[0] = 0
    asset = read_asset("ball.ply", table.file(BALL.vertices, normals))

    found = table.normals_of(asset.patched(asset.vertices * 2))

    assert np.linalg.norm(found[0]) == pytest.approx(90, abs=2)


def test_normals_without_a_sign_are_refused_unless_they_are_kept() -> None:
    table = Table("binary_little_endian", normals="uchar")
    source = table.file(BALL.vertices, np.rint(127.5 + 127.5 * BALL.vertices))
    asset = read_asset("ball.ply", source)

    with pytest.raises(InputError, match="expected normals nx, ny, nz with a sign"):
        asset.ensure_writable(WritePolicy())

    kept = asset.patched(asset.vertices * 2, WritePolicy(normals="keep"))
    assert np.array_equal(table.normals_of(kept), table.normals_of(source))


def test_whole_coordinates_of_a_text_stay_whole() -> None:
    source = Table("ascii", places="int").file(np.rint(BALL.vertices * 1000))
    asset = read_asset("ball.ply", source)
    target = asset.vertices * 1.0007

    written = asset.patched(target)

    assert b"." not in written.partition(b"end_header\n")[2]
    theirs = trimesh.load_mesh(io.BytesIO(written), file_type="ply", process=False)
    assert np.array_equal(theirs.vertices, np.rint(target[asset.weld]))


def test_a_coordinate_of_a_text_that_does_not_fit_its_type_is_refused_with_its_line() -> None:
    places = np.rint(BALL.vertices * 100)
    asset = read_asset("ball.ply", Table("ascii", places="char").file(places))
    beyond = int(np.flatnonzero(np.abs(places[:, 0] * 2) > 127)[0])

    with pytest.raises(InputError, match="does not fit int8") as refused:
        asset.patched(asset.vertices * (2, 1, 1))

    header = 9
    assert refused.value.place == f"line {header + beyond + 1}"


def test_a_text_with_decimals_where_its_header_declares_none_keeps_decimals() -> None:
    asset = read_asset("ball.ply", Table("ascii", places="int").file(BALL.vertices))
    target = asset.vertices * 1.25
    again = read_asset("ball.ply", asset.patched(target))
    assert np.allclose(again.vertices, target, atol=1e-5)


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("policy", ["recompute", "keep"])
def test_new_vertices_have_whole_normals_as_long_as_those_around(
    encoding: str, policy: NormalsPolicy
) -> None:
    table = Table(encoding, normals="char")
    asset = read_asset("ball.ply", table.file(BALL.vertices, np.rint(BALL.vertices * 127)))

    divided = read_asset("ball.ply", asset.divided(bisected(asset.faces, [0, 7])))
    found = table.normals_of(divided.patched(divided.vertices * 2, WritePolicy(normals=policy)))

    assert len(found) > len(BALL.vertices)
    assert np.abs(np.linalg.norm(found, axis=1) - 127).max() < 2
    units = divided.positions / np.linalg.norm(divided.positions, axis=1, keepdims=True)
    assert np.einsum("ij,ij->i", found / 127, units).min() > 0.9
