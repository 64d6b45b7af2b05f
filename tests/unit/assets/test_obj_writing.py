from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from meshcone.assets import WritePolicy, read_asset
from tests.unit.assets.builders import cube_obj

moves = arrays(np.float64, (8, 3), elements=st.floats(-3, 3, width=32))


def read(data: bytes):
    return read_asset("mesh.obj", data)


def vectors(data: bytes, keyword: bytes) -> list[list[float]]:
    lines = (line.split() for line in data.splitlines())
    return [[float(word) for word in words[1:4]] for words in lines if words[:1] == [keyword]]


def test_nothing_moved_gives_the_same_bytes():
    asset = read(cube_obj())
    assert asset.patched(asset.vertices.copy()) == cube_obj()


@given(moves)
def test_vertices_come_back_where_they_were_put(move):
    asset = read(cube_obj())
    moved = asset.vertices + move
    again = read(asset.patched(moved))
    assert again.positions[asset.weld.argsort()] == pytest.approx(moved, abs=1e-6, rel=1e-5)


@given(moves)
def test_everything_but_positions_and_normals_stays(move):
    asset = read(cube_obj())
    rest = [
        re.sub(rb"^(v +)\S+( +)\S+(\s+)\S+", rb"\1x\2y\3z", re.sub(rb"^vn.*", b"vn", line))
        for data in (cube_obj(), asset.patched(asset.vertices + move))
        for line in data.splitlines(keepends=True)
    ]
    half = len(rest) // 2
    assert rest[:half] == rest[half:]


def test_a_vertex_that_stays_keeps_its_text():
    asset = read(cube_obj())
    moved = asset.vertices.copy()
    moved[3] += 0.5
    before, after = (
        cube_obj().splitlines(),
        asset.patched(moved, WritePolicy(normals="keep")).splitlines(),
    )
    assert sum(old != new for old, new in zip(before, after, strict=True)) == 1


def test_a_coordinate_that_stays_keeps_its_text():
    asset = read(b"v 0.000 0 0\nv 1.000 0.0 0e0\nv 0 1 0\nf 1 2 3\n")
    moved = asset.vertices.copy()
    moved[1, 0] = 1.25
    assert asset.patched(moved).splitlines()[1] == b"v 1.25 0.0 0e0"


def test_seams_stay_closed():
    asset = read(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 4 6 5\n")
    again = read(asset.patched(asset.vertices + np.pi))
    assert again.weld.tolist() == asset.weld.tolist()


def test_an_unused_vertex_stays():
    data = b"v 7 7 7\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 2 3 4\n"
    asset = read(data)
    assert asset.patched(asset.vertices + 1).startswith(b"v 7 7 7\n")


def test_a_continued_statement_keeps_its_lines():
    asset = read(b"v 0 \\\r\n 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert asset.patched(asset.vertices + 1).startswith(b"v 1 \\\r\n 1 1\n")


def test_the_files_own_precision_is_used():
    asset = read(b"v 0.123456789 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    moved = asset.vertices.copy()
    moved[0, 0] = 1 / 3
    assert asset.patched(moved).startswith(b"v 0.333333333 0 0\n")


def test_decimals_stay_as_many_as_the_file_always_writes():
    asset = read(
        b"v 0.000000 0.000000 0.500000\nv 1.000000 0.000000 0.000000\nv 0.000000 1.0"
        b"00000 0.000000\nf 1 2 3\n"
    )
    moved = asset.vertices.copy()
    moved[0] = 2.25, 1 / 3, -1e-6
    assert asset.patched(moved).startswith(b"v 2.250000 0.333333 -0.000001\n")


def test_decimals_too_few_for_a_small_model_become_as_many_as_it_needs():
    asset = read(b"v 0.000 0.000 0.000\nv 0.001 0.000 0.000\nv 0.000 0.001 0.000\nf 1 2 3\n")
    moved = asset.vertices + np.array([1 / 3000, 0, 0])
    assert read(asset.patched(moved)).vertices == pytest.approx(moved, abs=1e-10)


def test_an_author_of_a_thousand_decimals_gets_no_more_than_numbers_hold():
    zeros = b"." + b"0" * 1000
    asset = read(b"v 0Z 0Z 0Z\nv 1Z 0Z 0Z\nv 0Z 1Z 0Z\nf 1 2 3\n".replace(b"Z", zeros))
    assert asset.patched(asset.vertices + 1 / 3).startswith(b"v 0.33333333333333331 0.333")


def test_normals_written_with_one_decimal_get_four():
    head = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0.0 0.0 1.0\nf 1//1 2//1 3//1\n"
    asset = read(head)
    moved = asset.vertices.copy()
    moved[0, 2] = 1
    assert b"\nvn 0.5774 0.5774 0.5774\n" in asset.patched(moved)


def test_six_digits_are_the_least():
    asset = read(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    moved = asset.vertices.copy()
    moved[0, 0] = 1 / 3
    digits = asset.patched(moved).split()[1]
    assert float(digits) == pytest.approx(1 / 3, abs=1e-6)
    assert len(digits) < 12


def test_a_model_far_from_the_origin_gets_the_digits_it_needs():
    asset = read(b"v 500000 0 0\nv 500001 0 0\nv 500000 1 0\nf 1 2 3\n")
    moved = asset.vertices + 1 / 3
    assert read(asset.patched(moved)).vertices == pytest.approx(moved, abs=1e-6)


def test_a_shared_normal_follows_its_side():
    asset = read(cube_obj())
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    before = np.array(vectors(cube_obj(), b"vn"))
    after = np.array(vectors(asset.patched(asset.vertices @ turn.T), b"vn"))
    assert after == pytest.approx(before @ turn.T, abs=1e-6)


def test_normals_can_be_kept():
    asset = read(cube_obj())
    after = asset.patched(
        asset.vertices @ np.diag([1, 2, 3]) + asset.vertices[:, ::-1], WritePolicy(normals="keep")
    )
    assert vectors(after, b"vn") == vectors(cube_obj(), b"vn")


def test_normals_no_face_uses_stay():
    asset = read(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1 2 3\n")
    assert b"\nvn 0 0 1\nf 1 2 3\n" in asset.patched(asset.vertices * 2 + 1)


def test_a_malformed_normal_stays_as_it_is():
    asset = read(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvn nan 0 -1.#IND\nf 1//1 2//1 3//1\n")
    assert b"\nvn nan 0 -1.#IND\n" in asset.patched(asset.vertices * 2 + 1)


def test_positions_must_match_the_mesh():
    asset = read(cube_obj())
    with pytest.raises(ValueError, match="expected"):
        asset.patched(asset.vertices[:3])
    with pytest.raises(ValueError, match="finite"):
        asset.patched(asset.vertices * np.nan)
