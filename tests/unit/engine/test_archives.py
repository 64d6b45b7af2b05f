"""Pairs that come in ZIP archives."""

from __future__ import annotations

import json

import numpy as np
import pytest

from meshcone.assets import read_asset
from meshcone.errors import InputError
from meshcone.files import MeshFile
from meshcone.options import parse_options
from meshcone.verbs.audit import audit
from meshcone.verbs.measure import measure
from meshcone.verbs.refine import Refinement, refine
from meshcone.verbs.verify import verify
from tests import shapes
from tests.archives import packed, unpacked

VERTICES, FACES = shapes.sphere(2)
ROUGH = shapes.obj(shapes.noisy(VERTICES), FACES)
QUICK = {"effort": "fast", "quality": {"samples": 400, "emd_samples": 40}}


def archive(name: str, mesh: bytes) -> MeshFile:
    files = {"notes.txt": b"words", "one/ball.obj": mesh, "two/ball.obj": shapes.obj(*BOX)}
    return MeshFile(name, packed(files))


BOX = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]])


@pytest.fixture(scope="module")
def pair() -> tuple[MeshFile, MeshFile]:
    return archive("rough.zip", ROUGH), archive("ball.zip", shapes.obj(VERTICES, FACES))


@pytest.fixture(scope="module")
def refinement(pair: tuple[MeshFile, MeshFile]) -> Refinement:
    return refine(*pair, parse_options({**QUICK, "member": "one/ball.obj"}))


def test_the_answer_is_what_the_mesh_alone_gives_in_its_archive(refinement: Refinement) -> None:
    alone = refine(
        MeshFile("rough.obj", ROUGH),
        MeshFile("ball.obj", shapes.obj(VERTICES, FACES)),
        parse_options(QUICK),
    )

    after = unpacked(refinement.data)

    assert (refinement.name, refinement.media_type) == ("rough.refined.zip", "application/zip")
    assert after["one/ball.obj"] == alone.data
    assert after["notes.txt"] == b"words"
    assert refinement.report.inputs.source.member == "one/ball.obj"
    assert refinement.report.inputs.source.format == "obj"


def test_an_archive_that_was_refined_is_verified(
    pair: tuple[MeshFile, MeshFile], refinement: Refinement
) -> None:
    assert refinement.certificate is not None
    certificate = MeshFile("certificate", refinement.certificate)
    files = (certificate, *pair, MeshFile(refinement.name, refinement.data))

    assert verify(refinement.report, *files).ok
    other = files[-1].data.replace(b"made by a test", b"made by a fake")
    assert not verify(refinement.report, *files[:-1], MeshFile("other.zip", other)).ok


def test_a_reference_has_a_name_of_its_own_where_it_is_given_one(
    pair: tuple[MeshFile, MeshFile],
) -> None:
    options = {**QUICK, "member": "one/ball.obj", "of_reference": {"member": "two/ball.obj"}}

    report = measure(*pair, parse_options(options))

    assert report.inputs.reference.faces == 1
    with pytest.raises(InputError, match=r"ball\.zip.*has no 'three\.obj'"):
        measure(
            *pair,
            parse_options({**options, "of_reference": {"member": "three.obj"}}),
        )


def test_an_audit_sees_the_images_in_the_archive() -> None:
    from tests.painted import encoded, picture

    text, binary = shapes.gltf(VERTICES, FACES, "ball.bin")
    document = json.loads(text)
    document["images"] = [{"uri": "wood.png"}]
    document["textures"] = [{"source": 0}]
    files = {
        "m/ball.gltf": json.dumps(document).encode(),
        "m/ball.bin": binary,
        "m/wood.png": encoded(picture(64, 32)),
    }

    report = audit(MeshFile("m.zip", packed(files)), None, parse_options({"mode": "audit"}))

    assert report.asset.source.textures.names == ("wood.png",)
    assert report.asset.source.budget.file_bytes == len(files["m/ball.gltf"])
    assert not any(each.code == "textures.missing" for each in report.warnings)
    assert read_asset("m.zip", packed(files)).file.resources["wood.png"] == files["m/wood.png"]
