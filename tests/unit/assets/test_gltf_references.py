"""What names a mesh by its number holds for the copies that splitting makes, or is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from meshcone.assets import Asset, Limits, WritePolicy, read_asset
from meshcone.errors import InputError, LimitError
from tests.unit.assets.builders import Gltf, chunks, cube_gltf

SPLIT = WritePolicy(instances="split")
AUTO = WritePolicy(instances="auto")
INSTANCING = "EXT_mesh_gpu_instancing"
POINTER = "KHR_animation_pointer"


def channel(pointer: str) -> dict[str, Any]:
    return {
        "sampler": 0,
        "target": {"path": "pointer", "extensions": {POINTER: {"pointer": pointer}}},
    }


def three_cubes() -> Gltf:
    """One mesh at three nodes."""
    gltf = cube_gltf()
    gltf.node(mesh=0, translation=[5, 0, 0])
    gltf.node(mesh=0, translation=[0, 5, 0])
    return gltf


def scattered(asset: Asset) -> NDArray[np.float64]:
    """Every vertex moved in a way of its own, so that no two places agree."""
    moved: NDArray[np.float64] = asset.vertices + np.random.default_rng(3).uniform(
        -0.1, 0.1, asset.vertices.shape
    )
    return moved


def shifted(asset: Asset) -> NDArray[np.float64]:
    """Every vertex moved alike, so that all places agree."""
    moved: NDArray[np.float64] = asset.vertices + 0.1
    return moved


def test_what_animations_move_of_a_mesh_they_move_of_its_copies() -> None:
    gltf = three_cubes()
    others = [channel("/nodes/0/weights"), channel("/meshes/10/weights")]
    gltf.json["animations"] = [{"channels": [channel("/meshes/0/weights"), *others]}]
    asset = read_asset("mesh.glb", gltf.glb())

    document, _ = chunks(asset.patched(scattered(asset), SPLIT))

    assert [node["mesh"] for node in document["nodes"]] == [0, 1, 2]
    assert document["animations"][0]["channels"] == [
        channel("/meshes/0/weights"),
        *others,
        channel("/meshes/1/weights"),
        channel("/meshes/2/weights"),
    ]


def test_channels_for_copies_count_against_the_limit_on_json() -> None:
    gltf = three_cubes()
    large = channel("/meshes/0/weights") | {"extras": "x" * 90_000}
    gltf.json["animations"] = [{"channels": [large]}]
    asset = read_asset("mesh.glb", gltf.glb(), limits=Limits(json_bytes=200_000))
    with pytest.raises(LimitError, match="JSON after copying"):
        asset.ensure_writable(SPLIT)


VRM = {
    "expression": {"blendShapeMaster": {"blendShapeGroups": [{"binds": [{"mesh": 0}]}]}},
    "first person": {"firstPerson": {"meshAnnotations": [{"mesh": 0, "firstPersonFlag": "Auto"}]}},
}
NAMING = [
    ("VRM", VRM["expression"], "/blendShapeMaster/blendShapeGroups/0/binds/0/mesh"),
    ("VRM", VRM["first person"], "/firstPerson/meshAnnotations/0/mesh"),
    ("KHR_interactivity", {"graphs": ["/meshes/0/weights/1"]}, "/graphs/0"),
    ("KHR_interactivity", {"graphs": ["/meshes/{mesh}/weights"]}, "/graphs/0"),
    ("OMI_physics_shape", {"shapes": [{"convex": {"mesh": 0}}]}, "/shapes/0/convex/mesh"),
    ("ACME_sets", {"sets": [{"meshes": [7, 0]}]}, "/sets/0/meshes/1"),
]


@pytest.mark.parametrize(("name", "said", "place"), NAMING)
def test_an_extension_that_names_a_mesh_is_not_left_behind(
    name: str, said: dict[str, Any], place: str
) -> None:
    gltf = three_cubes()
    gltf.json["extensions"] = {name: said}
    asset = read_asset("mesh.glb", gltf.glb())

    for refuse in (
        lambda: asset.ensure_writable(SPLIT),
        lambda: asset.patched(scattered(asset), AUTO),
    ):
        with pytest.raises(InputError, match=f"'{name}' names mesh 'Cube' by its num") as refused:
            refuse()
        assert refused.value.place == f"/extensions/{name}{place}"


@pytest.mark.parametrize(("name", "said", "place"), NAMING)
def test_an_extension_that_names_a_mesh_stays_true_where_all_nodes_agree(
    name: str,
    said: dict[str, Any],
    place: str,  # noqa: ARG001
) -> None:
    gltf = three_cubes()
    gltf.json["extensions"] = {name: said}
    asset = read_asset("mesh.glb", gltf.glb())
    asset.ensure_writable(AUTO)

    document, _ = chunks(asset.patched(shifted(asset), AUTO))

    assert len(document["meshes"]) == 1
    assert document["extensions"] == gltf.json["extensions"]


@pytest.mark.parametrize(
    "said", [{"binds": [{"mesh": 1}, {"mesh": -1}]}, {"mesh": "0"}, {"mesh": {}}, {"node": 0}]
)
def test_an_extension_that_names_another_mesh_is_in_nobodys_way(said: dict[str, Any]) -> None:
    gltf = three_cubes()
    gltf.json["extensions"] = {"VRM": said}
    gltf.json["extras"] = {"mesh": 0}
    asset = read_asset("mesh.glb", gltf.glb())
    document, _ = chunks(asset.patched(scattered(asset), AUTO))
    assert len(document["meshes"]) == 3


def instanced(turns: NDArray[Any], **accessor: Any) -> Gltf:
    """A cube at two places of one node."""
    gltf = cube_gltf()
    attributes = {
        "TRANSLATION": gltf.accessor(np.float32([[0, 0, 0], [5, 0, 0]])),
        "ROTATION": gltf.accessor(turns, **accessor),
    }
    gltf.json["nodes"][0]["extensions"] = {INSTANCING: {"attributes": attributes}}
    gltf.json["extensionsUsed"] = [INSTANCING]
    return gltf


UPRIGHT = np.float32([[0, 0, 0, 1]] * 2)


def test_rotations_of_instances_in_few_bits_are_of_length_1_in_their_nodes() -> None:
    gltf = instanced(np.int8([[63, 63, 63, 63], [90, 0, 0, 89]]), normalized=True)
    asset = read_asset("mesh.glb", gltf.glb())
    target = scattered(asset)

    written = asset.patched(target, SPLIT)

    document, _ = chunks(written)
    lengths = [np.linalg.norm(node["rotation"]) for node in document["nodes"][1:]]
    assert lengths == pytest.approx([1, 1], abs=1e-12)
    assert read_asset("mesh.glb", written).positions == pytest.approx(target[asset.weld], abs=1e-6)


@pytest.mark.parametrize(
    "said",
    [
        {"expressions": {"preset": {"aa": {"morphTargetBinds": [{"node": 0, "index": 0}]}}}},
        {"firstPerson": {"meshAnnotations": [{"node": 0, "type": "auto"}]}},
    ],
)
def test_what_vrm_says_of_the_mesh_of_a_node_is_not_lost_with_its_instances(
    said: dict[str, Any],
) -> None:
    gltf = instanced(UPRIGHT)
    gltf.json["extensions"] = {"VRMC_vrm": said}
    asset = read_asset("mesh.glb", gltf.glb())
    with pytest.raises(InputError, match="'VRMC_vrm' is about the instances of node 0"):
        asset.ensure_writable(SPLIT)


def test_animated_places_of_instances_are_not_lost_with_them() -> None:
    gltf = instanced(UPRIGHT)
    moved = channel(f"/nodes/0/extensions/{INSTANCING}/attributes/TRANSLATION")
    gltf.json["animations"] = [{"channels": [moved]}]
    asset = read_asset("mesh.glb", gltf.glb())
    with pytest.raises(InputError, match=f"'{INSTANCING}' is about the instances of node 0"):
        asset.ensure_writable(SPLIT)
