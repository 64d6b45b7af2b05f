"""Assets made to be costly are looked at with bounded work, and what was left out is told."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from meshcone.assets import read_asset
from meshcone.auditing.asset import audit_asset
from meshcone.auditing.changes import changes_between
from meshcone.auditing.records import AssetAudit
from meshcone.files import MeshFile
from meshcone.local_files import read_local
from tests import shapes
from tests.whole_asset import SQUARE_FACES, Document, square, whole


def audit(document: Document) -> AssetAudit:
    file = MeshFile("a.gltf", document.to_bytes())
    return audit_asset(file, read_asset(file.name, file.data))


def squares(count: int, uv: Any) -> Document:
    """As many squares at one place, each with a material of its own."""
    document = Document()
    arrays = {**square(), "TEXCOORD_0": uv.astype("<f4")}
    attributes = {name: document.accessor(values) for name, values in arrays.items()}
    indices = document.accessor(SQUARE_FACES.reshape(-1, 1))
    document.json |= {
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
        "materials": [{"name": f"m{number}"} for number in range(count)],
        "meshes": [
            {
                "primitives": [
                    {"attributes": attributes, "indices": indices, "material": number}
                    for number in range(count)
                ]
            }
        ],
    }
    return document


def lying_png(size: int) -> bytes:
    """A picture that declares a square of a size, and holds nothing."""

    def chunk(name: bytes, data: bytes) -> bytes:
        check = zlib.crc32(name + data)
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", check)

    header = struct.pack(">IIBBBBB", size, size, 8, 6, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", b"") + chunk(b"IEND", b"")


def test_coordinates_over_many_tiles_are_drawn_coarsely_or_not_at_all() -> None:
    tiles = square()["TEXCOORD_0"] * 24 - 12

    some, many = (audit(squares(count, tiles)).uv for count in (1, 40))

    # Two triangles over 24 by 24 tiles: twice 576 squares of texels are within 20 million.
    assert [each.resolution for each in some.by_material] == [128]
    assert some.tiles
    assert {each.resolution for each in many.by_material} == {None}
    assert many.overlap_share is None


def test_many_materials_share_what_may_be_drawn() -> None:
    found = audit(squares(300, square()["TEXCOORD_0"])).uv

    resolutions = [each.resolution or 0 for each in found.by_material]
    assert set(resolutions) == {128}
    assert 2 * sum(resolution**2 for resolution in resolutions) <= 20_000_000


@pytest.mark.parametrize("value", [1e30, -1e30, np.nan, np.inf])
def test_an_audit_of_absurd_coordinates_can_be_stored_and_read(value: float) -> None:
    found = audit(squares(1, np.array([[0, 0], [1, 0], [1, value], [0, 1]])))

    assert AssetAudit.model_validate_json(found.model_dump_json()) == found
    assert found.uv.outside + found.uv.not_finite > 0


def test_images_that_claim_more_than_is_decoded_altogether_are_told() -> None:
    document = whole()
    data = [lying_png(8192 - number) for number in range(6)]
    document.json["images"] = [{"bufferView": document.view(each)} for each in data]
    document.json["textures"] = [{"source": number} for number in range(6)]
    document.json["materials"] = [
        {"pbrMetallicRoughness": {"baseColorTexture": {"index": number}}} for number in range(6)
    ]

    found = audit(document).textures

    # Four of them may be decoded, and turn out to hold nothing.
    assert (found.largest_width, found.not_tested) == (8192, 2)
    assert found.unreadable is None
    assert found.base_color_luminance_max is None


def test_a_chain_of_nodes_that_nothing_draws_has_paths_of_bounded_length() -> None:
    document = whole()
    count = 8_000
    first = len(document.json["nodes"])
    document.json["nodes"] += [
        {"name": "link", "children": [first + number + 1]} for number in range(count - 1)
    ]
    document.json["nodes"].append({"name": "link"})
    document.json["scenes"].append({"name": "chain", "nodes": [first]})
    asset = read_asset("a.gltf", document.to_bytes())

    changes = changes_between(read_asset("b.gltf", whole().to_bytes()), asset)

    assert changes.added.nodes == count
    assert max(len(row.where) for row in changes.rows) < 1000
    assert audit(document).budget.depth == count


def test_textures_that_refer_to_each_other_in_a_circle_have_no_image() -> None:
    document = whole()
    document.json["textures"] = [
        {"source": 99, "extensions": {"KHR_texture_basisu": {"source": 98}}},
        {"extensions": {"EXT_texture_webp": {"source": "textures/0"}}},
    ]
    document.json["images"] = [{"uri": "a.gltf"}, {"uri": "#/images/0"}]

    found = audit(document)

    assert found.textures.missing == 4  # two images, and two textures that lead to none
    assert found.textures.unused == 2
    assert "base_color" in found.materials.items[0].textures


def test_files_that_name_themselves_are_read_once(tmp_path: Path) -> None:
    vertices, faces = shapes.sphere(1)
    mesh = tmp_path / "a.obj"
    mesh.write_bytes(b"mtllib a.obj\nmtllib a.mtl\nusemtl m\n" + shapes.obj(vertices, faces))
    (tmp_path / "a.mtl").write_text("newmtl m\nmap_Kd a.mtl\nmtllib a.mtl\n")
    document = whole()
    document.json["images"] = [{"uri": "b.gltf"}]
    (tmp_path / "b.gltf").write_bytes(document.to_bytes())

    for name, beside in (("a.obj", {"a.obj", "a.mtl"}), ("b.gltf", {"b.gltf"})):
        file = read_local(tmp_path / name)
        found = audit_asset(file, read_asset(file.name, file.data, file.resources))

        assert set(file.resources) == beside
        assert (found.textures.count, found.textures.unreadable) == (1, 1)
