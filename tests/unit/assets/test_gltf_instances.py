"""Meshes that are placed many times: read as placed, moved once where that is one answer."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from meshcone.assets import Asset, Limits, WritePolicy, read_asset
from meshcone.errors import InputError, LimitError
from meshcone.notices import Code
from tests.unit.assets.builders import Gltf, chunks, compress, cube_gltf

AUTO = WritePolicy(instances="auto")
INSTANCING = "EXT_mesh_gpu_instancing"
PLACES = np.array([[0, 0, 0], [5, 0, 0], [0, 7, 0]], dtype=np.float32)
TURNS = np.array([[0, 0, 0, 1], [0, 0, 0.6, 0.8], [0.6, 0, 0, 0.8]], dtype=np.float32)
SIZES = np.array([[1, 1, 1], [2, 2, 2], [1, -1, 1]], dtype=np.float32)


def read(data: bytes, **limits: int) -> Asset:
    return read_asset("mesh.glb", data, limits=Limits(**limits))


def instanced(**node: Any) -> Gltf:
    """A cube at three places of one node, turned, scaled and mirrored."""
    gltf = cube_gltf(**node)
    attributes = {
        "TRANSLATION": gltf.accessor(PLACES),
        "ROTATION": gltf.accessor(TURNS),
        "SCALE": gltf.accessor(SIZES),
    }
    gltf.json["nodes"][0]["extensions"] = {INSTANCING: {"attributes": attributes}}
    gltf.json["extensionsUsed"] = gltf.json["extensionsRequired"] = [INSTANCING]
    return gltf


def spelt_out(**node: Any) -> Gltf:
    """The same as nodes below one."""
    gltf = cube_gltf(**node)
    del gltf.json["nodes"][0]["mesh"]
    gltf.json["nodes"][0]["children"] = [
        gltf.node(
            root=False,
            mesh=0,
            translation=place.tolist(),
            rotation=turn.tolist(),
            scale=size.tolist(),
        )
        for place, turn, size in zip(PLACES, TURNS, SIZES, strict=True)
    ]
    return gltf


def two_cubes() -> Gltf:
    gltf = cube_gltf(translation=[1, 2, 3])
    gltf.node(mesh=0, translation=[5, 0, 0], rotation=[0, 0.6, 0, 0.8], scale=[-1, 2, 1])
    return gltf


def alike(asset: Asset, gltf: Gltf, change: NDArray[Any]) -> NDArray[np.float64]:
    """Where every copy of the cube is after its eight corners changed in the same way."""
    corners = read(cube_gltf().glb())
    local = read(gltf.glb()).positions
    assert len(local) % 24 == 0
    moved = np.empty_like(asset.vertices)
    for start in range(0, len(local), 24):
        here, there = corners.positions, asset.positions[start : start + 24]
        homogeneous = np.column_stack([here, np.ones(24)])
        placed = np.linalg.lstsq(homogeneous, there, rcond=None)[0]
        shifted = np.column_stack([here + change[corners.weld], np.ones(24)])
        moved[asset.weld[start : start + 24]] = shifted @ placed
    return moved


CHANGE = np.random.default_rng(5).uniform(-0.1, 0.1, (8, 3))


def test_instances_are_read_where_they_are_placed() -> None:
    asset, nodes = read(instanced(scale=[1, 2, 1]).glb()), read(spelt_out(scale=[1, 2, 1]).glb())
    assert np.allclose(asset.positions, nodes.positions, rtol=0, atol=1e-12)
    assert np.array_equal(asset.triangles, nodes.triangles)
    assert asset.counts().meshes == 3
    assert asset.warnings == ()


def test_instances_count_against_the_limits() -> None:
    with pytest.raises(LimitError, match="meshes placed"):
        read(instanced().glb(), meshes=2)
    with pytest.raises(LimitError, match="vertices in the scene"):
        read(instanced().glb(), vertices=50)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"SCALE": 0}, "24 of SCALE for 3 instances"),
        ({"ROTATION": 6}, "ROTATION must be VEC4, found VEC3"),
        ({"TRANSLATION": 99}, "names accessor 99"),
    ],
)
def test_instances_that_are_malformed_are_refused(change: dict[str, int], message: str) -> None:
    gltf = instanced()
    gltf.json["nodes"][0]["extensions"][INSTANCING]["attributes"] |= change
    with pytest.raises(InputError, match=message):
        read(gltf.glb())


def test_an_instance_needs_a_finite_place() -> None:
    gltf = instanced()
    gltf.binary[-4:] = b"\0\0\xc0\x7f"
    with pytest.raises(InputError, match="finite numbers"):
        read(gltf.glb())


@pytest.mark.parametrize("make", [two_cubes, instanced, spelt_out])
def test_where_all_places_agree_the_mesh_is_moved_once(make: Any) -> None:
    gltf = make()
    asset = read(gltf.glb())
    target = alike(asset, gltf, CHANGE)

    written = asset.patched(target, AUTO)

    again = read(written)
    assert np.allclose(again.vertices, target, atol=1e-5)
    document, _ = chunks(written)
    assert len(document["meshes"]) == 1
    assert len(document["nodes"]) == len(gltf.json["nodes"])
    assert len(written) == pytest.approx(len(gltf.glb()), abs=200)
    assert [notice.code for notice in asset.changes(AUTO, again)] == [Code.WRITING_TOGETHER]


@pytest.mark.parametrize("make", [two_cubes, instanced, spelt_out])
def test_where_they_do_not_each_place_gets_a_mesh(make: Any) -> None:
    asset = read(make().glb())
    target = asset.vertices + np.random.default_rng(3).uniform(-0.1, 0.1, asset.vertices.shape)

    for policy in (AUTO, WritePolicy(instances="split")):
        again = read(asset.patched(target, policy))
        assert np.allclose(again.vertices, target, atol=1e-5)
        (notice,) = asset.changes(policy, again)
        assert notice.code == Code.WRITING_SPLIT


def test_instances_that_become_nodes_need_no_extension() -> None:
    asset = read(instanced().glb())
    target = asset.vertices * (1, 1.1, 1)
    target[0] += 0.1
    document, _ = chunks(asset.patched(target, AUTO))
    assert INSTANCING not in str(document)
    assert document["nodes"][0] == {"children": [1, 2, 3]}


def test_a_place_that_does_not_move_keeps_the_mesh_from_being_moved_at_once() -> None:
    gltf = two_cubes()
    gltf.json["scenes"].append({"nodes": [gltf.node(root=False, mesh=0)]})
    asset = read(gltf.glb())
    target = alike(asset, gltf, CHANGE)

    document, _ = chunks(asset.patched(target, AUTO))

    assert len(document["meshes"]) == 3
    assert document["nodes"][2]["mesh"] == 0


def test_instances_are_refused_where_asked_to() -> None:
    asset = read(instanced().glb())
    with pytest.raises(InputError, match=r"mesh 'Cube' is placed many times.*set instances=split"):
        asset.ensure_writable(WritePolicy(instances="refuse"))


def test_draco_can_be_kept_where_all_agree() -> None:
    gltf = two_cubes()
    asset = read(compress(two_cubes()).glb())
    policy = WritePolicy(instances="auto")
    again = read(asset.patched(alike(asset, gltf, CHANGE), policy))
    assert np.allclose(again.vertices, alike(asset, gltf, CHANGE), atol=1e-4)


def scattered(asset: Asset) -> NDArray[np.float64]:
    """Every vertex moved in a way of its own, so that no two places agree."""
    drift = np.random.default_rng(3).uniform(-0.1, 0.1, asset.vertices.shape)
    moved: NDArray[np.float64] = asset.vertices + drift
    return moved


def saying_more(what: str) -> Gltf:
    """Instances of which a file says more than where they are."""
    gltf = instanced()
    node = gltf.json["nodes"][0]
    extension = node["extensions"][INSTANCING]
    if what == "_FEATURE_ID_0":
        extension["attributes"][what] = gltf.accessor(np.arange(3, dtype=np.float32))
    elif what == "EXT_instance_features":
        node["extensions"][what] = {"featureIds": [{"featureCount": 3}]}
    elif what == "weights":
        target = {"node": 0, "path": "weights"}
        gltf.json["animations"] = [{"channels": [{"sampler": 0, "target": target}]}]
    elif what == "pointer":
        general = {"KHR_animation_pointer": {"pointer": "/nodes/0/weights"}}
        target = {"path": "pointer", "extensions": general}
        gltf.json["animations"] = [{"channels": [{"sampler": 0, "target": target}]}]
    else:
        extension[what] = {"by": "hand"}
    return gltf


MORE = ["_FEATURE_ID_0", "EXT_instance_features", "extras", "weights", "pointer"]


@pytest.mark.parametrize("what", MORE)
def test_what_is_said_of_instances_is_not_lost_with_them(what: str) -> None:
    asset = read(saying_more(what).glb())
    words = f"'{'weights' if what == 'pointer' else what}' is about the instances of node 0"
    with pytest.raises(InputError, match=words):
        asset.patched(scattered(asset), AUTO)
    with pytest.raises(InputError, match=words):
        asset.ensure_writable(WritePolicy(instances="split"))


@pytest.mark.parametrize("what", MORE)
def test_what_is_said_of_instances_stays_where_all_agree(what: str) -> None:
    gltf = saying_more(what)
    asset = read(gltf.glb())
    asset.ensure_writable(AUTO)

    document, _ = chunks(asset.patched(alike(asset, gltf, CHANGE), AUTO))

    assert document["nodes"] == gltf.json["nodes"]
    assert document.get("animations") == gltf.json.get("animations")


def skinned_instances() -> Gltf:
    gltf = instanced()
    attributes = gltf.json["meshes"][0]["primitives"][0]["attributes"]
    attributes["JOINTS_0"] = gltf.accessor(np.zeros((24, 4), np.uint8))
    attributes["WEIGHTS_0"] = gltf.accessor(np.tile(np.float32([1, 0, 0, 0]), (24, 1)))
    gltf.json["skins"] = [{"joints": [gltf.node()]}]
    gltf.json["nodes"][0]["skin"] = 0
    return gltf


def test_instances_of_a_skinned_mesh_stay_as_they_are_for_nobody_reads_them() -> None:
    gltf = skinned_instances()
    asset = read(gltf.glb())

    written = asset.patched(scattered(asset), AUTO)

    assert Code.SKIN_INSTANCES in [notice.code for notice in asset.warnings]
    assert read(written).vertices == pytest.approx(scattered(asset), abs=1e-6)
    assert chunks(written)[0]["nodes"] == gltf.json["nodes"]


@pytest.mark.filterwarnings("error")
def test_an_instance_beyond_all_numbers_is_refused_as_such() -> None:
    gltf = instanced(scale=[1e290] * 3)
    sizes = gltf.json["nodes"][0]["extensions"][INSTANCING]["attributes"]
    sizes["SCALE"] = gltf.accessor(np.full((3, 3), 1e38, dtype=np.float32))
    with pytest.raises(InputError, match="transform overflows") as refused:
        read(gltf.glb())
    assert refused.value.place == "/nodes/0"
