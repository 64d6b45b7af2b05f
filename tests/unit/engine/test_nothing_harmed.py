"""What comes back is never worse than what was sent."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.files import MeshFile
from meshcone.options import parse_options
from meshcone.surface import Mesh
from meshcone.verbs.refine import Refinement, refine
from tests import shapes
from tests.meshes import noisy, sphere, torus


def file(name: str, mesh: Mesh) -> MeshFile:
    return MeshFile(name, shapes.obj(mesh.vertices, mesh.faces))


def refined(source: Mesh, reference: Mesh, **options: object) -> Refinement:
    return refine(file("s.obj", source), file("r.obj", reference), parse_options(options))


@pytest.mark.parametrize("effort", ["fast", "best"])
@pytest.mark.parametrize("factor", [1000.0, 0.001])
def test_other_units_come_back_as_they_were(factor: float, effort: str) -> None:
    source = noisy(sphere(3), 0.01)
    source = source.moved_to(factor * source.vertices)

    answer = refined(source, sphere(3), effort=effort)

    assert answer.report.outcome == "misaligned"
    assert answer.data == file("s.obj", source).data
    assert answer.certificate is None
    [told] = [told for told in answer.report.warnings if told.code == "pose.misfit"]
    assert "With align=similarity" in told.words


def test_other_units_are_refined_where_aligning_is_asked_for() -> None:
    source = noisy(sphere(3), 0.01)

    answer = refined(source.moved_to(1000 * source.vertices), sphere(3), align="similarity")

    assert answer.report.outcome == "improved"


def test_another_place_comes_back_as_it_was() -> None:
    source = noisy(torus(), 0.01)

    answer = refined(source.moved_to(source.vertices + np.array([40, 0, 0])), torus())

    assert answer.report.outcome == "misaligned"
    assert answer.report.displacement.max == 0


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_an_answer_worse_somewhere_gives_way_to_the_input(seed: int) -> None:
    generator = np.random.default_rng(seed)
    reference = Mesh(generator.normal(size=(3, 3)), np.array([[0, 1, 2]]))
    lifted = reference.vertices.copy()
    lifted[0] += 0.1 * reference.face_normals[0]

    answer = refined(reference.moved_to(lifted), reference)

    before, after = answer.report.quality.input, answer.report.quality.refined
    assert after is not None
    assert after.point_to_surface.max <= 1.02 * before.point_to_surface.max + 1e-4
    assert answer.report.outcome in {"kept", "improved"}


def test_a_reference_returned_as_source_stays_to_the_byte() -> None:
    answer = refined(torus(), torus())

    assert answer.report.outcome == "indistinguishable"
    assert answer.data == file("s.obj", torus()).data
