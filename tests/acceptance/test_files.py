"""Files that need a choice, sent to the service."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from meshcone.assets import read_asset
from meshcone.files import MeshFile
from service.client import Client, ServiceError
from tests import shapes
from tests.archives import packed, unpacked
from tests.cad import step_ball
from tests.unit.assets.builders import Gltf, compress


@pytest.fixture(scope="module")
def two_balls() -> Gltf:
    """A noisy ball at two nodes, named left and right."""
    vertices, faces = shapes.sphere(2)
    gltf = Gltf()
    attributes = {"POSITION": gltf.accessor(shapes.noisy(vertices).astype("f4"))}
    indices = gltf.accessor(faces.reshape(-1).astype("u2"))
    mesh = gltf.mesh({"attributes": attributes, "indices": indices}, name="ball")
    gltf.node(mesh=mesh, name="left")
    gltf.node(mesh=mesh, name="right", translation=[6, 0, 0])
    return gltf


@pytest.fixture(scope="module")
def reference() -> MeshFile:
    vertices, faces = shapes.sphere(3)
    both = np.concatenate([vertices, vertices + np.array([6, 0, 0])])
    return MeshFile("two.obj", shapes.obj(both, np.concatenate([faces, faces + len(vertices)])))


def test_a_shared_mesh_is_refused_at_once_or_split_as_asked(
    client: Client, two_balls: Gltf, reference: MeshFile
) -> None:
    source = MeshFile("two.glb", two_balls.glb())

    with pytest.raises(ServiceError, match="set instances=split"):
        client.submit(source, reference, {"instances": "refuse"})
    options = {"effort": "fast", "instances": "split", "select": {"nodes": ["ri*"]}}
    job = client.wait(client.submit(source, reference, options).id)

    before, after = (read_asset("", data) for data in (source.data, client.mesh(job.id)))
    moved = (before.positions != after.positions).any(axis=1)
    assert not moved[: len(moved) // 2].any()
    assert moved[len(moved) // 2 :].all()


def test_a_part_that_is_not_there_is_refused_at_once(
    client: Client, two_balls: Gltf, reference: MeshFile
) -> None:
    options = {"select": {"materials": ["steel"]}}

    with pytest.raises(ServiceError, match=r"select\.materials.*'steel'"):
        client.submit(MeshFile("two.glb", two_balls.glb()), reference, options)


def test_a_compressed_file_comes_back_plain(client: Client, data_dir: Path, ball: MeshFile) -> None:
    vertices, faces = shapes.sphere(2)
    gltf = Gltf()
    attributes = {"POSITION": gltf.accessor(shapes.noisy(vertices).astype("f4"))}
    indices = gltf.accessor(faces.reshape(-1).astype("u2"))
    gltf.node(mesh=gltf.mesh({"attributes": attributes, "indices": indices}))
    source = MeshFile("draco.glb", compress(gltf).glb())

    job = client.wait(client.submit(source, ball, {"effort": "fast"}).id)

    assert job.state == "succeeded", (data_dir / "service.log").read_text()
    assert b"KHR_draco" not in client.mesh(job.id)
    assert any("plain buffers" in each["words"] for each in client.report(job.id)["warnings"])


def test_an_archive_is_sent_refined_and_fetched_as_one_file(client: Client, ball: MeshFile) -> None:
    vertices, faces = shapes.sphere(2)
    text, binary = shapes.gltf(shapes.noisy(vertices), faces, "data/rough.bin")
    files = {"m/rough.gltf": text, "m/data/rough.bin": binary, "about.txt": b"made by a test"}

    job = client.wait(client.submit(MeshFile("m.zip", packed(files)), ball, {"effort": "fast"}).id)

    assert job.state == "succeeded"
    after = unpacked(client.mesh(job.id))
    assert {name for name in files if files[name] != after[name]} == {"m/rough.gltf"}
    assert client.report(job.id)["inputs"]["source"]["member"] == "m/rough.gltf"


def test_an_archive_of_several_meshes_is_refused_at_once_until_one_is_named(
    client: Client, ball: MeshFile
) -> None:
    mesh = shapes.obj(*shapes.sphere(1))
    source = MeshFile("two.zip", packed({"a.obj": mesh, "b.obj": mesh}))

    with pytest.raises(ServiceError, match=r"several meshes: 'a\.obj', 'b\.obj'"):
        client.submit(source, ball)
    assert client.submit(source, ball, {"mode": "measure", "member": "b.obj"}).id


def test_a_scan_is_measured_against_a_step(client: Client) -> None:
    scan = MeshFile("scan.obj", shapes.obj(*shapes.sphere(2, 20.0)))
    options = {"mode": "measure", "of_reference": {"chord": 0.5}}

    job = client.wait(client.submit(scan, MeshFile("b.step", step_ball(20.0)), options).id)

    assert job.state == "succeeded"
    assert client.report(job.id)["inputs"]["reference"]["tolerance"] == 0.5
    with pytest.raises(ServiceError, match="a STEP file: it can be a reference"):
        client.submit(MeshFile("b.step", step_ball(20.0)), scan)
