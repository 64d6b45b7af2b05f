"""What vertices have besides places, in two files that differ in that."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from meshcone.assets import read_asset
from meshcone.auditing.asset import audit_asset
from meshcone.auditing.changes import changes_between
from meshcone.auditing.records.changes import Changes
from meshcone.files import MeshFile
from meshcone.srgb import to_linear
from tests import meshes
from tests.unit.auditing.damaged import asset_of, counted
from tests.whole_asset import Document

PLY = (
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    "property float z\n{}element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0 {}\n1 0 0 {}\n0 1 0 {}\n3 0 1 2\n"
)


def triangle(**columns: float) -> bytes:
    """A PLY whose three vertices have the same of each column."""
    named = "".join(f"property float {name}\n" for name in columns)
    return PLY.format(named, *[" ".join(map(str, columns.values()))] * 3).encode()


def between_files(name: str, first: bytes, second: bytes) -> Changes:
    return changes_between(read_asset(name, first), read_asset(name, second))


@pytest.mark.parametrize(
    ("columns", "what"),
    [
        ({"red": 1.0, "green": 0.5, "blue": 0.0}, "color_sets"),
        ({"nx": 0.0, "ny": 0.0, "nz": 1.0}, "attributes"),
        ({"s": 0.5, "t": 0.5}, "uv_sets"),
        ({"quality": 3.0}, "attributes"),
    ],
)
def test_what_vertices_of_a_ply_had_is_lost(columns: dict[str, float], what: str) -> None:
    changes = between_files("a.ply", triangle(**columns), triangle())

    assert counted(changes) == {f"lost.{what}": 1}


def test_colours_of_an_off_are_lost() -> None:
    coloured = b"COFF\n3 1 0\n0 0 0 1 0 0 1\n1 0 0 1 0 0 1\n0 1 0 1 0 0 1\n3 0 1 2\n"
    plain = b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"

    assert counted(between_files("a.off", coloured, plain)) == {"lost.color_sets": 1}


def test_an_audit_of_a_ply_counts_what_its_vertices_have() -> None:
    data = triangle(nx=0, ny=0, nz=-1, s=0, t=0, red=1, green=1, blue=1)

    audit = audit_asset(MeshFile("a.ply", data), read_asset("a.ply", data))

    assert (audit.shading.without_normals, audit.shading.opposed_normals) == (0, 3)
    assert (audit.uv.sets, audit.budget.uv_sets, audit.budget.color_sets) == (1, 1, 1)


Values = NDArray[np.float64]
Damage = Callable[[Values], Values]
TILT = np.array([[0.64, -0.77, 0.0], [0.77, 0.64, 0.0], [0.0, 0.0, 1.0]])  # by 50 degrees


def ball(
    level: int = 3,
    noise: float = 0.0,
    order: tuple[int, int] = (0, 1),
    node: dict[str, Any] | None = None,
    **damaged: Damage,
) -> Document:
    """A ball that has everything at its vertices, some of it damaged.

    Args:
        level: how fine it is.
        noise: of its radius, by which its vertices are off.
        order: of its two morph targets, "fat" and "tall".
        node: members of its node.
        **damaged: what becomes of an attribute, or of ``target_0`` or ``target_1``.
    """
    mesh = meshes.sphere(level)
    shape = np.asarray(mesh.vertices, dtype=np.float64)
    radii = 1 + noise * np.random.default_rng(1).standard_normal((len(shape), 1))
    around = np.cross([0.0, 1.0, 0.0], shape)
    around[:, 0] += 1e-6  # its direction at the poles
    right = np.ones((len(shape), 1))
    found: dict[str, Values] = {
        "POSITION": shape * radii,
        "NORMAL": shape,
        "TANGENT": np.hstack([around / np.linalg.norm(around, axis=1, keepdims=True), right]),
        "TEXCOORD_0": np.hstack([np.abs(shape[:, :1]), 0.5 + shape[:, 1:2] / 2]),
        "COLOR_0": to_linear(np.hstack([0.5 + shape / 2, right]) * [1, 1, 1, 0.8]),
        "_HEIGHT": shape[:, 1:2] + 5,
        "target_0": 0.1 * shape,
        "target_1": shape * [0, 0.2, 0],
    }
    for name, damage in damaged.items():
        found[name] = damage(found[name])
    document = Document()
    stored = {name: document.accessor(values.astype("<f4")) for name, values in found.items()}
    targets = [{"POSITION": stored.pop(f"target_{number}")} for number in (0, 1)]
    primitive = {
        "attributes": stored,
        "indices": document.accessor(np.asarray(mesh.faces, dtype="<u2").reshape(-1, 1)),
        "targets": [targets[number] for number in order],
    }
    document.json |= {
        "nodes": [{"mesh": 0, **(node or {})}],
        "scenes": [{"nodes": [0]}],
        "meshes": [
            {"name": "ball", "primitives": [primitive], "extras": {"targetNames": ["fat", "tall"]}}
        ],
    }
    return document


def against_the_ball(other: Document) -> dict[str, int]:
    return counted(changes_between(asset_of(ball()), asset_of(other)))


@pytest.mark.parametrize(
    ("other", "what"),
    [
        (ball(NORMAL=lambda n: -n), "attributes"),
        (ball(NORMAL=lambda n: n @ TILT), "attributes"),
        (ball(NORMAL=lambda n: np.sign(n[:, 1:2] + 1e-9) * [0, 1, 0]), "attributes"),
        (ball(TANGENT=lambda t: t * [1, 1, 1, -1]), "attributes"),
        (ball(TANGENT=lambda t: t * [-1, -1, -1, 1]), "attributes"),
        (ball(_HEIGHT=lambda h: 10 - h), "attributes"),
        (ball(COLOR_0=lambda c: np.hstack([1 - c[:, :3], c[:, 3:]])), "color_sets"),
        (ball(COLOR_0=lambda c: c * [1, 1, 1, 0.5]), "color_sets"),
        (ball(TEXCOORD_0=lambda uv: uv * [1, -1] + [0, 1]), "uv_sets"),
        (ball(target_0=lambda moved: 0 * moved), "morph_targets"),
        (ball(target_0=lambda moved: 2 * moved), "morph_targets"),
    ],
)
def test_other_values_alter_what_has_them(other: Document, what: str) -> None:
    assert against_the_ball(other) == {f"altered.{what}": 1}


def test_morph_targets_that_change_places_are_altered() -> None:
    assert against_the_ball(ball(order=(1, 0))) == {"altered.morph_targets": 2}


def test_a_change_of_values_is_told_in_words() -> None:
    other = asset_of(ball(target_0=lambda moved: 2 * moved))
    [row] = changes_between(asset_of(ball()), other).rows

    assert row.words == "morph target 'ball: fat' has other values"
    assert str(row.reference).startswith("mean 0 0 0, spread 0.1, along x, y, z 0.033")


def no_numbers(share: float) -> Damage:
    """Sets this share of the values to NaN."""

    def damage(values: Values) -> Values:
        damaged = values.copy()
        damaged[: round(share * len(values))] = np.nan
        return damaged

    return damage


@pytest.mark.parametrize("share", [1.0, 0.01])
@pytest.mark.parametrize(
    ("name", "what"),
    [
        ("NORMAL", "attributes"),
        ("COLOR_0", "color_sets"),
        ("TEXCOORD_0", "uv_sets"),
        ("_HEIGHT", "attributes"),
        ("target_0", "morph_targets"),
    ],
)
def test_values_that_became_no_numbers_are_other_values(name: str, what: str, share: float) -> None:
    assert against_the_ball(ball(**{name: no_numbers(share)})) == {f"altered.{what}": 1}


def test_values_that_never_were_numbers_are_no_other_values() -> None:
    one, other = (asset_of(ball(COLOR_0=no_numbers(share))) for share in (0.5, 0.5))

    assert counted(changes_between(one, other)) == {}


def test_a_repair_of_a_few_values_that_are_no_numbers_alters_nothing() -> None:
    damaged = asset_of(ball(NORMAL=no_numbers(0.01)))

    assert counted(changes_between(damaged, asset_of(ball()))) == {}


def test_a_morph_target_that_moves_normals_no_more_is_altered() -> None:
    one, other = ball(2), ball(2)
    shifts = one.accessor(0.1 * np.ones((len(meshes.sphere(2).vertices), 3), dtype="<f4"))
    one.json["meshes"][0]["primitives"][0]["targets"][0]["NORMAL"] = shifts

    assert counted(changes_between(asset_of(one), asset_of(other))) == {"altered.morph_targets": 1}


def painted(units: float, **transform: Any) -> Document:
    """The ball with a texture, its coordinates in some units."""
    document = ball(TEXCOORD_0=lambda values: values * units)
    texture = {"index": 0, "extensions": {"KHR_texture_transform": transform}}
    document.json |= {
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": texture}}],
        "textures": [{"source": 0}],
        "images": [{"uri": "a.png"}],
    }
    document.json["meshes"][0]["primitives"][0]["material"] = 0
    return document


def test_coordinates_in_other_units_that_a_transform_undoes_are_the_same() -> None:
    one, other = painted(1), painted(100, scale=[0.01, 0.01])

    assert changes_between(asset_of(one), asset_of(other)).altered.uv_sets == 0
    assert changes_between(asset_of(one), asset_of(painted(100))).altered.uv_sets == 1


def test_the_same_coordinates_under_another_transform_are_the_same() -> None:
    one, other = painted(1), painted(1, scale=[3, 3])

    assert changes_between(asset_of(one), asset_of(other)).altered.uv_sets == 0


@pytest.mark.parametrize("level", [1, 2, 4])
def test_a_coarser_or_finer_mesh_has_the_same_values(level: int) -> None:
    assert against_the_ball(ball(level)) == {}


def test_normals_that_follow_a_noisy_surface_are_no_other_normals() -> None:
    assert against_the_ball(ball(noise=0.02)) == {}


def test_values_are_compared_where_the_mesh_is_stored_too() -> None:
    """Positions in other units and a node that undoes that, as quantised files have them."""
    smaller = {name: lambda values: values / 4 for name in ("POSITION", "target_0", "target_1")}

    assert against_the_ball(ball(node={"scale": [4, 4, 4]}, **smaller)) == {}


def test_a_turned_node_turns_its_directions_with_it() -> None:
    half = {"node": {"rotation": [0, 1, 0, 0]}}
    turn = np.diag([-1.0, 1.0, -1.0])
    baked = {
        name: lambda values: np.hstack([values[:, :3] @ turn, values[:, 3:]])
        for name in ("POSITION", "NORMAL", "TANGENT", "target_0", "target_1")
    }

    changes = changes_between(asset_of(ball(**half)), asset_of(ball(**baked)))

    assert counted(changes) == {"moved.nodes": 1}
