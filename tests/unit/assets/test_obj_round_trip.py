"""Whatever an OBJ file holds, only the numbers of positions and normals change."""

from __future__ import annotations

import re

import numpy as np
from hypothesis import assume, given

from meshcone.assets import Asset, WritePolicy, read_asset
from meshcone.errors import InputError
from tests.unit.assets.random_obj import obj_files

NORMALS_KEPT = WritePolicy(normals="keep")
TURN = np.array([[0.8, 0.6, 0], [-0.6, 0.8, 0], [0, 0, 1]])

# A statement and what follows it up to the next: told apart here without the reader's help.
_CONTINUED = re.compile(
    rb"(?:[^\r\n#\\]|\\(?:\r\n|\r|\n)|\\(?![\r\n]))*(?:#[^\r\n]*)?(?:\r\n|\r|\n|$)"
)
_VECTOR = re.compile(
    rb"((?:\xef\xbb\xbf)?(?:\s|\\)*vn?(?:\s|\\)+)([^\s\\#]+)((?:\s|\\)+)([^\s\\#]+)"
    rb"((?:\s|\\)+)([^\s\\#]+)(.*)",
    re.DOTALL,
)


def read(data: bytes) -> Asset:
    try:
        return read_asset("mesh.obj", data)
    except InputError as error:  # one that the file's own vertices may bring about
        assume("have no area" not in error.message)
        raise


def skeleton(data: bytes) -> list[bytes]:
    """The file without the three numbers of its v and vn statements."""
    statements = []
    for statement in _CONTINUED.findall(data):
        match = _VECTOR.match(statement)
        kept = statement if match is None else b"|".join(match.group(1, 3, 5, 7))
        statements.append(kept)
    return statements


@given(obj_files())
def test_unmoved_it_is_the_same_file(data: bytes) -> None:
    asset = read(data)
    assert asset.patched(asset.vertices) == data


@given(obj_files())
def test_moved_it_differs_in_positions_and_normals_alone(data: bytes) -> None:
    asset = read(data)
    moved = asset.vertices @ TURN + np.array([1, -2, 0.125])
    written = asset.patched(moved)
    assert skeleton(written) == skeleton(data)
    again = read_asset("mesh.obj", written)
    used = asset.weld >= 0
    assert np.abs(again.positions[used] - moved[asset.weld[used]]).max() <= 1e-5
    assert np.array_equal(again.positions[~used], asset.positions[~used])


@given(obj_files())
def test_a_vertex_that_stays_keeps_its_text(data: bytes) -> None:
    asset = read(data)
    moved = asset.vertices.copy()
    moved[0] += 1
    written = read_asset("mesh.obj", asset.patched(moved, NORMALS_KEPT)).positions
    before = _CONTINUED.findall(data)
    after = _CONTINUED.findall(asset.patched(moved, NORMALS_KEPT))
    changed = sum(one != other for one, other in zip(before, after, strict=True))
    assert changed == np.count_nonzero(asset.weld == 0)
    assert np.array_equal(written[asset.weld != 0], asset.positions[asset.weld != 0])
