"""An upper bound from a record of leaves, a lower one from a point: with no search at all."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from meshcone.errors import InputError
from meshcone.quality.deviation.check import check_leaves
from meshcone.quality.deviation.leaves import WEIGHT_PARTS, Leaves, halves
from meshcone.surface import Mesh
from tests.unit.quality.deviation.soups import KINDS, distances, scattered, soup

TRIANGLE = Mesh(np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]]))


def lifted(height: float) -> Mesh:
    return TRIANGLE.moved_to(TRIANGLE.vertices + np.array([0, 0, height]))


def leaves(
    faces: int,
    cuts: list[tuple[int, int, float]] | None = None,
    bounds: list[dict[int, int]] | None = None,
) -> Leaves:
    """A record in which every leaf is bounded by face 0 unless said otherwise."""
    cuts = cuts or []
    bounds = bounds or [{0: WEIGHT_PARTS}] * (faces + len(cuts))
    return Leaves(
        cut=np.array([cut for cut, _, _ in cuts], dtype=np.int64),
        edge=np.array([edge for _, edge, _ in cuts], dtype=np.int64),
        at=np.array([at for _, _, at in cuts], dtype=float),
        count=np.array([len(bound) for bound in bounds]),
        faces=np.array([face for bound in bounds for face in bound]),
        weights=np.array([weight for bound in bounds for weight in bound.values()]),
    )


def random_leaves(seed: int, faces: int, reference_faces: int, cuts: int) -> Leaves:
    random = np.random.default_rng(seed)
    parted: list[int] = []
    for number in range(cuts):  # ascending, and of a piece there is
        low = parted[-1] + 1 if parted else 0
        if low < faces + 2 * number:
            parted.append(int(random.integers(low, faces + 2 * number)))
    bounds = []
    for _ in range(faces + len(parted)):
        named = random.permutation(reference_faces)[: random.integers(1, 5)]
        shares = random.multinomial(WEIGHT_PARTS, random.dirichlet(np.ones(len(named))))
        bounds.append(dict(zip(named.tolist(), shares.tolist(), strict=True)))
    edges = random.integers(3, size=len(parted)).tolist()
    places = random.random(len(parted)).tolist()
    return leaves(faces, list(zip(parted, edges, places, strict=True)), bounds)


@settings(max_examples=60, deadline=None)
@given(
    st.integers(0, 10_000),
    st.sampled_from(KINDS),
    st.sampled_from(KINDS),
    st.integers(1, 6),
    st.integers(0, 12),
)
def test_whatever_a_record_names_no_point_lies_beyond_its_bound(
    seed: int, kind: str, other: str, faces: int, cuts: int
) -> None:
    mesh, reference = soup(seed, faces, kind), soup(seed + 1, 5, other)
    bound = check_leaves(mesh, reference, random_leaves(seed, faces, 5, cuts))
    found = distances(scattered(mesh, 300), reference).max()
    assert found <= bound * (1 + 1e-9)


def test_one_face_over_another_is_bounded_by_the_height() -> None:
    bound = check_leaves(lifted(0.25), TRIANGLE, leaves(1))
    assert 0.25 <= bound <= 0.25 + 1e-12


def test_a_mesh_on_itself_is_bounded_by_nothing_at_all() -> None:
    assert check_leaves(TRIANGLE, TRIANGLE, leaves(1)) == 0


def test_cutting_brings_the_bound_down_to_the_true_distance() -> None:
    """Over a ridge of two faces, no one of them bounds the whole of a face."""
    flat = Mesh(np.array([[-1.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]]))
    sides = Mesh(
        np.array([[-1.0, 0, 1], [0, 0, 0], [0, 1, 0], [1, 0, 1]]),
        np.array([[0, 1, 2], [1, 3, 2]]),
    )
    whole = check_leaves(flat, sides, leaves(1))
    one_each: list[dict[int, int]] = [{0: WEIGHT_PARTS}, {1: WEIGHT_PARTS}]
    parted = check_leaves(flat, sides, leaves(1, [(0, 0, 0.5)], one_each))
    true = distances(scattered(flat, 5000), sides).max()
    assert parted < whole
    assert true <= parted <= true + 1e-9


def test_the_mixed_distance_is_the_one_of_exact_arithmetic() -> None:
    """Two parallel faces at heights 0 and 4: mixed in parts of 1/4, their distances are exact."""
    reference = Mesh(
        np.concatenate([TRIANGLE.vertices, TRIANGLE.vertices + np.array([0, 0, 4])]),
        np.array([[0, 1, 2], [3, 4, 5]]),
    )
    mixed = {0: WEIGHT_PARTS // 4, 1: 3 * WEIGHT_PARTS // 4}
    heights = [Fraction(1), Fraction(3)]
    expected = Fraction(1, 4) * heights[0] + Fraction(3, 4) * heights[1]
    bound = check_leaves(lifted(1.0), reference, leaves(1, None, [mixed]))
    assert Fraction(0) <= Fraction(bound) - expected <= Fraction(1, 10**11)


def test_halves_tile_what_was_cut() -> None:
    corners = soup(3, 4, "general").corners
    parts = halves(corners, np.array([0, 1, 2, 0]), np.array([0.25, 0.5, 0.9, 1.0]))
    areas = [np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1)
             for p in (corners, parts)]  # fmt: skip
    np.testing.assert_allclose(areas[1].reshape(-1, 2).sum(axis=1), areas[0], rtol=1e-12)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"cut": [0, 0]}, "do not tile"),
        ({"cut": [1, 0]}, "do not tile"),
        ({"cut": [0, 9]}, "do not tile"),
        ({"cut": [-1, 0]}, "do not tile"),
        ({"cut": [1, -(2**63) + 1]}, "do not tile"),
        ({"cut": [-(2**63), 2**63 - 1]}, "do not tile"),
        ({"edge": [0, 3]}, "do not tile"),
        ({"edge": [0]}, "not whole"),
        ({"at": [0.5, 1.5]}, "do not tile"),
        ({"at": [0.5, np.nan]}, "do not tile"),
        ({"count": [1, 1, 1]}, "has no bound"),
        ({"count": [1, 1, 1, 0]}, "has no bound"),
        ({"count": [1, 1, 1, 5]}, "has no bound"),
        ({"faces": [0, 0, 0, 1]}, "does not have"),
        ({"faces": [0, 0, 0, -1]}, "does not have"),
        ({"faces": [0, 0, 0]}, "not whole"),
        ({"weights": [WEIGHT_PARTS] * 3 + [0]}, "add up to 1"),
        ({"weights": [WEIGHT_PARTS] * 3 + [-1]}, "between 0 and 1"),
        ({"weights": [WEIGHT_PARTS] * 3 + [2 * WEIGHT_PARTS]}, "between 0 and 1"),
        ({"weights": [WEIGHT_PARTS] * 3 + [2**62]}, "between 0 and 1"),
    ],
)
def test_a_record_that_is_not_one_is_refused(change: dict[str, list[float]], words: str) -> None:
    mesh = soup(1, 2, "general")
    sound = leaves(2, [(0, 0, 0.5), (1, 1, 0.5)])
    check_leaves(mesh, TRIANGLE, sound)
    (name, values), = change.items()  # fmt: skip
    with pytest.raises(InputError, match=words):
        check_leaves(mesh, TRIANGLE, replace(sound, **{name: np.array(values)}))


def test_leaves_of_another_mesh_are_refused() -> None:
    with pytest.raises(InputError, match="do not tile"):
        check_leaves(soup(1, 3, "general"), TRIANGLE, leaves(2))


def test_more_cuts_than_rounding_is_bounded_for_are_refused() -> None:
    deep = leaves(1, [(0, 0, 0.5)] + [(1 + 2 * turn, 0, 0.5) for turn in range(250)])
    with pytest.raises(InputError, match="cut more than 200 times"):
        check_leaves(TRIANGLE, TRIANGLE, deep)


def test_a_record_comes_back_from_its_arrays() -> None:
    sound = random_leaves(5, 4, 5, 6)
    again = Leaves.of_arrays(sound.arrays())
    for name in ("cut", "edge", "at", "count", "faces", "weights"):
        np.testing.assert_array_equal(getattr(again, name), getattr(sound, name))


def test_arrays_that_are_no_record_are_refused() -> None:
    arrays = random_leaves(5, 4, 5, 6).arrays()
    with pytest.raises(InputError, match="'faces'"):
        Leaves.of_arrays({**arrays, "faces": arrays["faces"].astype(float)})
    with pytest.raises(InputError, match="'at'"):
        Leaves.of_arrays({name: arrays[name] for name in arrays if name != "at"})


@pytest.mark.parametrize("hole", ["faces", "vertices"])
def test_a_mesh_that_cannot_be_measured_is_refused(hole: str) -> None:
    if hole == "faces":
        broken = Mesh(TRIANGLE.vertices, np.empty((0, 3), dtype=np.int64))
        words = "no faces"
    else:
        broken = TRIANGLE.moved_to(np.full((3, 3), np.nan))
        words = "not finite"
    with pytest.raises(InputError, match=words):
        check_leaves(TRIANGLE, broken, leaves(1))
