"""A thumbnail shows the mesh that is judged, as it is seen from front, right and above."""

from __future__ import annotations

import io

import numpy as np
import pytest
from PIL import Image

from meshcone.appearance.paint import Paint
from meshcone.files import MeshFile
from meshcone.options import parse_options
from meshcone.surface import Mesh
from meshcone.verbs.audit import examination
from meshcone.verbs.measure import measurement
from meshcone.verbs.refine import refine
from meshcone.views.thumbnail import SIZE, thumbnail_webp
from tests import shapes
from tests.painted import encoded, painted, picture
from worker.run import artifacts

FEW = {"quality": {"samples": 64, "emd_samples": 16, "curvature_samples": 16}}


def pixels(mesh: Mesh, paint: Paint | None = None) -> np.ndarray:
    """(h, w, 4) of its thumbnail."""
    data = thumbnail_webp(mesh, paint)
    assert data is not None
    return np.asarray(Image.open(io.BytesIO(data)).convert("RGBA"))


def ball(radius: float = 1.0) -> Mesh:
    return Mesh(*shapes.sphere(3, radius))


def test_it_fills_the_picture_and_leaves_the_ground_clear() -> None:
    opaque = pixels(ball())[..., 3] > 127

    assert opaque.shape == (SIZE, SIZE)
    # A disc that touches the margin: pi/4 of the square of its diameter.
    assert opaque.mean() == pytest.approx(np.pi / 4 / 1.04**2, rel=0.03)
    assert not opaque[0, 0]


def test_its_size_does_not_change_what_is_seen() -> None:
    one, other = pixels(ball(1e-3)), pixels(ball(50.0))

    assert np.abs(one.astype(int) - other).max() <= 8  # rounded elsewhere, and compressed


def test_where_it_lies_does_not_change_what_is_seen() -> None:
    mesh = ball()
    moved = Mesh(mesh.vertices + np.array([1e4, -2e4, 3e4]), mesh.faces)

    assert np.abs(pixels(mesh).astype(int) - pixels(moved)).max() <= 8


def test_a_job_shows_the_refined_mesh_where_there_is_one() -> None:
    vertices, faces = shapes.sphere(2)
    reference = MeshFile("ball.obj", shapes.obj(vertices, faces))
    source = MeshFile("rough.obj", shapes.obj(shapes.noisy(vertices, 0.2), faces))
    done = refine(source, reference, parse_options({**FEW, "effort": "fast"}))
    assert done.report.outcome == "improved"
    assert done.scene.refined is not None

    stored = artifacts.of_refinement("rough.obj", done).files["thumbnail"].data

    assert stored == thumbnail_webp(done.scene.refined.mesh)
    assert stored != thumbnail_webp(done.scene.input.mesh)


def test_light_comes_from_the_left_and_above() -> None:
    shown = pixels(ball())[..., :3].astype(float).mean(axis=-1)
    quarter, rest = SIZE // 4, SIZE - SIZE // 4

    assert shown[quarter, quarter] > shown[rest, rest] + 30


def test_faces_are_seen_whichever_way_they_are_turned() -> None:
    mesh = ball()
    turned = Mesh(mesh.vertices, mesh.faces[:, ::-1])

    assert np.array_equal(pixels(mesh), pixels(turned))


def test_colours_are_shown_once_their_images_are_decoded() -> None:
    file = MeshFile("a.gltf", painted(encoded(picture())))
    scene = measurement(file, file, parse_options(FEW)).scene
    assert scene.paints is not None
    plain = pixels(scene.input.mesh)

    assert scene.paints[0].is_at_hand  # comparing colours has decoded them
    coloured = pixels(scene.input.mesh, scene.paints[0])

    def spread(image: np.ndarray) -> float:
        channels = image[image[..., 3] > 200][:, :3].astype(float)
        return float(np.ptp(channels, axis=1).mean())

    assert spread(coloured) > spread(plain) + 20


@pytest.mark.parametrize("vertices", [np.zeros((3, 3)), np.full((3, 3), 2.0)])
def test_what_has_no_extent_has_no_picture(vertices: np.ndarray) -> None:
    assert thumbnail_webp(Mesh(vertices, np.array([[0, 1, 2]]))) is None


def test_no_job_fails_because_it_cannot_be_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> bytes:
        raise ZeroDivisionError

    file = MeshFile("ball.obj", shapes.obj(*shapes.sphere(1)))
    done = measurement(file, file, parse_options(FEW))
    assert artifacts.of_measurement("ball.obj", done).files["thumbnail"].filename == (
        "ball.thumbnail.webp"
    )
    monkeypatch.setattr(artifacts, "thumbnail_webp", broken)

    assert set(artifacts.of_measurement("ball.obj", done).files) == {"report", "preview", "heatmap"}


def test_an_audit_leaves_one_too_and_decodes_no_image_for_it() -> None:
    file = MeshFile("a.gltf", painted(encoded(picture())))
    found = examination(file, None, parse_options({"mode": "audit"}))

    stored = artifacts.of_audit("a.gltf", found).files["thumbnail"].data

    assert not found.paint.is_at_hand
    assert stored == thumbnail_webp(found.mesh)
