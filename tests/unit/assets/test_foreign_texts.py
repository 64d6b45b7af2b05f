"""Texts of PLY, STL, OFF and XYZ with marks, line ends and lines that few programs write."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.assets import read_asset
from meshcone.errors import InputError
from meshcone.surface import Subdivision
from tests.unit.assets.bisecting import bisected
from tests.unit.assets.test_foreign_writing import FILES

MARK = b"\xef\xbb\xbf"
FACET = (
    b"facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 2 0 0\nvertex 0 2 0\nendloop\nendfacet\n"
)
STL = b"solid a part\n" + FACET + b"endsolid a part\n"
MOVED = STL.replace(b"0 2 0", b"0 3 0")
HALVES: Subdivision = bisected(np.array([[0, 1, 2]]), [0])


def stretched(data: bytes) -> bytes:
    """A file with its third vertex somewhere else."""
    asset = read_asset("a.stl", data)
    vertices = asset.vertices.copy()
    vertices[2, 1] = 3
    return asset.patched(vertices)


@pytest.mark.parametrize("name", ["ascii.ply", "ascii.stl", "plain.off"])
def test_a_byte_order_mark_is_read_over_and_kept(name: str) -> None:
    plain, marked = (read_asset(name, mark + FILES[name]) for mark in (b"", MARK))
    cut = bisected(plain.faces, [3, 50])

    assert marked.vertices.tobytes() == plain.vertices.tobytes()
    assert marked.patched(plain.vertices * 2) == MARK + plain.patched(plain.vertices * 2)
    assert marked.divided(cut) == MARK + plain.divided(cut)


@pytest.mark.parametrize("name", ["ascii.ply", "ascii.stl", "plain.off"])
def test_a_text_with_a_mark_is_known_by_its_content(name: str) -> None:
    assert read_asset("sent", MARK + FILES[name]).format == name[-3:]


def test_a_binary_stl_may_begin_as_a_mark_does() -> None:
    data = MARK + FILES["binary.stl"][3:]
    asset = read_asset("a.stl", data)

    written = asset.patched(asset.vertices * 2)

    assert (written[:80], len(written)) == (data[:80], len(data))


def test_points_are_read_after_a_mark() -> None:
    points = b"1 0 0\n0 1 0\n0 0 1\n0 0 0\n"

    assert read_asset("a.xyz", MARK + points).counts() == read_asset("a.xyz", points).counts()


@pytest.mark.parametrize("name", ["a.stl", "sent"])
def test_lines_of_an_stl_may_end_with_carriage_returns(name: str) -> None:
    data = STL.replace(b"\n", b"\r")

    assert read_asset(name, data).faces.tolist() == [[0, 1, 2]]
    assert stretched(data) == MOVED.replace(b"\n", b"\r")


@pytest.mark.parametrize(
    "change",
    [
        (b"\nouter", b" outer"),
        (b"\nend", b" end"),
        (b"\nvertex", b"\tvertex"),
        (b"\n", b" "),
        (b"\n", b"  "),
    ],
)
def test_several_statements_of_an_stl_may_be_on_a_line(change: tuple[bytes, bytes]) -> None:
    assert read_asset("a.stl", STL.replace(*change)).faces.tolist() == [[0, 1, 2]]
    assert stretched(STL.replace(*change)) == MOVED.replace(*change)


def test_facets_on_one_line_are_divided() -> None:
    data = STL.replace(b"\n", b" ")

    divided = read_asset("a.stl", data).divided(HALVES)

    assert len(read_asset("a.stl", divided).faces) == 2
    assert divided.count(b"solid a part") == 2
    assert divided.count(b"facet normal 0 0 1 outer loop vertex ") == 2


def test_a_solid_may_be_called_by_words_of_the_format() -> None:
    data = STL.replace(b"a part", b"outer facet normal map vertex")

    assert read_asset("a.stl", data).faces.tolist() == [[0, 1, 2]]


@pytest.mark.parametrize("above", [b"; made by a program\n", b"// part 7\n\n", b""])
def test_an_ascii_stl_may_begin_with_remarks_or_with_its_facets(above: bytes) -> None:
    asset = read_asset("a.stl", above + FACET)

    assert asset.faces.tolist() == [[0, 1, 2]]
    assert stretched(above + FACET) == above + FACET.replace(b"0 2 0", b"0 3 0")
    assert read_asset("a.stl", above + STL).faces.tolist() == [[0, 1, 2]]


def test_a_text_that_is_no_stl_is_refused_in_words() -> None:
    with pytest.raises(InputError, match="expected 'solid' or 'facet' at the beginning"):
        read_asset("a.stl", b"once upon a time " * 20)


def test_facets_without_a_solid_that_are_cut_short_are_refused() -> None:
    with pytest.raises(InputError, match="the end of the file"):
        read_asset("a.stl", FACET.replace(b"endfacet\n", b""))


OFF_NUMBERS = (b"4 2 0", b"0 0 0", b"1 0 0", b"1 1 0", b"0 1 0", b"3 0 1 2", b"3 0 2 3")


@pytest.mark.parametrize(
    "text",
    [
        b"OFF " + b" ".join(OFF_NUMBERS),
        b"OFF\n4\n2\n0\n" + b"\n".join(OFF_NUMBERS[1:]),
        b"OFF\n4 2\n0\n" + b"\n".join(OFF_NUMBERS[1:]),
        b"OFF\n4 2 0\n0 0 0 1 0 0\n1 1 0 0 1 0\n3 0 1 2 3 0 2 3\n",
    ],
)
def test_an_off_may_be_divided_into_lines_in_any_way(text: bytes) -> None:
    asset = read_asset("a.off", text)

    assert asset.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    assert asset.faces.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert len(asset.content().draws) == 1
    with pytest.raises(InputError, match="does not have a line for each vertex"):
        asset.ensure_writable()


def test_an_off_with_a_word_too_many_is_refused() -> None:
    with pytest.raises(InputError, match="expected"):
        read_asset("a.off", b"OFF " + b" ".join([*OFF_NUMBERS, b"7"]))
