"""What one default limit allows no other refuses, and a job has the memory for it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from meshcone.assets import Limits
from meshcone.options import Options
from service.settings import ServiceSettings

DEPLOYMENT = (Path(__file__).parents[2] / "docs" / "deployment.md").read_text()
LIMITS = Limits()
SETTINGS = ServiceSettings()
CERTIFIED = Options().solver.certify_limit  # vertices
ROOM = 1.1  # of memory and time beyond what was measured


def rows(columns: int) -> list[list[float]]:
    """The tables of the section that consist of numbers, in so many columns."""
    text = DEPLOYMENT.split("## Limits that fit each other\n")[1]
    section = text.split("\n`MESHCONE_DEBUG=1`")[0]
    found = []
    for line in section.splitlines():
        cells = [cell.strip(" `").replace(",", "") for cell in line.split("|")[1:-1]]
        numbers = [re.match(r"[\d.]+", cell) for cell in cells]
        if len(cells) == columns and all(numbers):
            found.append([float(number[0]) for number in numbers if number])
    return found


MEASURED = rows(6)  # vertices, faces, MB, GB of measuring and of refining, seconds
SIZES = rows(3)  # GiB, bytes, vertices


def obj_bytes(vertices: int) -> int:
    """An OBJ with texture coordinates and normals, two faces a vertex, as exporters write it."""
    number = str(vertices)
    corner = f"{number}/{number}/{number}"
    vertex = "v -0.123456789 -0.123456789 -0.123456789\n"
    others = "vt 0.123456 0.123456\nvn -0.123456 -0.123456 -0.123456\n"
    return vertices * len(vertex + others + 2 * f"f {corner} {corner} {corner}\n")


def needed(vertices: float) -> float:
    """Bytes of memory that refining such a mesh takes, or a smaller one, by the table."""
    dearest, cheapest = (max(1e9 * row[4] / row[0] for row in part) for part in certified_apart())
    return max(dearest * min(vertices, CERTIFIED), cheapest * vertices)


def certified_apart() -> tuple[list[list[float]], list[list[float]]]:
    return (
        [row for row in MEASURED if row[0] <= CERTIFIED],
        [row for row in MEASURED if row[0] > CERTIFIED],
    )


def test_a_pair_of_the_largest_meshes_fits_into_a_request() -> None:
    assert obj_bytes(LIMITS.vertices) <= LIMITS.file_bytes
    assert 2 * obj_bytes(LIMITS.vertices) <= SETTINGS.max_upload_bytes
    assert 2 * LIMITS.file_bytes <= SETTINGS.max_upload_bytes


def test_the_largest_mesh_passes_the_other_caps_of_a_file() -> None:
    closed = 2 * LIMITS.vertices
    gltf = LIMITS.vertices * (12 + 12 + 8) + closed * 3 * 4

    assert closed <= LIMITS.faces
    assert 3 * LIMITS.vertices + closed <= LIMITS.lines
    assert gltf * 4 / 3 <= LIMITS.json_bytes  # in a data URI


def test_a_job_has_the_memory_and_the_time_to_refine_the_largest_mesh() -> None:
    largest = MEASURED[-1]

    assert 0.99 * LIMITS.vertices <= largest[0] <= LIMITS.vertices
    assert ROOM * needed(LIMITS.vertices) <= SETTINGS.job_memory_bytes
    assert 2 * largest[5] <= SETTINGS.job_timeout


def test_what_a_job_writes_is_no_larger_than_it_may_be() -> None:
    assert 4 * LIMITS.file_bytes <= SETTINGS.job_file_bytes


@pytest.mark.parametrize("row", SIZES, ids=lambda row: f"{row[0]:g} GiB")
def test_the_sizes_that_are_recommended_have_the_memory(row: list[float]) -> None:
    gibibytes, size, vertices = row

    assert size == gibibytes * 2**30
    assert ROOM * needed(vertices) <= size


def test_the_recommended_sizes_begin_with_the_defaults() -> None:
    assert SIZES[0][1:] == [SETTINGS.job_memory_bytes, LIMITS.vertices]
