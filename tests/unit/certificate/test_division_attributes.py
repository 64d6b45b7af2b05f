"""What lies on divided faces: attributes, materials and polygons, and forgeries that fail."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from meshcone.certificate.dividing import divide
from meshcone.certificate.division import DivisionRecord
from meshcone.detail.records import DetailRecord
from meshcone.files import MeshFile
from meshcone.options import parse_options
from meshcone.pair import read_pair
from meshcone.surface import Subdivision
from tests.unit.assets.bisecting import bisected
from tests.unit.certificate.dividing import OPTIONS, REFERENCE, SOURCE, lines
from tests.unit.engine.evidence import Evidence


@pytest.fixture(scope="module")
def honest() -> Evidence:
    return Evidence.of(SOURCE, REFERENCE, OPTIONS)


def changed(honest: Evidence, before: bytes, after: bytes) -> Evidence:
    """The refined file with other text, and hashes that are its own."""
    data = honest.refined.data.replace(before, after, 1)
    assert data != honest.refined.data
    return replace(honest, refined=replace(honest.refined, data=data)).with_forged_hashes()


def line_of(data: bytes, keyword: bytes, number: int) -> bytes:
    return [line for line in data.split(b"\n") if line.startswith(keyword + b" ")][number]


@pytest.mark.parametrize("number", [3, -1], ids=["of the source", "new"])
def test_a_texture_coordinate_moved_by_a_thousandth_fails(honest: Evidence, number: int) -> None:
    line = line_of(honest.refined.data, b"vt", number)
    u, v = map(float, line.split()[1:])
    found = lines(changed(honest, line + b"\n", b"vt %.8f %.8f\n" % (u, v + 0.001)))
    ok, words = found["attributes"]
    assert not ok
    assert words.startswith("TEXCOORD_0 of face")
    assert "is 0.001 from what lies there in the source" in words
    assert found["closeness"][0]


def test_a_colour_changed_by_a_thousandth_fails(honest: Evidence) -> None:
    line = line_of(honest.refined.data, b"v", -1)
    *words, blue = line.split()
    other = b" ".join([*words, b"%.9g" % (float(blue) + 0.001)])
    ok, told = lines(changed(honest, line, other))["attributes"]
    assert not ok
    assert told.startswith("COLOR_0 of face")


def test_a_face_under_another_material_fails(honest: Evidence) -> None:
    data = honest.refined.data
    start = data.index(b"usemtl part16")
    line = data[: start - 1].rpartition(b"\n")[2]
    moved = changed(honest, line + b"\nusemtl part16\n", b"usemtl part16\n" + line + b"\n")
    ok, words = lines(moved)["attributes"]
    assert not ok
    assert "has another material than the one it lies in" in words


def test_an_added_face_fails(honest: Evidence) -> None:
    data = honest.refined.data + b"f 1/1 2/2 3/3\n"
    added = replace(honest, refined=replace(honest.refined, data=data)).with_forged_hashes()
    ok, words = lines(added)["division"]
    assert not ok
    assert words.startswith("the refined file has ")
    assert "triangles, the source divided so has " in words


# A square that is not divided, beside a triangle that is.
SQUARE = b"""v 0 0 0
v 2 0 0
v 2 2 0
v 0 2 0
v 3 1 0
vt 0 0
vt 1 0
vt 1 1
vt 0 1
f 1/1 2/2 3/3 4/4
f 5/1 2/2 3/3
"""


@pytest.mark.parametrize(("texture", "holds"), [(b"vt 1 1\n", True), (b"vt 1 1.001\n", False)])
def test_a_polygon_that_is_split_otherwise_where_it_was_moved_to_is_compared_too(
    honest: Evidence, texture: bytes, holds: bool
) -> None:
    options = parse_options(OPTIONS)
    pair = read_pair(MeshFile("square.obj", SQUARE), REFERENCE, options).under(options)
    halves = bisected(pair.source_asset.faces, [5])
    divided = pair.divided(halves, options)
    dented = divided.source_asset.vertices.copy()
    dented[3] = (1.5, 0.5, 0)  # now the diagonal runs from there
    refined = divided.source_asset.patched(dented).replace(b"vt 1 1\n", texture)
    again = divided.read_patched(refined)
    assert not np.array_equal(again.triangles, divided.source_asset.triangles)
    most = options.detail.faces_allowed(3)
    told = DetailRecord(
        faces_before=3, faces_after=4, faces_allowed=most, divided=1, levels=1, stopped="budget"
    )
    report = honest.report.model_copy(update={"detail": told})
    _, checks = divide(pair, DivisionRecord.of(halves), report, refined)
    assert [check.ok for check in checks] == [True, holds]


# The last vertex is in the middle of a side of the first face: the third one has no width.
BESIDE = b"""v 0 0 0
v 2 0 0
v 0 2 0
v 2 2 1
v 1 1 0
usemtl one
f 1 2 3
usemtl two
f 2 4 5
f 3 2 5
usemtl three
f 5 4 3
"""


def test_a_new_vertex_that_falls_on_one_that_is_there_is_that_one(honest: Evidence) -> None:
    options = parse_options(OPTIONS)
    pair = read_pair(MeshFile("beside.obj", BESIDE), REFERENCE, options).under(options)
    corners = [[[2, 0, 0], [0, 2, 0], [0, 1, 1]], [[2, 0, 0], [0, 1, 1], [0, 0, 2]]]
    sliver = [[[2, 0, 0], [1, 1, 0], [0, 0, 2]], [[1, 1, 0], [0, 2, 0], [0, 0, 2]]]
    own = [(2 * np.eye(3, dtype=int)).tolist()]
    division = Subdivision(
        4, np.array([0, 0, 1, 2, 2, 3]), np.array(corners + own + sliver + own), 1
    )
    divided = pair.divided(division, options)
    assert len(divided.source.faces) == 4  # those that are left of the narrow one have no area
    assert len(divided.source.vertices) == 5
    most = options.detail.faces_allowed(4)
    told = DetailRecord(
        faces_before=4, faces_after=6, faces_allowed=most, divided=2, levels=1, stopped="budget"
    )
    report = honest.report.model_copy(update={"detail": told})
    refined = divided.source_asset.patched(divided.source_asset.vertices * 1.5)
    _, checks = divide(pair, DivisionRecord.of(division), report, refined)
    assert [check.ok for check in checks] == [True, True]
