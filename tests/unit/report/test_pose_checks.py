"""A source that is its reference turned, moved, mirrored or in other units, and no other."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from meshcone.report.pose_checks import Pose, find_pose, unit_factor
from meshcone.surface import Frame, Mesh, SurfaceTree
from meshcone.surface.motion import MotionSearch
from meshcone.surface.similarity import transform_points
from tests import shapes

X, Y, Z = np.eye(3)
# A square and a small triangle upon it.
DECAL = Mesh(
    np.array(
        [
            *([0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]),
            *([1.5, 1.5, 0], [2.5, 1.6, 0], [1.5, 1.9, 0]),
        ]
    ),
    np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6]]),
)


def lump(seed: int, subdivisions: int = 3) -> Mesh:
    """A body with four bumps, unlike those of other seeds, away from the origin."""
    vertices, faces = shapes.sphere(subdivisions, 1.0)
    directions = np.random.default_rng(seed).normal(size=(4, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    bumps = np.exp(-4 * np.linalg.norm(vertices[:, None] - directions, axis=2) ** 2).sum(axis=1)
    swollen = vertices * (1 + 0.4 * bumps)[:, None]
    return Mesh(swollen * [1.5, 1, 0.7] + [0.3, 0.2, 1], faces)


def solid(made: trimesh.Trimesh) -> Mesh:
    return Mesh(np.asarray(made.vertices, dtype=float), np.asarray(made.faces, dtype=np.int64))


LUMP = lump(1)
SYMMETRIC = {
    "sphere": Mesh(*shapes.sphere(3, 1.0)),
    "box": solid(trimesh.creation.box((1, 1, 1))),
    "slab": solid(trimesh.creation.box((3, 2, 1))),
    "cylinder": solid(trimesh.creation.cylinder(0.5, 3)),
    "torus": solid(trimesh.creation.torus(1, 0.3)),
    "square": Mesh(
        np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]]), np.array([[0, 1, 2], [0, 2, 3]])
    ),
    "plane": Mesh(
        np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0.0]]), np.array([[0, 1, 2], [0, 2, 3]])
    ),
}

# An L, which no turn but over agrees with its mirror image.
CORNERED = Mesh(
    np.array([[0, 0, 0], [3, 0, 0], [3, 1, 0], [1, 1, 0], [1, 2, 0], [0, 2, 0.0]]),
    np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]]),
)


def turned(mesh: Mesh, axis: np.ndarray, degrees: float) -> Mesh:
    turn = Rotation.from_rotvec(np.radians(degrees) * axis).as_matrix()
    return mesh.moved_to(mesh.vertices @ turn.T)


def moved(mesh: Mesh, x: float) -> Mesh:
    return mesh.moved_to(mesh.vertices + x * X)


def pose_of(source: Mesh, reference: Mesh) -> Pose | None:
    frame = Frame.of(reference)
    here, there = (mesh.moved_to(frame.into(mesh.vertices)) for mesh in (source, reference))
    return find_pose(MotionSearch(here, there, SurfaceTree(here), SurfaceTree(there)), frame)


def said(source: Mesh, reference: Mesh) -> tuple[list[str], str]:
    pose = pose_of(source, reference)
    assert pose is not None
    [words] = {warning.words for warning in pose.warnings}
    return [warning.code for warning in pose.warnings], words


@pytest.mark.parametrize(
    ("source", "codes", "words"),
    [
        (turned(LUMP, X, 90), ["pose.turned"], "turned by 90° about X."),
        (turned(LUMP, Y, -90), ["pose.turned"], "turned by -90° about Y."),
        (turned(LUMP, Z, 180), ["pose.turned"], "turned by 180° about Z."),
        (turned(LUMP, Z, 30), ["pose.turned"], "turned by 30° about Z."),
        (moved(LUMP, 0.05), ["pose.moved"], "moved by (0.05, 0, 0)."),
        (LUMP.moved_to(LUMP.vertices * 100), ["units.factor_100"], ", 100 times the size."),
        (LUMP.moved_to(LUMP.vertices / 10), ["units.factor_10"], ", 1/10 of the size."),
        (LUMP.moved_to(LUMP.vertices * 1e3), ["units.factor_1000"], ", 1000 times the size."),
        (LUMP.moved_to(LUMP.vertices / 25.4), ["units.factor_25_4"], ", 1/25.4 of the size."),
        (LUMP.moved_to(LUMP.vertices * 1.5), ["pose.scaled"], ", 1.5 times the size."),
        (LUMP.moved_to(LUMP.vertices * [-1, 1, 1]), ["pose.mirrored"], "mirrored along X."),
        (
            turned(LUMP.moved_to(LUMP.vertices * 100), X, -90),
            ["units.factor_100", "pose.turned"],
            "100 times the size and turned by -90° about X.",
        ),
    ],
)
def test_a_motion_is_told_in_the_words_of_who_made_it(
    source: Mesh, codes: list[str], words: str
) -> None:
    found, sentence = said(source, LUMP)

    assert found == codes
    assert sentence.startswith("The source is the same shape as the reference, ")
    assert words in sentence


def test_a_shape_turned_about_its_own_centre_is_not_moved() -> None:
    centre = Frame.of(LUMP).centre
    about = turned(LUMP.moved_to(LUMP.vertices - centre), X, 90)

    codes, _ = said(about.moved_to(about.vertices + centre), LUMP)

    assert codes == ["pose.turned"]


def test_a_rough_copy_elsewhere_is_nearly_the_same_shape() -> None:
    rough = moved(LUMP.moved_to(shapes.noisy(LUMP.vertices, 0.01)), 4)

    codes, words = said(rough, LUMP)

    assert codes == ["pose.moved"]
    assert "nearly the same shape as the reference, moved by (4" in words


def test_another_tessellation_elsewhere_is_found() -> None:
    fine = turned(lump(1, subdivisions=4), Y, 90)

    codes, _ = said(fine, LUMP)

    assert codes == ["pose.turned"]


@pytest.mark.parametrize("name", SYMMETRIC)
def test_a_symmetric_shape_that_is_moved_is_neither_turned_nor_mirrored(name: str) -> None:
    shape = SYMMETRIC[name]

    codes, words = said(moved(shape, 5), shape)

    assert codes == ["pose.moved"]
    assert "moved by (5, 0, 0)" in words


@pytest.mark.parametrize("name", ["sphere", "box"])
def test_a_turn_that_a_shape_does_not_show_is_not_told(name: str) -> None:
    assert pose_of(turned(SYMMETRIC[name], X, 90), SYMMETRIC[name]) is None


@pytest.mark.parametrize(
    ("name", "axis", "degrees"),
    [
        ("square", "Y", 1),
        ("square", "X", 170),
        ("plane", "X", 3),
        ("plane", "Z", 3),
        ("plane", "X", 90),
        ("slab", "Y", 7),
        ("box", "Y", 7),
        ("cylinder", "X", 4),
        ("cylinder", "X", 60),
    ],
)
def test_of_the_turns_that_explain_a_symmetric_shape_the_plainest_is_told(
    name: str, axis: str, degrees: int
) -> None:
    shape = SYMMETRIC[name]

    codes, words = said(turned(shape, np.eye(3)["XYZ".index(axis)], degrees), shape)

    assert codes == ["pose.turned"]
    assert f", turned by {degrees}° about {axis}." in words


def test_a_sheet_is_not_turned_over_to_explain_a_tilt() -> None:
    square = SYMMETRIC["square"]

    pose = pose_of(turned(square, X, 5), square)

    assert pose is not None
    assert pose.to_reference[2, 2] > 0


def test_a_sheet_turned_over_is_no_tilted_one_whose_faces_are_turned() -> None:
    codes, words = said(turned(CORNERED, X, 180), CORNERED)

    assert codes == ["pose.turned"]
    assert ", turned by 180° about X." in words


def test_a_mirrored_sheet_that_kept_its_outside_is_not_turned_over() -> None:
    mirrored = Mesh(CORNERED.vertices * [-1, 1, 1], CORNERED.faces[:, ::-1])

    codes, words = said(mirrored, CORNERED)

    assert codes == ["pose.mirrored"]
    assert ", mirrored along X." in words


@pytest.mark.parametrize("height", [1e-12, 1e-15])
def test_a_triangle_that_is_a_line_but_for_rounding_is_looked_at_too(height: float) -> None:
    """A turn about the line moves none of its points, so that no step of a fit is determined."""
    thin = Mesh(np.array([[0, 0, 0], [1, 0, 0], [0.3, height, 0]]), np.array([[0, 1, 2]]))
    aslant = turned(thin, np.array([1, 2, 3]) / np.sqrt(14), 7)

    for source, reference in ((aslant, thin), (thin, aslant)):
        codes, _ = said(source, reference)

        assert "pose.turned" in codes


@pytest.mark.parametrize("seed", range(6))
def test_what_is_told_is_so(seed: int) -> None:
    rng = np.random.default_rng(seed)
    reference = lump(seed)
    turn = Rotation.random(rng=rng).as_matrix() * 10 ** rng.uniform(-3, 3)
    source = reference.moved_to(reference.vertices @ turn.T + rng.normal(size=3))

    pose = pose_of(source, reference)

    frame = Frame.of(reference)
    assert pose is not None
    back = frame.out_of(transform_points(pose.to_reference, frame.into(source.vertices)))
    assert np.abs(back - reference.vertices).max() < 1e-3 * frame.radius


@pytest.mark.parametrize(("one", "other"), list(itertools.combinations(range(5), 2)))
def test_different_shapes_are_not_the_same_after_any_motion(one: int, other: int) -> None:
    elsewhere = turned(lump(one), X, 90)

    assert pose_of(elsewhere, lump(other)) is None
    assert pose_of(lump(one), lump(other)) is None


@pytest.mark.parametrize(("one", "other"), list(itertools.permutations(SYMMETRIC, 2)))
def test_different_symmetric_shapes_are_not_the_same_either(one: str, other: str) -> None:
    assert pose_of(SYMMETRIC[one], SYMMETRIC[other]) is None


@pytest.mark.parametrize("noise", [0.0, 1e-5, 0.005, 0.02, 0.05])
def test_a_noisy_copy_in_its_place_is_not_moved(noise: float) -> None:
    for seed in range(3):
        rough = LUMP.moved_to(shapes.noisy(LUMP.vertices, noise, seed=seed))

        assert pose_of(rough, LUMP) is None


@pytest.mark.parametrize("seed", range(10))
def test_noise_on_a_few_flat_faces_is_not_taken_for_a_motion(seed: int) -> None:
    """A shift and a tilt bring the faces together, but not their corners."""
    rough = DECAL.moved_to(shapes.noisy(DECAL.vertices, 0.005, seed=seed))

    assert pose_of(rough, DECAL) is None


def test_a_small_move_of_a_few_flat_faces_is_told() -> None:
    codes, words = said(DECAL.moved_to(DECAL.vertices + 0.02 * Z), DECAL)

    assert codes == ["pose.moved"]
    assert "moved by (0, 0, 0.02)" in words


def test_half_of_a_shape_is_not_the_shape_moved() -> None:
    upper = LUMP.faces[LUMP.vertices[LUMP.faces].mean(axis=1)[:, 2] > 1]

    assert pose_of(Mesh(LUMP.vertices, upper), LUMP) is None


@pytest.mark.parametrize(
    ("ratio", "code"),
    [(100, "units.factor_100"), (0.001, "units.factor_1000"), (25.2, "units.factor_25_4")],
)
def test_a_ratio_of_sizes_that_a_unit_explains_has_its_code(ratio: float, code: str) -> None:
    assert unit_factor(ratio) == code


def test_another_ratio_is_no_unit() -> None:
    assert unit_factor(7.0) is None
