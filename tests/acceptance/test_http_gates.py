"""Jobs that measure, and jobs with gates, over HTTP."""

from __future__ import annotations

from collections.abc import Iterator

import httpx2
import pytest

from meshcone.files import MeshFile
from service.api.schemas import Job
from service.client import Client, ServiceError
from service.stack import Stack
from tests import shapes

GATES = {
    "point_to_surface.max": {"max_model": 1e-3, "unit": "mm"},
    "validity.watertight": {"equals": True},
}


@pytest.fixture(scope="module")
def measured(stack: Stack, rough_ball: MeshFile, ball: MeshFile) -> Job:
    """A job that measured and was held against gates."""
    options = {"mode": "measure", "gates": GATES}
    with Client(stack.url) as client:
        return client.wait(client.submit(rough_ball, ball, options).id)


@pytest.fixture
def http(stack: Stack) -> Iterator[httpx2.Client]:
    with httpx2.Client(base_url=stack.url, timeout=60, trust_env=False) as client:
        yield client


def test_a_measurement_has_a_report_and_views_of_its_input(
    http: httpx2.Client, measured: Job
) -> None:
    links = http.get(f"/v1/jobs/{measured.id}").json()["links"]

    assert measured.state == "succeeded"
    assert {name for name, link in links.items() if link} == {
        "self",
        "events",
        "report",
        "heatmap",
        "preview",
        "thumbnail",
    }
    for result in ("mesh", "certificate", "diagnostics", "diagnostics.csv"):
        answer = http.get(f"/v1/jobs/{measured.id}/{result}")
        assert answer.status_code == 404
        assert answer.json()["detail"].endswith("it measured and refined nothing")


def test_its_report_is_a_measurement_with_a_verdict(client: Client, measured: Job) -> None:
    report = client.report(measured.id)

    gates = report["gates"]
    assert report["schema"] == "meshcone.report/2"
    assert report["options"]["mode"] == "measure"
    assert [check["status"] for check in gates["checks"]] == ["fail", "pass"]
    assert gates["verdict"] == "fail"
    assert gates["checks"][0]["words"].endswith("allowed 0.001 mm")
    assert gates["checks"][0]["position"] == report["quality"]["worst_points"][0]["position"]


def test_a_refinement_is_judged_by_what_it_wrote(
    client: Client, rough_ball: MeshFile, ball: MeshFile
) -> None:
    gates = {"point_to_surface.mean": {"max_ratio_to_input": 0.5}}
    job = client.wait(client.submit(rough_ball, ball, {"effort": "fast", "gates": gates}).id)

    verdict = client.report(job.id)["gates"]
    assert verdict["verdict"] == "pass"
    assert verdict["checks"][0]["path"] == "quality.refined.point_to_surface.mean"


def test_a_report_without_gates_has_no_verdict(
    client: Client, rough_ball: MeshFile, ball: MeshFile
) -> None:
    job = client.wait(client.submit(rough_ball, ball, {"mode": "measure"}).id)

    assert client.report(job.id)["gates"] is None


def test_what_can_only_be_read_can_be_measured(client: Client, ball: MeshFile) -> None:
    vertices, faces = shapes.sphere(2)
    rows = [f"{len(vertices)} {len(faces)} 0"]
    rows += [f"{x} {y} {z}" for x, y, z in vertices] + [f"3 {a} {b} {c}" for a, b, c in faces]
    source = MeshFile("ball.off", "\n".join(["OFF", *rows]).encode())

    job = client.wait(client.submit(source, ball, {"mode": "measure"}).id)

    assert job.state == "succeeded"


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"gates": {"fscor": {"min": 1}}}, "unknown gate 'fscor'; did you mean 'fscore'?"),
        ({"gates": {"fscore": {"mim": 1}}}, "did you mean 'gates.fscore.min'?"),
        ({"gates": {"fscore": {"max_model": 1}}}, "'max_model' is for distances"),
        (
            {"mode": "measure", "gates": {"solver.iterations": {"max": 1}}},
            "only a refinement has this value",
        ),
        ({"mode": "measur"}, "'refine', 'measure' or 'audit'"),
    ],
)
def test_gates_that_cannot_be_meant_are_refused_at_once(
    client: Client, ball: MeshFile, options: dict[str, object], said: str
) -> None:
    with pytest.raises(ServiceError) as refusal:
        client.submit(ball, ball, options)

    assert refusal.value.problem.status == 422
    assert said in refusal.value.problem.detail
