"""What files hold besides their surface."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.assets import read_asset
from meshcone.assets.content import Content
from tests import shapes
from tests.whole_asset import Document, png, whole

OBJ = b"""mtllib scene.mtl
mtllib missing.mtl
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
vt 0 0
vt 1 0
vt 1 1
vt 0 1
vn 0 0 1
o wall
usemtl brick
f 1/1/1 2/2/1 3/3/1
usemtl unheard of
f 1//1 3//1 4//1
"""
MTL = b"""# two materials
newmtl brick
Kd 0.5 1 0
d 0.25
map_Kd -s 2 2 -clamp on folder\\my brick.png
newmtl spare
Kd what ever no
"""


def content_of(document: Document) -> Content:
    return read_asset("a.gltf", document.to_bytes()).content()


@pytest.fixture(scope="module")
def content() -> Content:
    return content_of(whole())


def test_nodes_have_their_paths_and_depths(content: Content) -> None:
    assert [content.path(node) for node in range(3)] == ["root", "root/plain", "root/bone"]
    assert [node.depth for node in content.nodes] == [1, 2, 2]
    assert content.nodes[0].matrix[:3, 3].tolist() == [0, 1, 0]


def test_materials_have_their_factors_and_textures(content: Content) -> None:
    painted, glass = content.materials
    use = painted.texture("base_color")
    bumps = painted.texture("normal")

    assert (painted.roughness, glass.base_color) == (0.25, (0, 0, 1, 0.5))
    assert use is not None
    assert (use.image, use.wrap, use.nearest) == (0, ("clamp", "mirror"), True)
    assert bumps is not None
    assert (bumps.image, bumps.strength) == (1, 0.5)
    assert (glass.alpha_mode, glass.double_sided) == ("BLEND", True)
    assert glass.extensions == ("KHR_materials_ior",)


def test_images_have_their_bytes(content: Content) -> None:
    assert content.images[0].data == png((200, 100, 50))
    assert content.images[0].embedded


def test_animations_and_skins_name_their_nodes(content: Content) -> None:
    [swing], [rig] = content.animations, content.skins

    assert (swing.name, swing.duration) == ("swing", 1.25)
    assert [(each.node, each.path, each.keys) for each in swing.channels] == [(2, "translation", 3)]
    assert (rig.name, rig.joints) == ("rig", (2,))


def test_draws_have_the_attributes_of_their_corners(content: Content) -> None:
    first, second = content.draws

    assert first.rows.tolist() == [0, 1]
    assert (first.material, second.material) == (0, 1)
    assert set(second.attributes) == {"NORMAL", "TEXCOORD_0", "JOINTS_0", "WEIGHTS_0"}
    assert first.attributes["TEXCOORD_0"].at_corners()[0].tolist() == [[0, 1], [1, 1], [1, 0]]


def test_extras_are_known_by_their_place(content: Content) -> None:
    assert list(content.extras) == ["/nodes/2"]


@pytest.mark.parametrize(
    ("path", "value", "place"),
    [
        (("materials", 0, "alphaMode"), "GLOSSY", "/materials/0/alphaMode"),
        (("materials", 0, "normalTexture", "index"), 99, "/materials/0/normalTexture/index"),
        (("textures", 0, "source"), -1, "/textures/0/source"),
        (("images", 0, "bufferView"), 10_000, "/images/0/bufferView"),
        (("animations", 0, "channels", 0, "sampler"), 7, "/animations/0/channels/0/sampler"),
        (("skins", 0, "joints"), [5000], "/skins/0/joints/0"),
        (("textures",), {"not": "a list"}, "/textures"),
        (("cameras",), [3], "/cameras/0"),
    ],
)
def test_what_no_vertex_needs_is_told_and_read_as_absent(
    path: tuple[str | int, ...], value: object, place: str
) -> None:
    document = whole()
    holder = document.json
    for key in path[:-1]:
        holder = holder[key]  # type: ignore[index]
    holder[path[-1]] = value  # type: ignore[index]

    found = content_of(document)

    assert place in [fault.place for fault in found.faults]
    assert len(found.draws) == 2


@pytest.mark.parametrize("key", ["input", "output"])
def test_an_animation_without_keys_is_told_and_read_as_absent(key: str) -> None:
    document = whole()
    sampler = document.json["animations"][0]["samplers"][0]
    empty = document.json["accessors"][sampler[key]] | {"count": 0}
    document.json["accessors"].append(empty)
    sampler[key] = len(document.json["accessors"]) - 1

    found = content_of(document)

    place = f"/animations/0/samplers/0/{key}"
    assert [(fault.place, "has no values" in fault.words) for fault in found.faults] == [
        (place, True)
    ]
    assert found.animations[0].channels == ()


@pytest.mark.parametrize("times", [[0, 1, 0.5], [0, 1, 1], [-1, 0, 1]])
def test_an_animation_whose_times_do_not_rise_from_0_is_told_and_read_as_absent(
    times: list[float],
) -> None:
    document = whole()
    sampler = document.json["animations"][0]["samplers"][0]
    sampler["input"] = document.accessor(np.array(times, dtype="<f4")[:, None])

    found = content_of(document)

    assert [fault.place for fault in found.faults] == ["/animations/0/samplers/0/input"]
    assert found.animations[0].channels == ()


@pytest.mark.parametrize(
    ("key", "word", "place"),
    [("samplers", {"interpolation": "SMOOTH"}, "interpolation"), ("channels", {}, "target")],
)
def test_an_animation_of_unknown_words_is_told_and_read_as_absent(
    key: str, word: dict[str, str], place: str
) -> None:
    document = whole()
    [animation] = document.json["animations"]
    animation[key][0] |= word or {"target": {"node": 0, "path": "wobble"}}

    found = content_of(document)

    assert [fault.place for fault in found.faults] == [f"/animations/0/{key}/0/{place}"]
    assert found.animations[0].channels == ()


def test_a_cycle_of_unplaced_nodes_ends() -> None:
    document = whole()
    document.json["nodes"] += [{"children": [4]}, {"children": [3]}]

    assert [node.depth for node in content_of(document).nodes] == [1, 2, 2, 0, 0]


def test_an_obj_has_the_materials_of_its_libraries() -> None:
    resources = {"scene.mtl": MTL, "my brick.png": png((1, 2, 3))}

    content = read_asset("a.obj", OBJ, resources).content()

    brick, spare, _ = content.materials
    use = brick.texture("base_color")
    assert content.libraries == {"scene.mtl": True, "missing.mtl": False}
    assert [each.name for each in content.materials] == ["brick", "spare", "unheard of"]
    assert [each.defined for each in content.materials] == [True, True, False]
    assert brick.base_color == (pytest.approx(0.21404, abs=1e-5), 1, 0, 0.25)
    assert brick.alpha_mode == "BLEND"
    assert use is not None
    assert (use.scale, use.wrap) == ((2, 2), ("clamp", "clamp"))
    assert content.images[0].data == png((1, 2, 3))
    assert spare.base_color == (1, 1, 1, 1)
    assert [fault.place for fault in content.faults] == ["scene.mtl, statement 7"]


def test_the_draws_of_an_obj_are_its_objects_by_material() -> None:
    content = read_asset("a.obj", OBJ).content()

    first, second = content.draws
    assert [mesh.name for mesh in content.meshes] == ["wall"]
    assert (first.rows.tolist(), second.rows.tolist()) == ([0], [1])
    # Rows of a texture run downwards, as in glTF.
    assert first.attributes["TEXCOORD_0"].at_corners().tolist() == [[[0, 1], [1, 1], [1, 0]]]
    assert "TEXCOORD_0" not in second.attributes


def test_colours_after_coordinates_are_an_attribute() -> None:
    data = b"v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\nf 1 2 3\n"

    [draw] = read_asset("a.obj", data).content().draws

    assert draw.attributes["COLOR_0"].at_corners().tolist() == [np.eye(3).tolist()]


def test_a_format_without_parts_is_one_draw() -> None:
    vertices, faces = shapes.sphere(1)
    rows = "\n".join(f"{x} {y} {z}" for x, y, z in vertices)
    corners = "\n".join(f"3 {a} {b} {c}" for a, b, c in faces)
    data = f"OFF\n{len(vertices)} {len(faces)} 0\n{rows}\n{corners}\n".encode()

    [draw] = read_asset("a.off", data).content().draws

    assert len(draw.rows) == len(faces)


def test_content_is_read_once_as_long_as_somebody_has_it() -> None:
    asset = read_asset("a.obj", OBJ)

    content = asset.content()

    assert asset.content() is content
