"""What vertices have besides places, in two files that differ in that."""

from __future__ import annotations

import pytest

from meshcone.assets import read_asset
from meshcone.auditing.asset import audit_asset
from meshcone.auditing.changes import changes_between
from meshcone.auditing.records.changes import Changes
from meshcone.files import MeshFile
from tests.unit.auditing.test_changes import counted

PLY = (
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    "property float z\n{}element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0 {}\n1 0 0 {}\n0 1 0 {}\n3 0 1 2\n"
)


def triangle(**columns: float) -> bytes:
    """A PLY whose three vertices have the same of each column."""
    named = "".join(f"property float {name}\n" for name in columns)
    return PLY.format(named, *[" ".join(map(str, columns.values()))] * 3).encode()


def between_files(name: str, first: bytes, second: bytes) -> Changes:
    return changes_between(read_asset(name, first), read_asset(name, second))


@pytest.mark.parametrize(
    ("columns", "what"),
    [
        ({"red": 1.0, "green": 0.5, "blue": 0.0}, "color_sets"),
        ({"nx": 0.0, "ny": 0.0, "nz": 1.0}, "attributes"),
        ({"s": 0.5, "t": 0.5}, "uv_sets"),
        ({"quality": 3.0}, "attributes"),
    ],
)
def test_what_vertices_of_a_ply_had_is_lost(columns: dict[str, float], what: str) -> None:
    changes = between_files("a.ply", triangle(**columns), triangle())

    assert counted(changes) == {f"lost.{what}": 1}


def test_colours_of_an_off_are_lost() -> None:
    coloured = b"COFF\n3 1 0\n0 0 0 1 0 0 1\n1 0 0 1 0 0 1\n0 1 0 1 0 0 1\n3 0 1 2\n"
    plain = b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"

    assert counted(between_files("a.off", coloured, plain)) == {"lost.color_sets": 1}


def test_an_audit_of_a_ply_counts_what_its_vertices_have() -> None:
    data = triangle(nx=0, ny=0, nz=-1, s=0, t=0, red=1, green=1, blue=1)

    audit = audit_asset(MeshFile("a.ply", data), read_asset("a.ply", data))

    assert (audit.shading.without_normals, audit.shading.opposed_normals) == (0, 3)
    assert (audit.uv.sets, audit.budget.uv_sets, audit.budget.color_sets) == (1, 1, 1)
