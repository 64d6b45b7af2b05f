"""Colours in a report: what is compared, what is said where it cannot be, what gates make of it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from meshcone.appearance.records import Appearance, ColorDifference
from meshcone.files import MeshFile
from meshcone.options import parse_options
from meshcone.report.report import MeasureReport
from meshcone.verbs.measure import measure
from meshcone.verbs.refine import refine
from tests import shapes
from tests.painted import encoded, globe, painted, painted_obj, picture

FEW: dict[str, Any] = {"quality": {"samples": 1000, "emd_samples": 16, "curvature_samples": 16}}
GATE = {"gates": {"appearance.color_difference.p95": {"max": 10}}}


def report(source: MeshFile, reference: MeshFile, **options: Any) -> MeasureReport:
    return measure(source, reference, parse_options({**FEW, **options}))


def compared(source: MeshFile, reference: MeshFile) -> ColorDifference:
    found = appearance(source, reference).color_difference
    assert isinstance(found, ColorDifference)
    return found


def appearance(source: MeshFile, reference: MeshFile, **options: Any) -> Appearance:
    found = report(source, reference, **options).appearance
    assert found is not None
    return found


def file(data: bytes, name: str = "a.gltf", **resources: bytes) -> MeshFile:
    return MeshFile(name, data, resources)


SKIN = picture()
ORIGINAL = file(painted(encoded(SKIN)))


def test_an_asset_looks_like_itself() -> None:
    found = compared(ORIGINAL, ORIGINAL)

    assert found.max < 1e-6
    assert found.psnr == pytest.approx(99)


def test_one_grey_for_another_differs_by_its_lightness() -> None:
    light, dark = (
        file(painted(material={"pbrMetallicRoughness": {"baseColorFactor": [value] * 3 + [1]}}))
        for value in (0.5, 0.25)
    )
    lighter, darker = (116 * np.cbrt(value) - 16 for value in (0.5, 0.25))
    off = ((lighter + darker) / 2 - 50) ** 2

    found = compared(light, dark)

    # CIEDE2000 of two greys is the difference of their lightness over its weight.
    expected = (lighter - darker) / (1 + 0.015 * off / np.sqrt(20 + off))
    assert (found.mean, found.p95, found.max) == pytest.approx((expected,) * 3)
    # Mean squared errors are of the channels as encoded.
    encoded_grey = [1.055 * value ** (1 / 2.4) - 0.055 for value in (0.5, 0.25)]
    assert found.psnr == pytest.approx(-20 * np.log10(encoded_grey[0] - encoded_grey[1]))


HARMFUL: dict[str, bytes] = {
    "red and blue swapped": painted(encoded(np.ascontiguousarray(SKIN[..., ::-1]))),
    "upside down": painted(encoded(np.ascontiguousarray(SKIN[::-1]))),
    "without its texture": painted(None),
    "without coordinates": painted(
        encoded(SKIN), {name: value for name, value in globe().items() if name != "TEXCOORD_0"}
    ),
}


@pytest.mark.parametrize("damage", HARMFUL)
def test_a_texture_that_is_not_the_same_is_seen(damage: str) -> None:
    assert compared(file(HARMFUL[damage]), ORIGINAL).p95 > 12


def test_another_tessellation_and_a_little_compression_are_not() -> None:
    finer = painted(encoded(SKIN, "JPEG", quality=95), globe(48, 24))

    assert compared(file(finer), ORIGINAL).p95 < 7.4


def test_a_source_that_is_inside_out_is_compared_all_the_same() -> None:
    arrays = globe()
    arrays["faces"] = arrays["faces"][:, ::-1]

    assert compared(file(painted(encoded(SKIN), arrays)), ORIGINAL).p95 < 1


def test_files_without_colours_have_no_such_section() -> None:
    bare = file(shapes.glb(*shapes.sphere(2)), "a.glb")

    assert report(bare, bare).appearance is None
    assert report(bare, bare).warnings == []


def test_a_reference_without_colours_is_nothing_to_compare_with() -> None:
    bare = file(shapes.glb(*shapes.sphere(2, radius=1.0)), "b.glb")

    found = report(ORIGINAL, bare, **GATE)

    assert found.appearance is None
    assert found.gates is not None
    assert found.gates.verdict == "not_tested"


def test_two_files_whose_libraries_are_missing_are_not_taken_for_white() -> None:
    unknown = file(painted_obj(), "a.obj")

    assert report(unknown, unknown).appearance is None


def test_a_source_that_lost_its_colours_is_as_white_as_viewers_show_it() -> None:
    bare = file(shapes.glb(*shapes.sphere(3, radius=1.0)), "b.glb")

    assert compared(bare, ORIGINAL).p95 > 12


@pytest.mark.parametrize(
    ("source", "why"),
    [
        (file(painted(b"no picture")), "image 'images/0'"),
        (file(painted_obj(), "a.obj"), "no library defines the material 'skin'"),
        (
            file(painted_obj(), "a.obj", **{"a.mtl": b"newmtl skin\nmap_Kd skin.png\n"}),
            "image 'skin.png': missing",
        ),
    ],
    ids=["damaged image", "missing library", "missing image"],
)
def test_what_cannot_be_compared_is_not_tested_and_no_pass(source: MeshFile, why: str) -> None:
    found = report(source, ORIGINAL, **GATE)

    assert found.gates is not None
    assert found.gates.verdict == "not_tested"
    (warning,) = [each for each in found.warnings if each.code == "colors.not_compared"]
    assert why in warning.words
    assert found.appearance is not None
    assert found.appearance.input == "not_tested"
    assert isinstance(found.appearance.floor, ColorDifference)


def test_a_gate_bounds_the_colour_difference() -> None:
    white = file(HARMFUL["without its texture"])

    for source, verdict in ((ORIGINAL, "pass"), (white, "fail")):
        gates = report(source, ORIGINAL, **GATE).gates
        assert gates is not None
        assert gates.verdict == verdict


def test_comparing_colours_can_be_turned_off() -> None:
    options = {"quality": {**FEW["quality"], "appearance": False}}

    assert report(ORIGINAL, ORIGINAL, **options).appearance is None


def test_a_refinement_says_what_its_colours_were_and_are() -> None:
    arrays = globe()
    arrays["POSITION"] = shapes.noisy(arrays["POSITION"], 0.01).astype("<f4")
    # The seam and the poles stay closed.
    first = np.unique(globe()["POSITION"].round(5), axis=0, return_index=True, return_inverse=True)
    arrays["POSITION"] = arrays["POSITION"][first[1]][first[2].ravel()]
    noisy = file(painted(encoded(SKIN), arrays))

    made = refine(noisy, ORIGINAL, parse_options({**FEW, "effort": "fast"})).report

    assert made.appearance is not None
    assert isinstance(made.appearance.color_difference, ColorDifference)
    assert isinstance(made.appearance.input, ColorDifference)
    assert made.appearance.color_difference != made.appearance.input
    assert made.appearance.color_difference.p95 < 7.4
