from __future__ import annotations

import numpy as np
import pytest

from meshcone.assets import read_asset
from meshcone.files import MeshFile
from meshcone.options import Options
from meshcone.verbs.measure import measurement
from meshcone.verbs.refine import Refinement, refine
from meshcone.views.preview import preview_glb, simplified
from tests import shapes

FINE = shapes.sphere(5)
CAPPED = Options.model_validate(
    {"effort": "fast", "cones": {"max_displacement": {"relative": 0.005}}}
)


@pytest.fixture(scope="module")
def refinement() -> Refinement:
    vertices, faces = FINE
    source = MeshFile("rough.obj", shapes.obj(shapes.noisy(vertices), faces))
    return refine(source, MeshFile("ball.obj", shapes.obj(vertices, faces)), CAPPED)


def test_a_scene_shows_the_distances_the_report_states(refinement: Refinement) -> None:
    scene, quality = refinement.scene, refinement.report.quality

    assert scene.refined is not None
    assert scene.input.deviation.max() <= quality.input.point_to_surface.max
    assert scene.refined.deviation.mean() < 0.9 * scene.input.deviation.mean()
    assert len(scene.reference.deviation) == len(scene.reference.mesh.vertices)


def test_tension_is_where_cones_are_active(refinement: Refinement) -> None:
    assert refinement.report.certificate is not None
    assert sum(refinement.report.certificate.active.values()) > 0
    assert refinement.scene.tension is not None
    assert refinement.scene.tension.max() > 0


def test_simplified_meshes_keep_shape_and_common_faces(refinement: Refinement) -> None:
    light = simplified(refinement.scene, 2_000)

    assert light.refined is not None
    assert len(light.refined.mesh.faces) <= 2_000
    assert (light.refined.mesh.faces == light.input.mesh.faces).all()
    assert np.abs(np.linalg.norm(light.reference.mesh.vertices, axis=1) - 1).max() < 0.01


def test_simplifying_lets_no_deviation_disappear(refinement: Refinement) -> None:
    scene = refinement.scene
    light = simplified(scene, 2_000)

    assert light.input.deviation.max() == scene.input.deviation.max()
    assert light.tension is not None
    assert scene.tension is not None
    assert light.tension.max() == scene.tension.max()


def test_a_preview_is_a_glb_that_readers_understand(refinement: Refinement) -> None:
    asset = read_asset("preview.glb", preview_glb(refinement.scene))

    assert asset.counts().faces == 3 * len(FINE[1])
    assert np.abs(asset.vertices).max() < 1.2


def test_a_small_mesh_is_shown_as_it_is(refinement: Refinement) -> None:
    assert simplified(refinement.scene, 100_000).input is refinement.scene.input


def test_a_measurement_has_no_refined_mesh_to_show() -> None:
    vertices, faces = shapes.sphere(2)
    source = MeshFile("rough.obj", shapes.obj(shapes.noisy(vertices), faces))

    scene = measurement(source, MeshFile("b.obj", shapes.obj(vertices, faces)), Options()).scene

    assert scene.refined is None
    assert scene.input.deviation.max() > 0
