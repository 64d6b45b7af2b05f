"""Each family of an audit, against values known by other means."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from meshcone.assets import read_asset
from meshcone.auditing.asset import audit_asset
from meshcone.files import MeshFile
from meshcone.surface import Mesh
from tests import shapes
from tests.meshes import closed_by_thin_faces
from tests.unit.auditing.squares import audit, audit_obj, one_square
from tests.whole_asset import SQUARE_FACES, square, whole


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


def test_what_primitives_share_is_counted_once() -> None:
    document = one_square()
    [whole_one] = document.json["meshes"][0]["primitives"]
    halves = [document.accessor(corners.reshape(-1, 1)) for corners in SQUARE_FACES]
    document.json["meshes"][0]["primitives"] = [{**whole_one, "indices": half} for half in halves]

    found = audit(document).budget

    assert (found.vertices, found.draw_calls) == (4, 2)
    # Positions, normals and coordinates of 4 vertices, and 6 indices.
    assert found.gpu_geometry_bytes == 4 * (12 + 12 + 8) + 6 * 2


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


def test_edges_that_faces_without_area_close_count_as_those_of_the_surface() -> None:
    box = trimesh.creation.box(extents=(1, 2, 3))
    closed = closed_by_thin_faces(Mesh(np.asarray(box.vertices), np.asarray(box.faces)))

    found = audit_obj(shapes.obj(closed.vertices, closed.faces)).geometry

    assert found.degenerate_faces == np.count_nonzero(closed.face_areas == 0) > 0
    assert (found.hard_edges, found.sharp_edges) == (12, 12)


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


def volume_of(*solids: trimesh.Trimesh) -> float | None:
    whole = trimesh.util.concatenate(solids)
    return audit_obj(whole.export(file_type="obj").encode()).geometry.volume


def inside_out(solid: trimesh.Trimesh) -> trimesh.Trimesh:
    turned = solid.copy()
    turned.invert()
    return turned


def test_a_piece_that_faces_inwards_encloses_what_it_encloses() -> None:
    box = trimesh.creation.box()
    beside = box.copy()
    beside.apply_translation((5, 0, 0))

    assert volume_of(inside_out(box)) == pytest.approx(1)
    assert volume_of(box, inside_out(beside)) == pytest.approx(2)


def test_a_cavity_is_taken_out_of_a_solid_that_is_inside_out_as_a_whole() -> None:
    solid, cavity = trimesh.creation.box((2, 2, 2)), trimesh.creation.box()

    assert volume_of(solid, inside_out(cavity)) == pytest.approx(7)
    assert volume_of(inside_out(solid), cavity) == pytest.approx(7)


def test_what_lies_in_a_cavity_is_solid() -> None:
    solid, cavity, ball = (trimesh.creation.box((size,) * 3) for size in (3, 2, 1))

    assert volume_of(solid, inside_out(cavity), ball) == pytest.approx(27 - 8 + 1)


def test_what_lies_in_the_hole_of_a_ring_is_no_cavity() -> None:
    ring = trimesh.creation.torus(major_radius=2, minor_radius=0.4)
    ball = trimesh.creation.icosphere(1, 0.3)
    ball.invert()

    beside = audit_obj((ring + ball).export(file_type="obj").encode()).geometry
    ball.apply_translation((2, 0, 0))
    within = audit_obj((ring + ball).export(file_type="obj").encode()).geometry
    ball.apply_translation((0.3, 0, 0))
    through = audit_obj((ring + ball).export(file_type="obj").encode()).geometry

    share = ball.area / (ring.area + ball.area)
    assert beside.inside_out_share == pytest.approx(share)
    assert within.inside_out_share == 0
    assert through.inside_out_share == pytest.approx(share)


def test_a_cavity_of_any_of_many_solids_is_one() -> None:
    solids = []
    for number in range(1100):
        for size in (1.0, -0.5):
            box = trimesh.creation.box((abs(size),) * 3)
            if size < 0:
                box.invert()
            box.apply_translation((2.0 * number, 0, 0))
            solids.append(box)
    whole = trimesh.util.concatenate(solids)

    found = audit_obj(whole.export(file_type="obj").encode()).geometry

    assert (found.pieces, found.inside_out_share) == (2200, 0)


def test_debris_slivers_and_unused_vertices_are_counted() -> None:
    data = (
        b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 5 5\n"
        b"v 2 0 0\nv 2.001 0 0\nv 2 0.001 0\nv 3 0 0\nv 4 0 0\nv 3.5 0.001 0\n"
        b"f 1 2 3\nf 5 6 7\nf 8 9 10\n"
    )

    found = audit_obj(data).geometry

    assert (found.pieces, found.debris, found.slivers, found.isolated_vertices) == (3, 1, 1, 1)


def test_an_unused_vertex_of_a_mesh_at_two_nodes_is_one_of_the_file() -> None:
    unused = {name: np.concatenate([values, values[:1]]) for name, values in square().items()}
    document = one_square(**unused)
    document.json["nodes"] = [{"mesh": 0}, {"mesh": 0, "translation": [5, 0, 0]}]
    document.json["scenes"] = [{"nodes": [0, 1]}]

    assert audit(document).geometry.isolated_vertices == 1


def test_a_vertex_on_the_edge_of_its_neighbour_is_a_t_junction() -> None:
    # The long lower triangle meets two upper ones, whose common corner is on its edge.
    data = b"v 0 0 0\nv 2 0 0\nv 1 -1 0\nv 1 0 0\nv 0 1 0\nv 2 1 0\nf 1 3 2\nf 1 4 5\nf 4 2 6\n"

    assert audit_obj(data).geometry.t_junctions == 1


def test_faces_that_the_weld_drops_count_as_degenerate() -> None:
    data = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 1 2\n"

    assert audit_obj(data).geometry.degenerate_faces == 1


def test_normals_against_the_winding_and_broken_ones_are_counted() -> None:
    normals = square()["NORMAL"].copy()
    normals[0], normals[1], normals[2] = (0, 0, -1), (0, 0, 0), (0, 0, 3)

    found = audit(one_square(NORMAL=normals)).shading

    # Corner 0 and 2 are of both triangles.
    assert (found.corners, found.opposed_normals, found.zero_normals) == (6, 2, 1)
    assert found.not_unit_normals == 2


def test_normals_that_are_no_numbers_are_there_and_wrong() -> None:
    found = audit(one_square(NORMAL=np.full((4, 3), np.nan, dtype="<f4"))).shading

    assert (found.corners, found.zero_normals, found.without_normals) == (6, 6, 0)


def test_corners_of_an_obj_without_a_normal_have_none() -> None:
    found = audit_obj(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1\nf 1 3 2\n").shading

    assert (found.corners, found.zero_normals, found.without_normals) == (6, 0, 3)


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


def test_a_channel_to_a_node_that_is_not_there_has_no_target() -> None:
    document = whole()
    document.json["animations"][0]["channels"][0]["target"]["node"] = 44

    assert audit(document).motion.channels_without_target == 1


def test_ten_thousand_materials_and_fifty_thousand_nodes_are_looked_at() -> None:
    document = one_square()
    document.json["materials"] += [{"name": f"m{number}"} for number in range(10_000)]
    document.json["nodes"] += [{"name": f"n{number}"} for number in range(50_000)]

    found = audit(document)

    assert (found.budget.materials, found.budget.nodes) == (10_001, 50_001)
    assert found.materials.unused == 10_000
