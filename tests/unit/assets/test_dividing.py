"""Files whose faces are divided: what every format has in common."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.assets import read_asset
from meshcone.errors import InputError
from meshcone.surface import Subdivision

TRIANGLE = b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
HALVES = np.array([[[2, 0, 0], [1, 1, 0], [0, 0, 2]], [[1, 1, 0], [0, 2, 0], [0, 0, 2]]])


def test_a_file_of_which_no_face_is_divided_is_returned_as_it_is():
    assert read_asset("a.off", TRIANGLE).divided(Subdivision.none(1)) == TRIANGLE


def test_a_file_that_cannot_be_written_is_refused_by_its_name():
    halves = Subdivision(1, np.array([0, 0]), HALVES, 1)
    lists = (
        b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
        b"property float z\nproperty list int int more\nelement face 1\n"
        b"property list int int vertex_indices\nend_header\n"
        b"0 0 0 0\n1 0 0 0\n0 1 0 0\n3 0 1 2\n"
    )
    with pytest.raises(InputError, match="lists stand among the vertices") as refused:
        read_asset("a.ply", lists).divided(halves)
    assert refused.value.file == "a.ply"


@pytest.mark.parametrize(
    "other", [Subdivision.none(2), Subdivision(1, np.array([0]), HALVES[:1], 1)]
)
def test_what_is_no_tiling_of_the_file_s_faces_is_an_error(other):
    with pytest.raises(ValueError, match="does not tile"):
        read_asset("a.off", TRIANGLE).divided(other)
