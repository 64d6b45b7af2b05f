"""Each family of an audit, against values known by other means."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
import pytest
import trimesh
from PIL import Image

from meshcone.assets import read_asset
from meshcone.auditing.asset import audit_asset
from meshcone.auditing.records import AssetAudit
from meshcone.files import MeshFile
from tests import shapes
from tests.whole_asset import SQUARE_FACES, Document, png, square, whole


def audit(document: Document) -> AssetAudit:
    data = document.to_bytes()
    return audit_asset(MeshFile("a.gltf", data), read_asset("a.gltf", data))


def audit_obj(data: bytes, **resources: bytes) -> AssetAudit:
    file = MeshFile("a.obj", data, resources)
    return audit_asset(file, read_asset("a.obj", data, resources))


def one_square(**changed: Any) -> Document:
    """A square with one textured material."""
    document = Document()
    arrays = {**square(), **changed}
    attributes = {name: document.accessor(values) for name, values in arrays.items()}
    indices = document.accessor(SQUARE_FACES.reshape(-1, 1))
    primitive = {"attributes": attributes, "indices": indices, "material": 0}
    document.json |= {
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
        "meshes": [{"primitives": [primitive]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}],
        "images": [{"bufferView": document.view(png((90, 90, 90), 16, 8))}],
    }
    return document


def test_a_budget_counts_what_is_drawn_and_what_is_listed() -> None:
    found = audit(whole()).budget

    assert (found.triangles, found.vertices, found.draw_calls) == (4, 8, 2)
    assert (found.nodes, found.depth, found.meshes, found.materials) == (3, 2, 1, 2)
    assert (found.images, found.textures, found.animations, found.skins, found.joints) == (
        *(2, 2, 1, 1),
        1,
    )
    # 8·8 and 4·4 texels of four bytes, and a third of that in mip levels.
    assert found.gpu_texture_bytes == round((64 + 16) * 4 * 4 / 3)
    # Positions, normals and coordinates of 8 vertices, joints and weights of 4, 12 indices.
    assert found.gpu_geometry_bytes == 8 * (12 + 12 + 8) + 4 * (4 + 16) + 12 * 2
    assert found.extensions_used == ("KHR_materials_ior",)


def test_instances_are_counted_each_time() -> None:
    document = one_square()
    document.json["nodes"] = [{"mesh": 0}, {"mesh": 0, "translation": [5, 0, 0]}]
    document.json["scenes"] = [{"nodes": [0, 1]}]

    found = audit(document).budget

    assert (found.triangles, found.draw_calls) == (4, 2)
    assert found.gpu_geometry_bytes == 4 * 32 + 12


def test_an_obj_and_its_glb_have_the_same_counts() -> None:
    vertices, faces = shapes.sphere(2)

    of_obj = audit_obj(shapes.obj(vertices, faces)).budget
    glb = shapes.glb(vertices, faces)
    of_glb = audit_asset(MeshFile("a.glb", glb), read_asset("a.glb", glb)).budget

    for name in ("triangles", "vertices", "draw_calls", "meshes", "gpu_texture_bytes"):
        assert getattr(of_obj, name) == getattr(of_glb, name), name


def test_size_and_volume_are_those_that_trimesh_finds() -> None:
    box = trimesh.creation.box(extents=(1, 2, 3))
    box.apply_translation((4, 1, 0))

    found = audit_obj(box.export(file_type="obj").encode())

    assert (found.size.width, found.size.height, found.size.depth) == pytest.approx((1, 2, 3))
    assert found.geometry.volume == pytest.approx(box.volume)
    assert found.geometry.area == pytest.approx(box.area)
    assert (found.size.origin_centred, found.size.origin_on_floor) == (False, True)
    assert (found.geometry.hard_edges, found.geometry.sharp_edges) == (12, 12)


def test_a_root_that_moves_is_not_clean() -> None:
    assert not audit(whole()).size.clean_root
    assert audit(one_square()).size.clean_root


def test_pieces_that_face_inwards_are_told_from_cavities() -> None:
    outer, inner, beside = (trimesh.creation.icosphere(2, radius) for radius in (2, 1, 1))
    inner.invert()
    beside.invert()
    beside.apply_translation((9, 0, 0))

    hollow = audit_obj((outer + inner).export(file_type="obj").encode()).geometry
    wrong = audit_obj((outer + beside).export(file_type="obj").encode()).geometry

    assert hollow.inside_out_share == 0
    assert hollow.volume == pytest.approx(outer.volume + inner.volume)
    assert wrong.inside_out_share == pytest.approx(beside.area / (outer.area + beside.area))
    assert (wrong.pieces, wrong.closed_pieces) == (2, 2)


def test_debris_slivers_and_unused_vertices_are_counted() -> None:
    data = (
        b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 5 5\n"
        b"v 2 0 0\nv 2.001 0 0\nv 2 0.001 0\nv 3 0 0\nv 4 0 0\nv 3.5 0.001 0\n"
        b"f 1 2 3\nf 5 6 7\nf 8 9 10\n"
    )

    found = audit_obj(data).geometry

    assert (found.pieces, found.debris, found.slivers, found.isolated_vertices) == (3, 1, 1, 1)


def test_a_vertex_on_the_edge_of_its_neighbour_is_a_t_junction() -> None:
    # The long lower triangle meets two upper ones, whose common corner is on its edge.
    data = b"v 0 0 0\nv 2 0 0\nv 1 -1 0\nv 1 0 0\nv 0 1 0\nv 2 1 0\nf 1 3 2\nf 1 4 5\nf 4 2 6\n"

    assert audit_obj(data).geometry.t_junctions == 1


def test_faces_that_the_weld_drops_count_as_degenerate() -> None:
    data = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 1 2\n"

    assert audit_obj(data).geometry.degenerate_faces == 1


def test_a_square_that_fills_its_texture_leaves_nothing_and_overlaps_nothing() -> None:
    found = audit(one_square()).uv

    assert (found.overlap_share, found.unused_share, found.inverted_share) == (0, 0, 0)
    # 16 by 8 texels over 2 by 2 units.
    assert found.texel_density_min == pytest.approx((16 * 8 / 4) ** 0.5)
    assert (found.outside, found.tiles, found.missing) == (0, False, 0)


def test_coordinates_that_are_wrong_are_counted() -> None:
    folded = square()["TEXCOORD_0"].copy()
    folded[3] = folded[1]  # the second triangle lies on the first
    gone = square()["TEXCOORD_0"].copy()
    gone[0] = np.nan
    flat = square()["TEXCOORD_0"] * np.array([1, 0], dtype="<f4")
    tiled = square()["TEXCOORD_0"] * np.float32(3)

    assert audit(one_square(TEXCOORD_0=folded)).uv.overlap_share == pytest.approx(1, abs=0.01)
    assert audit(one_square(TEXCOORD_0=folded)).uv.inverted_share == pytest.approx(0.5)
    assert audit(one_square(TEXCOORD_0=gone)).uv.not_finite == 2
    assert audit(one_square(TEXCOORD_0=flat)).uv.degenerate == 2
    assert audit(one_square(TEXCOORD_0=tiled)).uv.tiles
    assert audit(one_square(TEXCOORD_0=tiled)).uv.outside == 2


def test_a_material_with_a_texture_and_no_coordinates_lacks_them() -> None:
    document = one_square()
    del document.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"]

    assert audit(document).uv.missing == 2


@pytest.mark.parametrize("scale", [1e30, -1e30])
def test_coordinates_far_away_end_in_bounded_work(scale: float) -> None:
    far = square()["TEXCOORD_0"] * np.float32(scale)

    found = audit(one_square(TEXCOORD_0=far)).uv

    assert found.overlap_share is None
    assert found.outside == 2


def test_normals_against_the_winding_and_broken_ones_are_counted() -> None:
    normals = square()["NORMAL"].copy()
    normals[0], normals[1], normals[2] = (0, 0, -1), (0, 0, 0), (0, 0, 3)

    found = audit(one_square(NORMAL=normals)).shading

    # Corner 0 and 2 are of both triangles.
    assert (found.corners, found.opposed_normals, found.zero_normals) == (6, 2, 1)
    assert found.not_unit_normals == 2


def test_normals_of_mirroring_and_squeezing_nodes_are_turned_as_viewers_do() -> None:
    vertices, faces = shapes.sphere(2)
    ball = trimesh.Trimesh(vertices, faces)
    data = ball.export(file_type="glb", include_normals=True)
    document = trimesh.util.wrap_as_stream(data)
    scene = trimesh.load_scene(document, file_type="glb")
    squeeze = np.diag([-1.0, 0.1, 2.0, 1.0])
    scene.apply_transform(squeeze)
    moved = scene.export(file_type="glb")

    found = audit_asset(MeshFile("a.glb", moved), read_asset("a.glb", moved)).shading

    assert found.corners == 3 * len(faces)
    assert (found.opposed_normals, found.zero_normals) == (0, 0)


def test_images_are_what_pillow_says_they_are() -> None:
    out = io.BytesIO()
    ramp = np.tile(np.arange(256, dtype=np.uint8), (4, 1))
    Image.fromarray(ramp).convert("RGB").save(out, "PNG")
    document = one_square()
    document.json["images"] = [
        {"bufferView": document.view(out.getvalue())},
        {"bufferView": document.view(out.getvalue())},
        {"uri": "not-sent.png"},
        {"bufferView": document.view(b"no picture at all")},
    ]

    found = audit(document).textures
    first = found.images[0]

    assert (first.width, first.height, first.format, first.power_of_two) == (256, 4, "png", True)
    assert first.luminance_mean == pytest.approx(ramp.mean(), abs=0.5)
    assert (first.luminance_p1, first.luminance_p99) == pytest.approx((2, 253), abs=1)
    assert (found.count, found.missing, found.unreadable) == (4, 1, 1)
    assert (found.duplicates, found.not_square, found.unused) == (1, 2, 3)


def test_an_image_that_is_colour_and_data_at_once_is_told() -> None:
    document = one_square()
    document.json["materials"][0]["normalTexture"] = {"index": 0}

    assert audit(document).textures.wrong_color_space == 1
    assert audit(whole()).textures.wrong_color_space == 0


def test_an_image_that_lies_about_its_size_is_not_decoded() -> None:
    data = bytearray(png((1, 2, 3)))
    data[16:24] = (60_000).to_bytes(4, "big") * 2  # width and height in the header
    document = one_square()
    document.json["images"] = [{"bufferView": document.view(bytes(data))}]

    found = audit(document).textures

    assert found.images[0].luminance_mean is None
    assert found.not_tested + found.unreadable == 1


def test_alpha_that_an_opaque_material_ignores_is_told() -> None:
    document = one_square()
    document.json["images"] = [{"bufferView": document.view(png((1, 2, 3, 9)))}]

    assert audit(document).textures.unused_alpha == 1


def two_squares_of(first: bytes, second: bytes, **material: Any) -> Document:
    """A square with two materials, each of which has a base colour of its own."""
    document = one_square()
    document.json["images"] = [{"bufferView": document.view(data)} for data in (first, second)]
    document.json["textures"] = [{"source": 0}, {"source": 1}]
    document.json["materials"] = [
        {"pbrMetallicRoughness": {"baseColorTexture": {"index": number}}, **material}
        for number in (0, 1)
    ]
    return document


def test_the_darkest_base_colour_is_open_where_one_of_them_cannot_be_decoded() -> None:
    black, grey = png((0, 0, 0), 64, 64), png((90, 90, 90))

    both = audit(two_squares_of(grey, black)).textures
    cut = audit(two_squares_of(grey, black[:-30])).textures

    assert (both.base_color_luminance_min, both.base_color_luminance_max) == (0, 90)
    assert cut.images[0].luminance_p1 == 90
    assert (cut.base_color_luminance_min, cut.base_color_luminance_max) == (None, None)


def test_an_image_for_something_else_does_not_keep_luminance_open() -> None:
    document = two_squares_of(png((90, 90, 90)), b"no picture at all")
    document.json["materials"][1] = {"occlusionTexture": {"index": 1}}

    assert audit(document).textures.base_color_luminance_min == 90


def test_alpha_that_may_be_ignored_is_open_where_an_image_cannot_be_decoded() -> None:
    whole_one, cut = png((1, 2, 3)), png((1, 2, 3, 9), 64, 64)[:-30]

    assert audit(two_squares_of(whole_one, cut)).textures.unused_alpha is None
    assert audit(two_squares_of(whole_one, cut, alphaMode="BLEND")).textures.unused_alpha == 0


def test_a_normal_map_that_cannot_be_decoded_may_hold_anything() -> None:
    document = two_squares_of(png((90, 90, 90)), png((9, 9, 9), 64, 64)[:-30])
    assert audit(document).textures.wrong_color_space == 0

    document.json["materials"][1] = {"normalTexture": {"index": 1}}
    assert audit(document).textures.wrong_color_space is None


def test_materials_are_listed_with_what_is_wrong() -> None:
    document = whole()
    document.json["materials"] += [{"name": "twin"}, {"name": "twin"}]
    del document.json["meshes"][0]["primitives"][0]["material"]

    found = audit(document).materials

    assert found.names == ("painted", "glass", "twin", "twin")
    assert (found.unused, found.duplicates, found.same_names) == (3, 1, 1)
    assert (found.without_material, found.blended, found.double_sided) == (2, 1, 1)


def test_materials_of_an_obj_that_nobody_defines_are_told() -> None:
    data = b"mtllib gone.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n"

    found = audit_obj(data).materials

    assert (found.undefined, found.missing_libraries) == (1, 1)


def test_weights_and_joints_that_no_pose_can_use_are_counted() -> None:
    weights = np.array([[1, 0, 0, 0], [0.5, 0, 0, 0], [0, 0, 0, 0], [np.nan, 0, 0, 0]], "<f4")
    joints = np.array([[3, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0]], "|u1")
    document = one_square(WEIGHTS_0=weights, JOINTS_0=joints)
    document.json["nodes"] = [{"mesh": 0, "skin": 0}, {}]
    document.json["skins"] = [{"joints": [1]}]

    found = audit(document).motion

    # Corners 0 and 2 are of both triangles.
    assert (found.skinned_corners, found.joints_out_of_range) == (6, 2)
    assert (found.weights_not_normalised, found.weights_not_finite, found.unweighted) == (3, 1, 3)


def test_animations_are_listed_with_their_durations() -> None:
    document = whole()
    document.json["animations"].append({"name": "empty", "samplers": [], "channels": []})

    found = audit(document).motion

    assert [(each.name, each.duration, each.keys) for each in found.animations] == [
        ("swing", 1.25, 3),
        ("empty", 0.0, 0),
    ]
    assert (found.longest, found.empty_animations) == (1.25, 1)


def test_ten_thousand_materials_and_fifty_thousand_nodes_are_looked_at() -> None:
    document = one_square()
    document.json["materials"] += [{"name": f"m{number}"} for number in range(10_000)]
    document.json["nodes"] += [{"name": f"n{number}"} for number in range(50_000)]

    found = audit(document)

    assert (found.budget.materials, found.budget.nodes) == (10_001, 50_001)
    assert found.materials.unused == 10_000


def islands(*lefts: float) -> bytes:
    """An OBJ of squares, each a strip of the texture from one of these places, as wide as 0.2."""
    lines = []
    for number, left in enumerate(lefts):
        for x, y in ((0, 0), (1, 0), (1, 1), (0, 1)):
            lines += [f"v {2 * number + x} {y} 0", f"vt {left + 0.2 * x} {0.1 + 0.8 * y}"]
        corners = " ".join(f"{4 * number + each}/{4 * number + each}" for each in (1, 2, 3, 4))
        lines.append(f"f {corners}")
    return "\n".join(lines).encode()


@pytest.mark.parametrize(
    ("lefts", "gutter"),
    [
        ((0.1, 0.3 + 10 / 1024), 10),
        ((0.1, 0.3 + 30 / 1024, 0.6), 30),
        ((0.1, 0.7), 64),
        ((0.1,), 64),
    ],
)
def test_a_gutter_lies_between_the_islands_that_are_closest(
    lefts: tuple[float, ...], gutter: int
) -> None:
    found = audit_obj(islands(*lefts)).uv.gutter

    assert found is not None
    assert abs(found - gutter) <= 1


def test_the_gutter_of_what_cannot_be_drawn_is_not_tested() -> None:
    tiled = square()["TEXCOORD_0"] * np.float32(1e6)

    assert audit(one_square(TEXCOORD_0=tiled)).uv.gutter is None
