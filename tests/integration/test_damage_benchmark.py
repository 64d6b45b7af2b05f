"""Some rows of benchmarks/damage.py, which takes a minute or two for all of them."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

BENCHMARK = Path(__file__).parents[2] / "benchmarks" / "damage.py"


@pytest.fixture(scope="module")
def rows(tmp_path_factory: pytest.TempPathFactory) -> dict[tuple[str, str], dict]:
    """What the sets of gates notice, by damage or export and format."""
    out = tmp_path_factory.mktemp("damage") / "rows.json"
    only = ("renamed", "weights", "UVs not", "all of it", "OBJ again")
    done = subprocess.run(
        [sys.executable, str(BENCHMARK), "--only", *only, "--json", str(out)],
        capture_output=True,
        text=True,
        check=False,
        timeout=600,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return {(row["name"], row["format"]): row["caught"] for row in json.loads(out.read_text())}


@pytest.mark.parametrize("kind", ["gltf", "obj"])
def test_renamed_materials_are_noticed(rows: dict, kind: str) -> None:
    caught = rows["materials renamed", kind]

    assert caught["docs"] == "changes.renamed.materials fail"
    assert caught["keep all"] == "changes.renamed.materials fail"
    assert caught["3d-commerce"] is None


@pytest.mark.parametrize(
    ("name", "key"),
    [
        ("weights not normalised", "asset.motion.weights_not_normalised"),
        ("UVs not finite", "asset.uv.not_finite"),
    ],
)
def test_a_profile_notices_what_no_viewer_can_show(rows: dict, name: str, key: str) -> None:
    assert rows[name, "gltf"]["3d-commerce"] == f"{key} fail"


@pytest.mark.parametrize("export", [("all of it", "gltf"), ("OBJ again", "obj")])
def test_an_undamaged_export_passes_everything(rows: dict, export: tuple[str, str]) -> None:
    assert set(rows[export].values()) == {None}
