"""Pictures from six sides show the colours that the files have, where they have them."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
import pytest
from PIL import Image

from meshcone.files import MeshFile
from meshcone.options import parse_options
from meshcone.verbs.measure import measurement
from meshcone.verbs.refine import refine
from meshcone.views.pictures import VIEW, pictures_png
from service.html_report.results import html_of_result
from tests import shapes
from tests.painted import encoded, painted, picture
from tests.whole_asset import SQUARE_FACES, square
from worker.run.artifacts import of_measurement

FEW: dict[str, Any] = {"quality": {"samples": 64, "emd_samples": 16, "curvature_samples": 16}}
COLUMNS = ("front", "back", "right", "left", "top", "bottom")
# A colour for the side of a box that faces each way along x, y and z.
SIDES = {
    "right": (0, 1, (255, 0, 0)),
    "left": (0, -1, (0, 255, 0)),
    "top": (1, 1, (0, 0, 255)),
    "bottom": (1, -1, (255, 255, 0)),
    "front": (2, 1, (0, 255, 255)),
    "back": (2, -1, (255, 0, 255)),
}


def box() -> bytes:
    """A cube with a colour on each side."""
    positions, colours, faces = [], [], []
    for axis, sign, colour in SIDES.values():
        first = len(positions)
        for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
            corner = [0.0] * 3
            corner[axis], corner[(axis + 1) % 3], corner[(axis + 2) % 3] = sign, a * sign, b
            positions.append(corner)
            colours.append([channel / 255 for channel in colour])
        faces += [[first, first + 1, first + 2], [first, first + 2, first + 3]]
    arrays = {
        "POSITION": np.array(positions, dtype="<f4"),
        "COLOR_0": np.array(colours, dtype="<f4"),
        "faces": np.array(faces, dtype="<u2"),
    }
    return painted(None, arrays)


def pictures(data: bytes, **options: Any) -> bytes | None:
    file = MeshFile("a.gltf", data)
    return pictures_png(measurement(file, file, parse_options({**FEW, **options})).scene)


def view(sheet: bytes | None, name: str, row: int = 0) -> np.ndarray:
    """(h, w, 3) one view of a sheet, which is as wide as its six columns and the names."""
    assert sheet is not None
    image = np.asarray(Image.open(io.BytesIO(sheet)))
    left = image.shape[1] - VIEW * (6 - COLUMNS.index(name))
    rows = image.shape[0] // VIEW
    top = image.shape[0] - VIEW * (rows - row)
    return image[top : top + VIEW, left : left + VIEW]


def test_each_view_shows_the_side_it_is_called_after() -> None:
    sheet = pictures(box())

    for name, (*_, colour) in SIDES.items():
        middle = view(sheet, name)[VIEW // 2, VIEW // 2]
        assert middle.tolist() == list(colour), name


def halves() -> bytes:
    """A square in the plane z = 0, red where x is small, blue where it is large."""
    image = np.array([[[255, 0, 0], [0, 0, 255]]], dtype=np.uint8)
    return painted(encoded(image), {**square(), "faces": SQUARE_FACES}, sampler={"magFilter": 9728})


@pytest.mark.parametrize(("name", "left", "right"), [("front", 0, 2), ("back", 2, 0)])
def test_what_is_left_from_the_front_is_right_from_behind(name: str, left: int, right: int) -> None:
    shown = view(pictures(halves()), name)[VIEW // 2]

    assert np.argmax(shown[VIEW // 3]) == left
    assert np.argmax(shown[2 * VIEW // 3]) == right


def test_what_cannot_be_decoded_is_grey() -> None:
    middle = view(pictures(painted(b"no picture")), "front")[VIEW // 2, VIEW // 2]

    assert len(set(middle.tolist())) == 1
    assert 100 < middle[0] < 230


def test_files_without_colours_have_no_pictures() -> None:
    file = MeshFile("a.obj", shapes.obj(*shapes.sphere(2)))

    assert pictures_png(measurement(file, file, parse_options(FEW)).scene) is None


def test_there_are_none_where_colours_are_turned_off() -> None:
    assert pictures(box(), quality={**FEW["quality"], "appearance": False}) is None


def test_triangles_that_cover_a_view_too_often_are_left_out() -> None:
    arrays = {**square(), "faces": np.tile(SQUARE_FACES, (2000, 1))}
    sheet = pictures(painted(encoded(picture()), arrays))

    assert len(np.unique(view(sheet, "front"))) <= 3


def test_a_refinement_is_a_row_of_its_own() -> None:
    file = MeshFile("a.gltf", painted(encoded(picture())))
    made = refine(file, file, parse_options({**FEW, "effort": "fast"}))

    measured, refined = (
        Image.open(io.BytesIO(sheet or b"")).height
        for sheet in (pictures(file.data), pictures_png(made.scene))
    )
    assert refined - measured == (VIEW if made.scene.refined else 0)
    assert made.scene.refined is not None


def test_they_are_a_file_of_the_job_and_part_of_the_page() -> None:
    file = MeshFile("box.gltf", box())
    done = measurement(file, file, parse_options(FEW))

    stored = of_measurement("box.gltf", done).files["pictures"]
    page = html_of_result(done.report, done.scene)

    assert (stored.filename, stored.media_type) == ("box.pictures.png", "image/png")
    assert stored.data == pictures_png(done.scene)
    assert b"data:image/png;base64,iVBOR" in page
