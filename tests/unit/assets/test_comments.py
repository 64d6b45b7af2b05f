"""Comments of texts, and the number signs within what Microsoft printed for no number."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.assets import read_asset
from meshcone.assets.comments import uncommented
from meshcone.errors import InputError

WORDS = ["1.#IND", "-1.#INF00", "1.#QNAN", "1.#J", "+1.#R", "-1.#io"]


@pytest.mark.parametrize(
    ("line", "left"),
    [
        (b"v 1 2 3 # a", b"v 1 2 3 "),
        (b"v 1 2 1.#", b"v 1 2 1."),
        (b"v 1 2 1.# end", b"v 1 2 1."),
        (b"v 1 2 1.#2", b"v 1 2 1."),
        (b"v 1 2 21.#end", b"v 1 2 21."),
        (b"v 1 2 3", b"v 1 2 3"),
    ],
)
def test_a_number_sign_starts_a_comment(line: bytes, left: bytes) -> None:
    assert uncommented(line) == left


@pytest.mark.parametrize("word", WORDS)
def test_it_starts_none_in_what_microsoft_printed_for_no_number(word: str) -> None:
    line = f"{word} 0 {word}".encode()

    assert uncommented(line + b" # a") == line + b" "


@pytest.mark.parametrize("word", WORDS)
@pytest.mark.parametrize("place", ["{} 0 1", "0 {} 1", "0 1 {}"])
def test_an_obj_with_such_a_coordinate_is_refused(word: str, place: str) -> None:
    data = f"v 0 0 0\nv 1 0 0\nv {place.format(word)}\nf 1 2 3\n".encode()

    with pytest.raises(InputError, match="expected a finite number") as refused:
        read_asset("a.obj", data)

    assert word in refused.value.message
    assert refused.value.place == "line 3"


@pytest.mark.parametrize("word", WORDS)
def test_an_stl_with_such_a_coordinate_is_refused(word: str) -> None:
    corners = f"vertex 0 0 0 vertex 1 0 0 vertex 0 1 {word}".replace(" vertex", "\nvertex")
    text = f"solid\nfacet normal 0 0 1\nouter loop\n{corners}\nendloop\nendfacet\nendsolid\n"

    with pytest.raises(InputError, match="expected a finite number"):
        read_asset("a.stl", text.encode())


@pytest.mark.parametrize("broken", ["1.#IND 0.5", "0.5 -1.#J"])
def test_such_texture_coordinates_are_no_numbers(broken: str) -> None:
    corners = f"v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt {broken}\nf 1/1 2/2 3/3\n"

    (draw,) = read_asset("a.obj", corners.encode()).content().draws

    [found] = draw.attributes["TEXCOORD_0"].at_corners(as_stored=True)
    assert np.isnan(found).any(axis=1).tolist() == [False, False, True]
