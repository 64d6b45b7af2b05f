"""Skins and morph targets are read as viewers show them at rest, and written back through that."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from meshcone.assets import Asset, Limits, WritePolicy, read_asset
from meshcone.assets.gltf import skins
from meshcone.assets.gltf.element import Element
from meshcone.assets.policy import PosePolicy, ReadPolicy
from meshcone.errors import InputError, LimitError
from tests.unit.assets.builders import Gltf, chunks, cube_gltf, split_cube, stored

RANDOM = np.random.default_rng(11)
QUARTER = [0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)]  # about z


def matrix(translation: Any = (0, 0, 0), scale: Any = (1, 1, 1), turned: bool = False) -> Any:
    """(4, 4) of translation @ quarter turn about z @ scale."""
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]) if turned else np.eye(3)
    found = np.eye(4)
    found[:3, :3] = turn * np.array(scale)
    found[:3, 3] = translation
    return found


def matrices(gltf: Gltf, values: NDArray[Any]) -> int:
    """An accessor of (j, 4, 4) matrices, stored by columns."""
    columns = values.transpose(0, 2, 1).astype(np.float32)
    view = gltf.view(columns.tobytes())
    declared = {"bufferView": view, "componentType": 5126, "count": len(values), "type": "MAT4"}
    gltf.json["accessors"].append(declared)
    return len(gltf.json["accessors"]) - 1


ARMATURE = matrix(scale=(0.01, 0.01, 0.01))
JOINTS = [matrix((10, 0, 0), turned=True), matrix((0, 20, 0), scale=(2, 1, 1))]
BINDS = np.stack([np.linalg.inv(matrix((3, 1, 2))), matrix((0, 0, 1), (1, 3, 1))])


def skinned(spread: float = 0.3) -> Gltf:
    """A cube under an armature of two joints, the second below the first; a node to be ignored.

    Args:
        spread: how differently the corners follow the joints, up to .5.
    """
    gltf = cube_gltf(translation=[50, 0, 0], skin=0)
    attributes = gltf.json["meshes"][0]["primitives"][0]["attributes"]
    corner = np.unique(split_cube()[0], axis=0, return_inverse=True)[1].reshape(-1)
    first = RANDOM.uniform(0.5 - spread, 0.5 + spread, 8).astype(np.float32)[corner]
    weights = np.column_stack([first, 1 - first, 0 * first, 0 * first]).astype(np.float32)
    joints = np.tile(np.array([[0, 1, 0, 0]], dtype=np.uint8), (24, 1))
    # Seams list their joints in another order, as exporters do.
    joints[12:, :2], weights[12:, :2] = joints[12:, 1::-1], weights[12:, 1::-1]
    attributes["JOINTS_0"] = gltf.accessor(joints)
    attributes["WEIGHTS_0"] = gltf.accessor(weights)
    gltf.json["skins"] = [{"joints": [2, 3], "inverseBindMatrices": matrices(gltf, BINDS)}]
    gltf.node(scale=[0.01, 0.01, 0.01], children=[2])
    gltf.node(root=False, translation=[10, 0, 0], rotation=QUARTER, children=[3])
    gltf.node(root=False, translation=[0, 20, 0], scale=[2, 1, 1])
    return gltf


def shown_at_rest(gltf: Gltf) -> NDArray[np.float64]:
    """(24, 3) by the text of section 3.7.3, vertex by vertex."""
    attributes = gltf.json["meshes"][0]["primitives"][0]["attributes"]
    worlds = [ARMATURE @ JOINTS[0], ARMATURE @ JOINTS[0] @ JOINTS[1]]
    positions, joints, weights = (
        stored(gltf, attributes[name]) for name in ("POSITION", "JOINTS_0", "WEIGHTS_0")
    )
    rows = []
    for point, four, shares in zip(positions, joints, weights, strict=True):
        blend = sum(w * worlds[j] @ BINDS[j] for j, w in zip(four, shares, strict=True))
        rows.append((blend @ np.append(point, 1))[:3])
    return np.array(rows)


def read(gltf: Gltf, pose: PosePolicy = "rest") -> Asset:
    return read_asset("mesh.glb", gltf.glb(), policy=ReadPolicy(pose))


def test_a_skinned_mesh_is_where_its_joints_show_it() -> None:
    gltf = skinned()
    asset = read(gltf)
    assert np.allclose(asset.positions, shown_at_rest(gltf), atol=1e-7)
    assert asset.counts().welded_vertices == 8
    assert asset.warnings == ()


def test_a_moved_vertex_goes_back_through_its_own_joints() -> None:
    gltf = skinned()
    asset = read(gltf)
    target = asset.vertices + RANDOM.normal(scale=0.02, size=(8, 3))

    written = asset.patched(target)

    assert np.allclose(read_asset("mesh.glb", written).vertices, target, atol=1e-6)
    before, after = chunks(gltf.glb()), chunks(written)
    changed = np.array([a != b for a, b in zip(before[1], after[1], strict=True)])
    # Positions and normals come first in the buffer; weights, joints and binds stay.
    assert changed[: 2 * 24 * 12].any()
    assert not changed[2 * 24 * 12 :].any()


def test_normals_are_stored_so_that_joints_turn_them_outwards() -> None:
    asset = read(skinned(spread=0.01))
    moved = asset.vertices * (1.0, 1.5, 0.7)

    again = read_asset("mesh.glb", asset.patched(moved))

    normals = again.content().draws[0].attributes["NORMAL"].at_corners()
    a, b, c = (again.positions[again.triangles[:, corner]] for corner in range(3))
    faces = np.cross(b - a, c - a)
    faces /= np.linalg.norm(faces, axis=1, keepdims=True)
    assert np.einsum("ijk,ik->ij", normals, faces).min() > 0.8


def test_vertices_without_weights_follow_their_first_joint() -> None:
    gltf = skinned()
    weights = gltf.json["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"]
    start = gltf.json["bufferViews"][gltf.json["accessors"][weights]["bufferView"]]["byteOffset"]
    gltf.binary[start : start + 16] = bytes(16)
    first = matrix(scale=(0.01, 0.01, 0.01)) @ JOINTS[0] @ BINDS[0]
    point = np.append(split_cube()[0][0], 1)
    assert np.allclose(read(gltf).positions[0], (first @ point)[:3])


def test_weights_need_not_add_up_to_one() -> None:
    gltf = skinned()
    expected = read(gltf).positions
    weights = gltf.json["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"]
    view = gltf.json["bufferViews"][gltf.json["accessors"][weights]["bufferView"]]
    start, end = view["byteOffset"], view["byteOffset"] + view["byteLength"]
    doubled = 2 * np.frombuffer(bytes(gltf.binary[start:end]), "<f4")
    gltf.binary[start:end] = doubled.astype("<f4").tobytes()
    assert np.allclose(read(gltf).positions, expected, atol=1e-6)


def test_weights_that_add_up_to_nothing_are_read_as_numbers() -> None:
    gltf = skinned()
    weights = gltf.json["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"]
    start = gltf.json["bufferViews"][gltf.json["accessors"][weights]["bufferView"]]["byteOffset"]
    gltf.binary[start : start + 16] = np.array([0.5, -0.5, 0, 0], dtype="<f4").tobytes()
    assert np.isfinite(read(gltf).positions).all()


def test_a_vertex_that_its_joints_flatten_cannot_be_moved() -> None:
    gltf = skinned()
    gltf.json["nodes"][2]["scale"] = [1, 1, 0]
    asset = read(gltf)
    with pytest.raises(InputError, match=r"vertex \d+ of mesh 'Cube' .* flatten .* pose=bind"):
        asset.ensure_writable(WritePolicy())


def test_joints_may_be_outside_of_the_scene() -> None:
    gltf = skinned()
    gltf.json["scenes"][0]["nodes"] = [0]
    assert np.allclose(read(gltf).positions, shown_at_rest(gltf), atol=1e-7)


def test_in_the_bind_pose_joints_are_passed_over() -> None:
    asset = read(skinned(), "bind")
    assert np.array_equal(asset.positions, split_cube()[0].astype(float))
    again = read_asset("mesh.glb", asset.patched(asset.vertices + 1), policy=ReadPolicy("bind"))
    assert np.allclose(again.vertices, asset.vertices + 1)


def morphed(weights: list[float], of: str = "mesh") -> tuple[Gltf, NDArray[Any]]:
    gltf = cube_gltf(scale=[2, 1, 1])
    added = RANDOM.normal(size=(2, 8, 3)).astype(np.float32)
    corner = np.unique(split_cube()[0], axis=0, return_inverse=True)[1].reshape(-1)
    targets = [{"POSITION": gltf.accessor(each[corner])} for each in added]
    gltf.json["meshes"][0]["primitives"][0]["targets"] = targets
    holder = gltf.json["meshes"][0] if of == "mesh" else gltf.json["nodes"][0]
    holder["weights"] = weights
    return gltf, added[:, corner]


@pytest.mark.parametrize("of", ["mesh", "node"])
def test_morph_targets_are_shown_by_their_default_weights(of: str) -> None:
    gltf, added = morphed([0.25, -0.5], of)
    expected = (split_cube()[0] + 0.25 * added[0] - 0.5 * added[1]) * (2, 1, 1)
    asset = read(gltf)
    assert np.allclose(asset.positions, expected, atol=1e-6)

    target = asset.vertices + RANDOM.normal(scale=0.05, size=asset.vertices.shape)
    again = read_asset("mesh.glb", asset.patched(target))
    assert np.allclose(again.vertices, target, atol=1e-6)


def test_targets_without_weight_add_nothing() -> None:
    gltf, _ = morphed([0.0, 0.0])
    assert np.array_equal(read(gltf).positions, read(cube_gltf(scale=[2, 1, 1])).positions)
    assert read(gltf).warnings == ()


def test_weights_of_no_target_add_nothing() -> None:
    gltf, added = morphed([0.25, -0.5, 7.0])
    expected = (split_cube()[0] + 0.25 * added[0] - 0.5 * added[1]) * (2, 1, 1)
    assert np.allclose(read(gltf).positions, expected, atol=1e-6)
    gltf.json["meshes"][0]["weights"] = [0.25]
    expected = (split_cube()[0] + 0.25 * added[0]) * (2, 1, 1)
    assert np.allclose(read(gltf).positions, expected, atol=1e-6)


def test_weights_are_read_once_for_all_primitives_and_nodes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    gltf, _ = morphed([0.25, -0.5])
    mesh = gltf.json["meshes"][0]
    mesh["primitives"] *= 5
    gltf.node(mesh=0, translation=[9, 0, 0])
    read_lists: list[str] = []
    numbers = Element.numbers

    def counted(element: Element, key: str, length: int) -> list[float] | None:
        read_lists.append(key)
        return numbers(element, key, length)

    monkeypatch.setattr(Element, "numbers", counted)
    assert len(read(gltf).faces) == 12 * 5 * 2
    assert read_lists.count("weights") == 1


def outside(levels: int) -> Gltf:
    """The skinned cube, its joints below a chain of nodes that is in no scene."""
    gltf = skinned()
    gltf.json["scenes"][0]["nodes"] = [0]
    first = len(gltf.json["nodes"])
    for number in range(levels):
        below = first + number + 1 if number < levels - 1 else 1
        gltf.node(root=False, children=[below])
    return gltf


def test_joints_outside_of_the_scene_share_what_is_above_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    gltf = outside(levels=50)
    gltf.json["skins"][0]["joints"] = [2, 3] * 20
    gltf.json["skins"][0]["inverseBindMatrices"] = matrices(gltf, np.tile(BINDS, (20, 1, 1)))
    composed: list[str] = []
    local_matrix = skins.local_matrix

    def counted(node: Element) -> NDArray[np.float64]:
        composed.append(node.pointer)
        return local_matrix(node)

    monkeypatch.setattr(skins, "local_matrix", counted)
    assert np.allclose(read(gltf).positions, shown_at_rest(gltf), atol=1e-7)
    assert len(composed) == len(set(composed)) == 53


@pytest.mark.parametrize("cycle", [False, True])
def test_joints_below_too_many_nodes_are_refused(cycle: bool) -> None:
    gltf = outside(levels=300)
    if cycle:
        gltf.json["nodes"][3]["children"] = [4]
    with pytest.raises(LimitError, match="257 levels of nodes"):
        read(gltf)


@pytest.mark.parametrize("binds", ["matrices", "identities"])
def test_joints_of_all_skins_count_together(binds: str) -> None:
    gltf = skinned()
    skin: dict[str, Any] = {"joints": [2, 3] * 400}
    if binds == "matrices":
        skin["inverseBindMatrices"] = matrices(gltf, np.tile(BINDS, (400, 1, 1)))
    gltf.json["skins"] = [skin, skin]
    gltf.node(mesh=0, skin=1)
    with pytest.raises(LimitError, match="1,600 joints of skins, or matrices") as caught:
        read_asset("mesh.glb", gltf.glb(), limits=Limits(vertices=1_599))
    assert caught.value.place == "/skins/1"
    assert read_asset("mesh.glb", gltf.glb(), limits=Limits(vertices=1_600)).counts().faces == 24
