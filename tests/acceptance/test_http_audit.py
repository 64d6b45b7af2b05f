"""Jobs that audit, over HTTP."""

from __future__ import annotations

import pytest

from meshcone.files import MeshFile
from service.client import Client, ServiceError
from tests.whole_asset import whole


def files() -> tuple[MeshFile, MeshFile]:
    """An asset that has lost its animation, and what it should be like."""
    document = whole()
    master = MeshFile("master.gltf", document.to_bytes())
    del document.json["animations"]
    return MeshFile("asset.gltf", document.to_bytes()), master


def test_an_asset_is_audited_by_itself(client: Client) -> None:
    source, _ = files()
    options = {"mode": "audit", "gates": {"asset.budget.triangles": {"max": 4}}}

    job = client.wait(client.submit(source, None, options).id)

    report = client.report(job.id)
    assert (job.state, job.mode, job.verdict, job.reference) == ("succeeded", "audit", "pass", None)
    assert (report["schema"], report["mode"]) == ("meshcone.report/2", "audit")
    assert report["asset"]["source"]["budget"]["triangles"] == 4
    assert report["asset"]["reference"] is report["changes"] is None
    assert job.summary is not None
    assert job.summary.worst is not None
    assert job.links.mesh is job.links.preview is None
    assert client.thumbnail(job.id)[8:12] == b"WEBP"


def test_an_audit_against_a_reference_says_what_was_lost(client: Client) -> None:
    options = {"mode": "audit", "gates": {"changes.lost.animations": {"max": 0}}}

    job = client.wait(client.submit(*files(), options).id)

    assert job.verdict == "fail"
    assert job.reference is not None
    assert client.report(job.id)["changes"]["lost"]["animations"] == 1


def test_the_same_key_with_and_without_a_reference_is_another_request(client: Client) -> None:
    source, master = files()
    options = {"mode": "audit"}
    client.submit(source, None, options, resources=[master], idempotency_key="with-or-without")

    with pytest.raises(ServiceError, match="belongs to a request with other content"):
        client.submit(source, master, options, idempotency_key="with-or-without")


def test_an_audit_has_no_mesh_and_says_so(client: Client) -> None:
    source, _ = files()
    job = client.wait(client.submit(source, None, {"mode": "audit"}).id)

    with pytest.raises(ServiceError, match="it audited and refined nothing"):
        client.mesh(job.id)
