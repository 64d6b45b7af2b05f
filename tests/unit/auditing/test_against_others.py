"""Each family of an audit beside an independent computation on the same file."""

from __future__ import annotations

import io
import json
import struct
from collections import Counter
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from meshcone.assets import read_asset
from meshcone.auditing.asset import audit_asset
from meshcone.auditing.coverage import coverage
from meshcone.auditing.layout import layouts
from meshcone.auditing.records import AssetAudit
from meshcone.files import MeshFile
from tests import shapes
from tests.unit.auditing.squares import one_square
from tests.whole_asset import Document, whole


def audit(name: str, data: bytes) -> AssetAudit:
    return audit_asset(MeshFile(name, data), read_asset(name, data))


def audit_mesh(mesh: trimesh.Trimesh) -> AssetAudit:
    return audit("a.obj", shapes.obj(np.asarray(mesh.vertices), np.asarray(mesh.faces)))


def several() -> trimesh.Trimesh:
    """A box, an open cylinder, a ring, and a speck."""
    tube = trimesh.creation.cylinder(1.0, 3.0, sections=10, cap=True)
    tube.update_faces(np.abs(tube.face_normals[:, 2]) < 0.5)
    speck = trimesh.creation.icosphere(subdivisions=1, radius=0.005)
    placed = [
        trimesh.creation.box((1, 2, 3)),
        tube.apply_translation((5, 0, 0)),
        trimesh.creation.torus(2.0, 0.5).apply_translation((0, 8, 0)),
        speck.apply_translation((0, 0, 5)),
    ]
    joined = trimesh.util.concatenate(placed)
    joined.merge_vertices()
    return joined


def test_the_surface_is_counted_as_trimesh_counts_it() -> None:
    mesh = several()

    found = audit_mesh(mesh).geometry

    uses = Counter(map(tuple, np.sort(mesh.edges, axis=1).tolist()))
    pieces = mesh.split(only_watertight=False, repair=False)
    angles = np.degrees(mesh.face_adjacency_angles)
    assert found.boundary_edges == sum(count == 1 for count in uses.values())
    assert found.watertight == mesh.is_watertight
    assert found.pieces == mesh.body_count == len(pieces)
    assert found.closed_pieces == sum(piece.is_watertight for piece in pieces)
    assert found.hard_edges == np.count_nonzero(angles > 30)
    assert found.sharp_edges == np.count_nonzero(angles >= 89)
    assert found.debris == sum(piece.scale < 0.01 * mesh.scale for piece in pieces)
    assert found.area == pytest.approx(mesh.area, rel=1e-7)


def test_the_box_is_the_one_trimesh_finds() -> None:
    mesh = several()

    found = audit_mesh(mesh).size

    assert (found.width, found.height, found.depth) == pytest.approx(tuple(mesh.extents))
    assert [found.low, found.high] == [pytest.approx(tuple(row)) for row in mesh.bounds]
    assert found.diagonal == pytest.approx(mesh.scale)


def test_the_budget_is_what_the_json_of_the_file_adds_up_to() -> None:
    data = trimesh.Scene(
        {"a": trimesh.creation.box(), "b": trimesh.creation.icosphere(subdivisions=2)}
    ).export(file_type="glb")

    found = audit("a.glb", data).budget

    length = struct.unpack_from("<I", data, 12)[0]
    document: dict[str, Any] = json.loads(data[20 : 20 + length])
    placed = [node["mesh"] for node in document["nodes"] if "mesh" in node]
    primitives = [each for mesh in placed for each in document["meshes"][mesh]["primitives"]]
    counts = [document["accessors"][each["indices"]]["count"] // 3 for each in primitives]
    positions = [document["accessors"][each["attributes"]["POSITION"]] for each in primitives]
    assert found.triangles == sum(counts)
    assert found.vertices == sum(accessor["count"] for accessor in positions)
    assert found.draw_calls == len(primitives)
    assert (found.nodes, found.meshes) == (len(document["nodes"]), len(document["meshes"]))
    assert (found.file_bytes, found.total_bytes) == (len(data), len(data))
    assert found.buffer_bytes == sum(each["byteLength"] for each in document["buffers"])


def test_opposed_normals_are_those_that_point_to_the_back_of_their_triangle() -> None:
    mesh = trimesh.creation.icosphere(subdivisions=2)
    generator = np.random.default_rng(0)
    normals = generator.normal(size=mesh.vertices.shape)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in mesh.vertices.tolist()]
    lines += [f"vn {x!r} {y!r} {z!r}" for x, y, z in normals.tolist()]
    lines += [f"f {' '.join(f'{v}//{v}' for v in face)}" for face in (mesh.faces + 1).tolist()]

    found = audit("a.obj", "\n".join(lines).encode()).shading

    along = np.einsum("ijk,ik->ij", normals[mesh.faces], mesh.face_normals)
    assert found.corners == 3 * len(mesh.faces)
    assert found.opposed_normals == np.count_nonzero(along < 0)
    assert found.not_unit_normals == found.zero_normals == found.without_normals == 0


@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(-1.5, 2.5), min_size=6, max_size=24))
def test_a_texel_is_covered_by_the_triangles_around_its_centre(numbers: list[float]) -> None:
    size = 16
    uv = np.array(numbers[: len(numbers) // 6 * 6]).reshape(-1, 3, 2)

    found = coverage(uv, size)

    # Barycentric coordinates of every centre within every copy of a tile. Coordinates are
    # snapped to 1/256 of a texel, which matters near edges, and for all of a thin triangle.
    near, least, most = 1e-2, np.zeros((size, size)), np.zeros((size, size))
    ticks = (np.arange(size) + 0.5) / size
    thin = [is_thin(triangle, size) for triangle in uv]
    for tile in np.ndindex(6, 6):
        points = np.stack(np.meshgrid(ticks, ticks), axis=-1) + np.array(tile) - 2
        for a, b, c in uv[~np.array(thin)]:
            turn = cross(b - a, c - a)
            sides = [cross(q - p, points - p) / turn for p, q in ((a, b), (b, c), (c, a))]
            inside = np.min(sides, axis=0)
            least += inside > near
            most += inside > -near
    assert (found >= least).all()
    assert (found <= most + 36 * sum(thin)).all()


def cross(first: Any, second: Any) -> Any:
    return first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]


def is_thin(triangle: Any, size: int) -> bool:
    """Whether a triangle is less than half a texel high."""
    a, b, c = triangle
    longest = max(np.linalg.norm(b - a), np.linalg.norm(c - b), np.linalg.norm(a - c))
    return bool(abs(cross(b - a, c - a)) * size <= 0.5 * longest)


def test_texel_density_is_that_of_a_square_by_hand() -> None:
    # 16 by 8 texels over a square of 2 by 2 model units: 8 and 4 texels per unit.
    found = audit("a.gltf", one_square().to_bytes()).uv

    assert found.texel_density_min == pytest.approx(np.sqrt(8 * 4))


def test_luminance_is_that_of_the_pixels_as_pillow_decodes_them() -> None:
    generator = np.random.default_rng(1)
    pixels = generator.integers(0, 256, size=(40, 24, 3), dtype=np.uint8)
    out = io.BytesIO()
    Image.fromarray(pixels).save(out, "PNG")
    document = whole()
    document.json["images"][0]["bufferView"] = document.view(out.getvalue())

    found = audit("a.gltf", document.to_bytes()).textures

    luminance = np.asarray(Image.open(io.BytesIO(out.getvalue()))) @ (0.2126, 0.7152, 0.0722)
    low, high = np.percentile(luminance, (1, 99))
    first = found.images[0]
    assert (first.width, first.height) == (24, 40)
    assert first.luminance_mean == pytest.approx(luminance.mean(), abs=0.5)
    assert first.luminance_p1 == pytest.approx(low, abs=2)
    assert first.luminance_p99 == pytest.approx(high, abs=2)


def test_materials_are_those_trimesh_reads() -> None:
    data = whole().to_bytes()

    found = audit("a.gltf", data).materials

    scene = trimesh.load_scene(io.BytesIO(data), file_type="gltf", process=False)
    theirs = {each.visual.material.name: each.visual.material for each in scene.geometry.values()}
    assert set(found.names) == set(theirs)
    for each in found.items:
        other = theirs[each.name]
        assert each.double_sided == bool(other.doubleSided)
        assert each.alpha_mode == (other.alphaMode or "OPAQUE")
        assert ("base_color" in each.textures) == (other.baseColorTexture is not None)
        assert ("normal" in each.textures) == (other.normalTexture is not None)


def test_weights_are_added_up_as_numpy_adds_them() -> None:
    generator = np.random.default_rng(2)
    weights = generator.uniform(0, 0.5, size=(4, 4)).astype("<f4")
    document = Document()
    document.json = whole().json
    document._buffer = whole()._buffer
    primitive = document.json["meshes"][0]["primitives"][1]
    primitive["attributes"]["WEIGHTS_0"] = document.accessor(weights)

    found = audit("a.gltf", document.to_bytes()).motion

    corners = weights[[0, 1, 2, 0, 2, 3]].astype(np.float64)
    assert found.skinned_corners == len(corners)
    assert found.weights_not_normalised == np.count_nonzero(abs(corners.sum(axis=1) - 1) > 0.01)


def test_where_coordinates_lie_does_not_depend_on_the_triangulation() -> None:
    coarse, fine = (trimesh.creation.icosphere(subdivisions=level) for level in (3, 4))

    def layout(mesh: trimesh.Trimesh) -> Any:
        lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in mesh.vertices.tolist()]
        lines += [f"vt {x!r} {y!r}" for x, y in (0.25 * mesh.vertices[:, :2] + 0.5).tolist()]
        lines += [f"f {' '.join(f'{v}/{v}' for v in face)}" for face in (mesh.faces + 1).tolist()]
        content = read_asset("a.obj", "\n".join(lines).encode()).content()
        [found] = layouts(content, ["a"]).values()
        return found.stored

    first, second = layout(coarse), layout(fine)

    # Two discs of radius 1/4, one over the other, seen from both sides.
    assert first.area == pytest.approx(2 * np.pi / 16, rel=0.02)
    assert second.area == pytest.approx(2 * np.pi / 16, rel=0.005)
    assert first.centre == pytest.approx((0.5, 0.5), abs=1e-9)
    assert first.signed == pytest.approx(0, abs=1e-9)
    assert first.is_like(second)
