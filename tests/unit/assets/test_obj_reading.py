from __future__ import annotations

import numpy as np
import pytest

from meshcone.assets import Limits, read_asset
from meshcone.errors import InputError, LimitError
from meshcone.notices import Code, Notice
from tests.unit.assets.builders import CUBE, cube_obj

CORNERS = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"


def read(text: str | bytes, limits: Limits | None = None):
    data = text if isinstance(text, bytes) else text.encode()
    return read_asset("mesh.obj", data, limits=limits)


def test_quads_become_triangles_over_the_files_vertices():
    asset = read(cube_obj())
    counts = asset.counts()
    assert set(map(tuple, asset.vertices)) == set(map(tuple, CUBE))
    assert (counts.vertices, counts.polygons, counts.faces) == (8, 6, 12)
    assert (counts.meshes, counts.materials) == (1, 2)


@pytest.mark.parametrize("face", ["1 2 3", "1/1 2/1 3/1", "1//1 2//1 3//1", "1/1/1 2/1/1 3/1/1"])
def test_every_form_of_a_corner_names_its_vertex_first(face):
    asset = read(f"{CORNERS}vt 0 0\nvn 0 0 1\nf {face}\n")
    assert asset.faces.tolist() == [[0, 1, 2]]


def test_forms_may_be_mixed():
    asset = read(f"{CORNERS}vt 0 0\nvn 0 0 1\nf 1 2/1 3//1\nf 1/1/1 3/ 4//\n")
    assert asset.faces.tolist() == [[0, 1, 2], [0, 2, 3]]


def test_negative_indices_count_back_from_their_own_line():
    first = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\n"
    second = "v 0 0 5\nv 1 0 5\nv 0 1 5\nf -3 -2 -1\n"
    asset = read(first + second)
    assert asset.faces.tolist() == [[0, 1, 2], [3, 4, 5]]


def test_a_face_may_come_before_its_vertices():
    assert read("f 1 2 3\n" + CORNERS).faces.tolist() == [[0, 1, 2]]


@pytest.mark.parametrize("line_end", ["\n", "\r\n", "\r"])
def test_any_line_end_separates_statements(line_end):
    asset = read(f"{CORNERS}f 1 2 3".replace("\n", line_end))
    assert asset.counts().vertices == 4


def test_a_backslash_continues_a_statement():
    asset = read("v 0 0 \\\n0\nv 1 0 0\nv 0 1 0\nf 1 \\\r\n  2 \\\n 3\n")
    assert asset.faces.tolist() == [[0, 1, 2]]


def test_a_backslash_does_not_continue_a_comment():
    assert read("# C:\\models\\\n" + CORNERS + "f 1 2 3\n").counts().vertices == 4


def test_lines_points_and_unknown_statements_are_passed_over():
    asset = read(f"{CORNERS}l 1 2\np 4\nvx 9 9 9\nfoo\ns off\nf 1 2 3\n")
    assert asset.counts().faces == 1


def test_indentation_tabs_and_a_byte_order_mark_are_accepted():
    assert read("\ufeffv\t0 0 0\n  v 1 0 0\n\t v 0 1 0\n f 1 2 3").counts().vertices == 3


def test_a_face_of_two_corners_is_ignored_with_a_warning():
    asset = read(f"{CORNERS}f 1 2\nf 1 2 3\n")
    words = "a face with fewer than 3 corners; ignored"
    assert asset.warnings == (Notice(Code.FACES_TOO_FEW_CORNERS, words, "line 5"),)


def test_an_unknown_normal_is_ignored_with_a_warning():
    asset = read(f"{CORNERS}f 1//7 2//7 3//7\n")
    assert asset.warnings[0].code == Code.NORMALS_UNKNOWN
    assert "normal the file does not have" in asset.warnings[0].words


@pytest.mark.parametrize(
    ("text", "place", "message"),
    [
        (CORNERS + "f 0 1 2", "line 5", "names vertex 0; the file has vertices 1 to 4"),
        (CORNERS + "f 1 2 5", "line 5", "names vertex 5"),
        (CORNERS + "f -5 1 2", "line 5", "names vertex -5"),
        (CORNERS + "f 1 2 99999999999999999999999", "line 5", "names vertex"),
        (CORNERS + "f 1 2 x", "line 5", "found 'x'"),
        (CORNERS + "f 1 2 1/2/3/4", "line 5", "found '1/2/3/4'"),
        (CORNERS + "f 1 2 1_0", "line 5", "found '1_0'"),
        (CORNERS + "f 1-2 - 4", "line 5", "found '1-2'"),
        (CORNERS + "f 1 2 3x", "line 5", "found '3x'"),
        (CORNERS + "f 1/-1/- 2/1/1 3/1/1", "line 5", "found '1/-1/-'"),
        (CORNERS + "f 1 2 /3", "line 5", "found '/3'"),
        ("v 0 0 0\nv 1 nan 0\n", "line 2", "expected a finite number, found 'nan'"),
        ("v 0 0 0\nv 1 -inf 0\n", "line 2", "expected a finite number, found '-inf'"),
        ("v 0 0 1e61\n", "line 1", "expected a number of at most 1e\\+60, found '1e61'"),
        ("v 0 0 0\nv 1 1e999 0\n", "line 2", "found '1e999'"),
        ("v 0 0 0\nv 1,5 0 0\n", "line 2", "found '1,5'"),
        ("v 0 0 0\nv 1_0 0 0\n", "line 2", "found '1_0'"),
        ("v 0 0 0\nv 1 0\n", "line 2", "needs 3 coordinates, found 2"),
        ("v 0 0 0\n\nv 1 \\\n\\\n0\nv a 0 0\n", "line 3", "needs 3 coordinates, found 2"),
        ("f 1 2 3", "line 1", "the file has no vertices"),
        (CORNERS, None, "it has no faces"),
        (CORNERS + "f 1 1 1", None, "its faces have no area"),
        ("\xfe\xff\0v".encode("latin-1"), "line 1", "UTF-16"),
    ],
)
def test_a_damaged_file_is_refused_with_its_line(text, place, message):
    with pytest.raises(InputError, match=message) as caught:
        read(text)
    assert caught.value.file == "mesh.obj"
    assert caught.value.place == place


def test_more_vertices_than_allowed_are_refused():
    with pytest.raises(LimitError, match="4 vertices; this installation accepts 3"):
        read(CORNERS + "f 1 2 3", Limits(vertices=3))


def test_polygons_count_as_the_triangles_they_make():
    with pytest.raises(LimitError, match="2 triangles"):
        read(CORNERS + "f 1 2 3 4", Limits(faces=1))


def test_lines_are_counted_before_they_are_told_apart():
    with pytest.raises(LimitError, match="6 lines; this installation accepts 5"):
        read(CORNERS + "f 1 2 3\r\n", Limits(lines=5))


@pytest.mark.parametrize("comment", ["", " # a comment"])
def test_the_corners_of_a_long_face_are_counted_before_they_are_told_apart(comment):
    corners = "1 2 3 4 " * 2_000_000
    with pytest.raises(LimitError, match="triangles") as caught:
        read(f"{CORNERS}f {corners}{comment}\n")
    assert caught.value.place == "line 5"


def test_names_are_shortened_where_regions_multiply_them():
    asset = read(f"{CORNERS}o {'x' * 1000}\nf 1 2 3\n")
    assert asset.region_names == ("x" * 60,)


def test_a_limit_can_be_set_in_the_environment(monkeypatch):
    monkeypatch.setenv("MESHCONE_LIMIT_FILE_BYTES", "10")
    with pytest.raises(LimitError, match="MESHCONE_LIMIT_FILE_BYTES"):
        read(CORNERS + "f 1 2 3")


def test_arrays_cannot_be_changed():
    asset = read(CORNERS + "f 1 2 3")
    with pytest.raises(ValueError, match="read-only"):
        asset.vertices[0] = np.nan
