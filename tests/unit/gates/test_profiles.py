"""Sets of gates for common uses, and schemas of Khronos' auditor."""

from __future__ import annotations

import json
from typing import Any, get_args

import pytest

from meshcone.errors import InputError
from meshcone.gates.auditor import gates_of_schema
from meshcone.gates.files import GateFile, parse_gate_file
from meshcone.gates.keep import keep_gates
from meshcone.gates.profile import PROFILES, profile
from meshcone.options import Mode


def bounds(file: GateFile) -> dict[str, dict[str, Any]]:
    return {key: dict(rule.bounds()) for key, rule in file.for_asset("a.glb").items()}


def of_schema(schema: dict[str, Any], product: dict[str, Any] | None = None) -> dict[str, Any]:
    sent = None if product is None else ("product.json", json.dumps(product).encode())
    return bounds(gates_of_schema(("schema.json", json.dumps(schema).encode()), sent, "audit"))


@pytest.mark.parametrize("mode", get_args(Mode))
@pytest.mark.parametrize("name", PROFILES)
def test_every_profile_is_for_every_kind_of_report(name: str, mode: Mode) -> None:
    file = parse_gate_file(f"{name}.toml", profile(name), mode)

    others = {key for key in file.gates if not key.startswith("asset.")}
    assert others <= {"warnings.content.malformed"}


def test_there_are_five() -> None:
    assert set(PROFILES) == {"web", "3d-commerce", "mobile", "vr", "print"}


def test_an_unknown_profile_is_told_with_the_closest() -> None:
    with pytest.raises(InputError, match="'3dcommerce'; did you mean '3d-commerce'"):
        profile("3dcommerce")


def test_a_file_replaces_gates_of_a_profile_and_adds_to_them() -> None:
    web = parse_gate_file("web.toml", profile("web"), "measure")
    own = b"""
        unit = "cm"
        [gates]
        "asset.budget.triangles" = { max = 5 }
        "emd" = { max = 1 }
        [classes.plain]
        match = ["*"]
        without = ["asset.budget.total_bytes"]
    """

    gates = parse_gate_file("own.toml", own, "measure", web).for_asset("a.glb")

    assert gates["asset.budget.triangles"].bounds() == {"max": 5}
    assert gates["asset.textures.largest_width"].bounds() == {"max": 2048}
    assert gates["emd"].unit == "cm"
    assert "asset.budget.total_bytes" not in gates


def test_what_a_schema_leaves_out_has_the_auditors_default() -> None:
    found = of_schema({"version": "1.0.0"})

    commerce = bounds(parse_gate_file("c.toml", profile("3d-commerce"), "audit"))
    assert found == {key: commerce[key] for key in found}
    assert found["asset.budget.total_bytes"] == {"min": 1024, "max": 5_242_880}


def test_minus_one_and_false_turn_a_check_off() -> None:
    off = {"minimum": -1, "maximum": -1}

    found = of_schema(
        {
            "version": "1.0.0",
            "fileSizeInKb": off,
            "materials": off,
            "model": {"triangles": off},
            "textures": {
                "width": off,
                "height": off,
                "pbrColorRange": off,
                "requireDimensionsBePowersOfTwo": False,
            },
            "uvs": {"requireNotInverted": False},
        }
    )

    assert list(found) == ["asset.uv.overlap_share"]


def test_every_check_has_a_gate() -> None:
    found = of_schema(
        {
            "version": "1.0.0",
            "model": {
                "objectCount": {
                    "nodes": {"maximum": 3},
                    "meshes": {"minimum": 1},
                    "primitives": {"maximum": 9},
                },
                "requireBeveledEdges": True,
                "requireCleanRootNodeTransform": True,
                "requireManifoldEdges": True,
            },
            "textures": {"requireDimensionsBeQuadratic": True},
            "uvs": {
                "requireRangeZeroToOne": True,
                "pixelsPerMeter": {"minimum": 100, "maximum": 900},
                "gutterWidth": {"resolution256": 4, "resolution1024": 8},
            },
        }
    )

    assert found["asset.budget.nodes"] == {"max": 3}
    assert found["asset.budget.meshes"] == {"min": 1}
    assert found["asset.budget.draw_calls"] == {"max": 9}
    assert found["asset.geometry.sharp_edges"] == {"max": 0}
    assert found["asset.size.clean_root"] == {"equals": True}
    assert found["asset.geometry.watertight"] == {"equals": True}
    assert found["asset.textures.not_square"] == {"max": 0}
    assert found["asset.uv.outside"] == {"max": 0}
    assert found["asset.uv.texel_density_min"] == {"min": 100}
    assert found["asset.uv.texel_density_max"] == {"max": 900}
    # Four texels of 256 are sixteen of 1,024, which is the coarser of the two grids.
    assert found["asset.uv.gutter"] == {"min": 16}


def test_a_size_keeps_to_the_narrower_of_schema_and_product() -> None:
    dimensions = {
        "height": {"percentTolerance": 10},
        "length": {"minimum": 1, "maximum": 4, "percentTolerance": 50},
        "width": {"maximum": 2},
    }
    product = {"dimensions": {"height": 2, "length": 4, "width": 9}}

    found = of_schema({"version": "1.0.0", "product": {"dimensions": dimensions}}, product)

    assert found["asset.size.height"] == pytest.approx({"min": 1.8, "max": 2.2})
    assert found["asset.size.depth"] == {"min": 2, "max": 4}
    assert found["asset.size.width"] == {"max": 2}


@pytest.mark.parametrize(
    ("schema", "said"),
    [
        ({}, "'version': field required"),
        ({"version": "1.0.0", "material": {}}, "unknown key 'material'; did you mean 'materials'"),
        ({"version": "1.0.0", "materials": {"max": 1}}, "unknown key 'materials.max'"),
        ({"version": "1.0.0", "materials": 5}, "expected an object with names and values, found"),
        (
            {"version": "1.0.0", "product": {"dimensions": {"width": {"percentTolerance": 1}}}},
            "name the product's dimensions by --product",
        ),
    ],
)
def test_a_schema_that_the_auditor_would_not_know_is_refused(
    schema: dict[str, Any], said: str
) -> None:
    with pytest.raises(InputError) as refusal:
        of_schema(schema)

    assert said in refusal.value.message
    assert refusal.value.file == "schema.json"


def test_a_product_without_a_side_is_refused() -> None:
    with pytest.raises(InputError, match=r"product\.json: 'dimensions.height'"):
        of_schema({"version": "1.0.0"}, {"dimensions": {"length": 1, "width": 1}})


def test_what_is_to_be_kept_must_not_change_in_any_way() -> None:
    gates = keep_gates(["uvs", "animations"])

    assert set(gates) == {
        f"changes.{kind}.{what}"
        for kind in ("lost", "added", "renamed", "moved", "altered")
        for what in ("uv_sets", "animations", "skins", "morph_targets")
    }
    assert {rule.max for rule in gates.values()} == {0}


def test_all_is_everything_but_what_exporters_add() -> None:
    gates = keep_gates(["all"])

    assert "changes.lost.extensions" in gates
    assert "changes.added.cameras" in gates
    assert "changes.added.extensions" not in gates


def test_nothing_unknown_can_be_kept() -> None:
    with pytest.raises(InputError, match="unknown 'uv'; did you mean 'uvs'"):
        keep_gates(["uv"])
