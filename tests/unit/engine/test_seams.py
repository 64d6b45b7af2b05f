"""Seams between nodes and groups that a file stores rounded apart do not tear open."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.assets import read_asset
from meshcone.files import MeshFile
from meshcone.quality.contacts import border_contacts
from meshcone.surface import Mesh
from meshcone.surface.arrays import Floats, row_lengths
from tests import shapes
from tests.meshes import joined_halves, noisy, sheet, sphere
from tests.unit.assets.builders import Gltf
from tests.unit.engine.evidence import Evidence

BALL = sphere(3)


def halves(mesh: Mesh) -> tuple[list[Mesh], np.ndarray]:
    """The mesh cut in two, and the pairs of vertices at the cut: in the first, in the second."""
    above = BALL.corners[:, :, 2].mean(axis=1) > 0
    used, parts = [], []
    for chosen in (above, ~above):
        vertices, faces = np.unique(mesh.faces[chosen], return_inverse=True)
        used.append(vertices)
        parts.append(Mesh(mesh.vertices[vertices], faces.reshape(-1, 3)))
    _, first, second = np.intersect1d(*used, return_indices=True)
    return parts, np.stack([first, second], axis=1)


def as_glb(parts: list[Mesh]) -> bytes:
    """A node for each part, turned, scaled and moved, with positions in its own frame."""
    gltf = Gltf()
    for part, scale, place in zip(
        parts, (0.01, 3.0), ([0.1, 0.2, 5.3], [-2.7, 0.3, 0]), strict=True
    ):
        local = ((part.vertices - np.array(place)) / scale)[:, [0, 2, 1]] * [1, 1, -1]
        primitive = {
            "attributes": {"POSITION": gltf.accessor(local.astype(np.float32))},
            "indices": gltf.accessor(part.faces.ravel().astype(np.uint32)),
        }
        half = float(np.sqrt(0.5))  # a quarter turn about x takes (x, z, -y) to (x, y, z)
        gltf.node(
            mesh=gltf.mesh(primitive),
            rotation=[half, 0, 0, half],
            scale=[scale] * 3,
            translation=place,
        )
    return gltf.glb()


def as_obj(parts: list[Mesh]) -> bytes:
    """The parts one after the other, the second rounded to fewer digits."""
    mesh = Mesh(
        np.concatenate([parts[0].vertices, parts[1].vertices.round(5)]),
        np.concatenate([parts[0].faces, parts[1].faces + len(parts[0].vertices)]),
    )
    return shapes.obj(mesh.vertices, mesh.faces)


def gaps(name: str, data: bytes, pairs: np.ndarray, first: int) -> Floats:
    positions = read_asset(name, data).positions
    return row_lengths(positions[pairs[:, 0]] - positions[first + pairs[:, 1]])


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("name", ["s.glb", "s.obj"])
def test_what_was_closed_stays_closed_to_the_precision_of_the_file(name: str, seed: int) -> None:
    parts, pairs = halves(noisy(BALL, 0.01, seed))
    first = len(parts[0].vertices)
    source = MeshFile(name, as_glb(parts) if name == "s.glb" else as_obj(parts))
    reference = MeshFile("r.obj", shapes.obj(BALL.vertices, BALL.faces))

    made = Evidence.of(source, reference, {})

    before = gaps(name, source.data, pairs, first)
    assert 0 < before.max() < 2e-5
    assert gaps(name, made.refined.data, pairs, first).max() < before.max() + 2e-6
    quality = made.report.quality
    assert quality.refined is not None
    assert quality.input.validity.cracks == quality.refined.validity.cracks == 2 * len(pairs)
    assert made.report.outcome == "improved"
    assert not made.failed()


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"effort": "fast"},
        {"effort": "fast", "cones": {"max_displacement": {"relative": 0.05}}},
        {"effort": "fast", "solver": {"method": "full"}},
        {"effort": "fast", "surface": {"regions": 2}},
    ],
    ids=["best", "fast", "with a cone that binds", "by SCS alone", "in regions"],
)
@pytest.mark.parametrize("cells", [(4, 8), (4, 6)], ids=["one side finer", "neither finer"])
def test_a_seam_stays_closed_whose_sides_are_divided_otherwise(
    cells: tuple[int, int], options: dict[str, object]
) -> None:
    # Everything is bent and rough but the seam, which is a straight line.
    flat = joined_halves(*cells)
    x, y, _ = flat.vertices.T
    rough = np.random.default_rng(0).normal(size=len(x)) * 0.01
    source = flat.moved_to(np.column_stack([x, y, (x - 1) ** 2 * (0.3 + y / 4 + rough)]))
    fine = sheet(41, 21).vertices / 20
    curve = (fine[:, 0] - 1) ** 2 * (0.3 + fine[:, 1] / 4) + 0.05 * np.sin(3 * fine[:, 1])
    reference = shapes.obj(np.column_stack([fine[:, :2], curve]), sheet(41, 21).faces)
    contacts = border_contacts(source, 10_000)

    made = Evidence.of(
        MeshFile("s.obj", shapes.obj(source.vertices, source.faces)),
        MeshFile("r.obj", reference),
        options,
    )

    assert made.report.outcome == "improved"
    assert made.failed() == set()
    answer = read_asset("s.obj", made.refined.data).positions
    assert np.abs(answer - source.vertices).max() > 0.01
    assert contacts.opened(answer)[1].max() < 1e-8
