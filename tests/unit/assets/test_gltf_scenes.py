"""Which scene of a glTF is read, and which level of detail."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from meshcone.assets import Asset, read_asset
from meshcone.assets.policy import ReadPolicy
from meshcone.errors import InputError
from meshcone.notices import Code
from meshcone.options import parse_options
from tests import shapes
from tests.unit.assets.builders import Gltf, cube_gltf, split_cube

CUBE = split_cube()[0]


def read(gltf: Gltf, **policy: Any) -> Asset:
    return read_asset("mesh.glb", gltf.glb(), policy=ReadPolicy(**policy))


def scaled_cubes(*sizes: float) -> Gltf:
    """Cubes of some sizes, each a mesh at a node of its own; the first has size 1."""
    gltf = cube_gltf()
    positions, _, triangles = split_cube()
    for size in sizes:
        attributes = {"POSITION": gltf.accessor(positions * np.float32(size))}
        indices = gltf.accessor(triangles.reshape(-1))
        mesh = gltf.mesh({"attributes": attributes, "indices": indices}, name=f"{size}")
        gltf.node(mesh=mesh, name=f"size {size}")
    return gltf


def scenes(*, default: int | None = None) -> Gltf:
    """Three cubes, of sizes 1, 2 and 3: the first scene has the first, and so on."""
    gltf = scaled_cubes(2, 3)
    gltf.json["scenes"] = [{"nodes": [0], "name": "One"}, {"nodes": [1]}, {"nodes": [2, 0]}]
    gltf.json["scenes"][2]["name"] = "Three"
    del gltf.json["scene"]
    if default is not None:
        gltf.json["scene"] = default
    return gltf


def levels() -> Gltf:
    """A cube at x = 10 with levels of sizes 2 and 3, and one of size 4 that has none."""
    gltf = scaled_cubes(2, 3, 4)
    gltf.json["nodes"][0]["extensions"] = {"MSFT_lod": {"ids": [1, 2]}}
    gltf.node(children=[0, 3], translation=[10, 0, 0])
    gltf.json["scenes"][0]["nodes"] = [4]
    return gltf


def width(asset: Asset) -> float:
    return float(np.ptp(asset.vertices[:, 0]) / np.ptp(CUBE[:, 0]))


@pytest.mark.parametrize(
    ("default", "scene", "faces", "size"),
    [
        (None, None, 12, 1),
        (1, None, 12, 2),
        (1, 0, 12, 1),
        (None, "Three", 24, 3),
        (None, 2, 24, 3),
        (None, "all", 36, 3),
    ],
)
def test_a_scene_is_read_by_name_by_number_or_with_all_others(
    default: int | None, scene: int | str | None, faces: int, size: float
) -> None:
    asset = read(scenes(default=default), scene=scene)

    assert asset.counts().faces == faces
    assert width(asset) == pytest.approx(size)


def test_other_scenes_are_warned_of_where_none_was_asked_for() -> None:
    [notice] = read(scenes()).warnings

    assert notice.code == Code.SCENES_OTHER
    assert notice.words.startswith("2 scenes, scene 1 the first, are not the default: not read")
    assert read(scenes(), scene="One").warnings == ()
    gltf = scenes()
    gltf.json["scenes"] = [{"nodes": [0, 1, 2]}, {"nodes": [1]}]
    assert read(gltf).warnings == ()


@pytest.mark.parametrize(
    ("scene", "words"),
    [
        ("Four", r"no scene 'Four'; it has 0: 'One', 1: '', 2: 'Three'"),
        (3, "no scene number 3"),
        ("Twice", "2 scenes are 'Twice'; choose by number"),
    ],
)
def test_a_scene_that_is_not_there_or_there_twice_is_refused(scene: int | str, words: str) -> None:
    gltf = scenes()
    if scene == "Twice":
        gltf.json["scenes"][0]["name"] = gltf.json["scenes"][1]["name"] = "Twice"

    with pytest.raises(InputError, match=words):
        read(gltf, scene=scene)


def test_only_what_is_in_the_scene_moves() -> None:
    gltf = scenes()
    asset = read(gltf, scene="Three")

    written = asset.patched(asset.vertices + 1)

    after = read_asset("mesh.glb", written, policy=ReadPolicy(scene="Three"))
    assert np.allclose(after.vertices, asset.vertices + 1)
    other = read_asset("mesh.glb", written, policy=ReadPolicy(scene=1))
    assert np.array_equal(other.vertices, read(gltf, scene=1).vertices)


@pytest.mark.parametrize(("lod", "sizes"), [(0, [1, 4]), (1, [2, 4]), (2, [3, 4])])
@pytest.mark.parametrize("in_tree", [False, True])
def test_a_level_stands_where_the_node_is_that_has_it(
    lod: int, sizes: list[float], in_tree: bool
) -> None:
    gltf = levels()
    if in_tree:
        gltf.json["nodes"][4]["children"] += [1, 2]

    asset = read(gltf, lod=lod)

    blocks = asset.positions.reshape(2, 24, 3)
    for block, size in zip(sorted(blocks, key=np.ptp), sizes, strict=True):
        assert np.allclose(np.sort(block, axis=0), np.sort(CUBE * size + [10, 0, 0], axis=0))


def test_a_level_that_moves_leaves_the_others_as_they_are() -> None:
    gltf = levels()
    asset = read(gltf, lod=1)

    written = asset.patched(asset.vertices * 1.5)

    def again(level: int) -> Asset:
        return read_asset("mesh.glb", written, policy=ReadPolicy(lod=level))

    assert np.allclose(again(1).vertices, asset.vertices * 1.5)
    before, after = read(gltf, lod=2).positions, again(2).positions
    assert np.array_equal(_smallest(after), _smallest(before))


def _smallest(positions: np.ndarray) -> np.ndarray:
    return min(positions.reshape(2, 24, 3), key=np.ptp)


def test_a_node_with_fewer_levels_shows_its_coarsest() -> None:
    gltf = levels()
    gltf.json["nodes"][3]["extensions"] = {"MSFT_lod": {"ids": [0]}}
    del gltf.json["nodes"][0]["extensions"]
    gltf.json["nodes"][1]["extensions"] = {"MSFT_lod": {"ids": [2, 5]}}
    gltf.node(mesh=0, name="tiny", scale=[0.5, 0.5, 0.5])
    gltf.json["scenes"][0]["nodes"] = [3, 1]

    asset = read(gltf, lod=2)

    assert sorted(np.ptp(block) / np.ptp(CUBE) for block in asset.positions.reshape(2, 24, 3)) == [
        pytest.approx(0.5),
        pytest.approx(1),
    ]


def test_a_level_that_no_node_has_is_refused() -> None:
    with pytest.raises(InputError, match="no node has a level 3; the file has levels 0 to 2"):
        read(levels(), lod=3)
    with pytest.raises(InputError, match="the file has one level alone"):
        read(cube_gltf(), lod=1)


@pytest.mark.parametrize("policy", [{"scene": 1}, {"lod": 1}, {"member": "a.obj"}])
def test_a_file_that_cannot_have_what_is_asked_for_is_refused(policy: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=f"option '{next(iter(policy))}'"):
        read_asset("a.obj", shapes.obj(*shapes.sphere(1)), policy=ReadPolicy(**policy))


def test_a_reference_shows_the_same_scene_if_it_has_it_and_its_finest_level() -> None:
    options = parse_options({"scene": "Three", "lod": 2, "member": "a.obj"})
    policy = ReadPolicy.of_reference(options)

    assert width(read_asset("", scenes(default=1).glb(), policy=policy)) == pytest.approx(3)
    assert width(read_asset("", cube_gltf().glb(), policy=policy)) == pytest.approx(1)
    assert len(read_asset("", shapes.obj(*shapes.sphere(0)), policy=policy).faces) == 8


def test_a_reference_can_be_told_to_show_another() -> None:
    options = parse_options({"scene": "Three", "of_reference": {"scene": 0, "lod": 1}})
    gltf = levels()
    gltf.json["scenes"][0]["name"] = "Three"
    gltf.json["scenes"].append({"nodes": [3]})

    assert ReadPolicy.of_reference(options).lod == 1
    assert read_asset("", gltf.glb(), policy=ReadPolicy.of_reference(options)).counts().faces == 24
