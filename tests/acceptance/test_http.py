"""The service as its user sees it: files go in, files and reports come out."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator
from pathlib import Path

import httpx2
import pytest

from meshcone.assets import read_asset
from meshcone.files import MeshFile
from meshcone.verbs.verify import read_report, verify
from service.api.schemas import Job
from service.client import Client, ServiceError
from service.stack import Stack
from tests import shapes
from worker.jobs.identifiers import new_job_id

SentFile = tuple[str, bytes]

TRIANGLE = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


@pytest.fixture
def http(stack: Stack) -> Iterator[httpx2.Client]:
    with httpx2.Client(base_url=stack.url, timeout=60, trust_env=False) as client:
        yield client


@pytest.fixture(scope="module")
def finished(stack: Stack, rough_ball: MeshFile, ball: MeshFile) -> Job:
    """A job that has succeeded."""
    with Client(stack.url) as client:
        return client.wait(client.submit(rough_ball, ball, labels=["the finished one"]).id)


def form(source: SentFile, reference: SentFile) -> dict[str, SentFile]:
    return {"source": source, "reference": reference}


def test_an_obj_comes_back_refined_with_the_same_faces(
    client: Client, rough_ball: MeshFile, ball: MeshFile
) -> None:
    job = client.wait(client.submit(rough_ball, ball).id)

    before, after = (
        read_asset(rough_ball.name, rough_ball.data),
        read_asset("", client.mesh(job.id)),
    )
    quality = client.report(job.id)["quality"]
    assert job.state == "succeeded"
    assert (after.faces == before.faces).all()
    assert (
        quality["refined"]["point_to_surface"]["mean"]
        < 0.5 * quality["input"]["point_to_surface"]["mean"]
    )


def test_a_glb_comes_back_as_a_glb(client: Client, ball: MeshFile) -> None:
    vertices, faces = shapes.sphere()
    source = MeshFile("rough.glb", shapes.glb(shapes.noisy(vertices), faces))

    job = client.wait(client.submit(source, ball).id)

    assert job.state == "succeeded"
    assert client.mesh(job.id)[:4] == b"glTF"


def test_a_gltf_is_refined_with_the_buffer_sent_along(client: Client, ball: MeshFile) -> None:
    vertices, faces = shapes.sphere()
    document, buffer = shapes.gltf(shapes.noisy(vertices), faces, "rough data.bin")
    source = MeshFile("rough.gltf", document, {"rough data.bin": buffer})

    job = client.wait(client.submit(source, ball).id)

    assert job.state == "succeeded"
    assert json.loads(client.mesh(job.id))["asset"]["version"] == "2.0"


def test_options_reach_the_solver(client: Client, rough_ball: MeshFile, ball: MeshFile) -> None:
    options = {"effort": "fast", "surface": {"fairness": [1.0, 0.5]}}
    job = client.wait(client.submit(rough_ball, ball, options).id)

    assert job.options["surface"]["fairness"] == [1.0, 0.5]
    assert len(client.diagnostics(job.id)["rounds"]) == 2


def test_an_accepted_job_says_where_to_look_and_when(
    http: httpx2.Client, rough_ball: MeshFile, ball: MeshFile
) -> None:
    files = form((rough_ball.name, rough_ball.data), (ball.name, ball.data))

    answer = http.post("/v1/jobs", files=files, data={"options": "{}"})

    assert answer.status_code == 202
    assert answer.headers["location"] == answer.json()["links"]["self"]
    assert int(answer.headers["retry-after"]) >= 1
    assert http.get(answer.headers["location"]).json()["id"] == answer.json()["id"]


def test_a_succeeded_job_is_done_in_full(http: httpx2.Client, finished: Job) -> None:
    progress = http.get(f"/v1/jobs/{finished.id}").json()["progress"]

    assert (progress["stage"], progress["fraction"]) == ("done", 1.0)
    assert progress["round"] == progress["rounds"] > 0


def test_a_finished_job_tells_its_story(finished: Job) -> None:
    assert finished.state == "succeeded"
    assert finished.started is not None
    assert finished.finished is not None
    assert finished.created <= finished.started <= finished.finished
    assert finished.error is None
    assert finished.links.mesh == f"/v1/jobs/{finished.id}/mesh"


def test_the_mesh_downloads_under_a_name_of_its_own(http: httpx2.Client, finished: Job) -> None:
    answer = http.get(f"/v1/jobs/{finished.id}/mesh")

    assert answer.headers["content-type"].startswith("model/obj")
    assert 'filename="rough.refined.obj"' in answer.headers["content-disposition"]
    assert answer.headers["x-content-type-options"] == "nosniff"


def test_a_copy_that_is_current_is_not_sent_again(http: httpx2.Client, finished: Job) -> None:
    tag = http.get(f"/v1/jobs/{finished.id}/mesh").headers["etag"]

    answer = http.get(f"/v1/jobs/{finished.id}/mesh", headers={"If-None-Match": tag})

    assert (answer.status_code, answer.content) == (304, b"")


def test_diagnostics_come_as_json_or_as_a_table(http: httpx2.Client, finished: Job) -> None:
    path = f"/v1/jobs/{finished.id}/diagnostics"

    document = http.get(path).json()
    table = http.get(f"{path}.csv")
    negotiated = http.get(path, headers={"Accept": "text/csv"})

    rows = list(csv.DictReader(io.StringIO(table.text)))
    asked = {each["round"] for each in document["rounds"] if each["info"]}
    assert {int(row["round"]) for row in rows} == asked
    assert max(asked) == len(document["rounds"])
    assert table.headers["content-type"].startswith("text/csv")
    assert negotiated.text == table.text


def test_the_certificate_proves_what_was_downloaded(
    client: Client, finished: Job, rough_ball: MeshFile, ball: MeshFile
) -> None:
    verification = verify(
        read_report(json.dumps(client.report(finished.id)).encode(), "report.json"),
        MeshFile("certificate.npz", client.certificate(finished.id)),
        rough_ball,
        ball,
        MeshFile("refined.obj", client.mesh(finished.id)),
    )

    assert [check for check in verification.checks if not check.ok] == []
    assert finished.links.certificate == f"/v1/jobs/{finished.id}/certificate"


def test_the_certificate_downloads_as_the_archive_it_is(http: httpx2.Client, finished: Job) -> None:
    answer = http.get(f"/v1/jobs/{finished.id}/certificate")

    assert answer.headers["content-type"] == "application/zip"
    assert 'filename="rough.report.certificate.npz"' in answer.headers["content-disposition"]


def test_a_kept_input_that_proves_no_closeness_has_no_certificate(
    client: Client, ball: MeshFile
) -> None:
    job = client.wait(client.submit(ball, ball, {"deviation": {"prove": False}}).id)

    with pytest.raises(ServiceError, match="has no certificate") as refusal:
        client.certificate(job.id)

    assert client.mesh(job.id) == ball.data
    assert job.links.certificate is None
    assert refusal.value.problem.status == 404


def test_the_list_shows_the_newest_first(client: Client, finished: Job) -> None:
    [newest] = client.jobs(limit=1).jobs

    assert newest.created >= finished.created
    assert [job.id for job in client.jobs(label="the finished one").jobs] == [finished.id]
    assert finished.id in [job.id for job in client.jobs(state="succeeded").jobs]
    assert finished.id not in [job.id for job in client.jobs(state="failed").jobs]


def test_a_list_can_be_walked_page_by_page(
    client: Client, rough_ball: MeshFile, ball: MeshFile
) -> None:
    label = new_job_id()
    sent = [
        client.submit(rough_ball, ball, {"mode": "measure"}, labels=[label]).id for _ in range(3)
    ]
    everything = [job.id for job in client.jobs(limit=200, label=label).jobs]
    assert sorted(everything) == sorted(sent)
    walked: list[str] = []
    page = client.jobs(limit=1, label=label)
    while len(walked) <= len(everything):
        walked += [job.id for job in page.jobs]
        if page.next is None:
            break
        page = client.jobs(limit=1, label=label, cursor=page.next)

    assert walked == everything


def test_results_of_an_unknown_job_are_not_found(client: Client) -> None:
    with pytest.raises(ServiceError) as refusal:
        client.mesh(new_job_id())

    assert refusal.value.problem.status == 404


def test_results_of_a_failed_job_are_a_conflict_that_says_why(
    client: Client, ball: MeshFile
) -> None:
    # Too large for the front end to read; the worker finds that there is nothing in it.
    job = client.wait(client.submit(MeshFile("blank.obj", b"\n" * 16 * 2**20), ball).id)

    with pytest.raises(ServiceError) as refusal:
        client.mesh(job.id)

    problem = refusal.value.problem
    assert job.state == "failed"
    assert (problem.status, problem.type) == (409, "urn:meshcone:problem:job-failed")
    assert problem.error is not None
    assert (problem.error.kind, problem.error.file) == ("input", "blank.obj")


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("notes.obj", b"Dear diary,\n", ""),
        ("empty.obj", b"", "empty"),
        ("nan.obj", b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "finite"),
        ("points.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "no faces"),
        ("photo.glb", b"\x89PNG\r\n\x1a\n", "PNG"),
        ("cut.glb", b"glTF\x02\x00\x00\x00\xff\xff\x00\x00", ""),
    ],
)
@pytest.mark.parametrize("field", ["source", "reference"])
def test_a_file_that_is_no_mesh_is_refused_and_leaves_nothing_behind(
    client: Client, data_dir: Path, field: str, name: str, content: bytes, said: str
) -> None:
    bad, good = MeshFile(name, content), MeshFile("good.obj", TRIANGLE)
    before = everything_kept(client, data_dir)

    with pytest.raises(ServiceError) as refusal:
        client.submit(*((bad, good) if field == "source" else (good, bad)))

    problem = refusal.value.problem
    assert 400 <= problem.status < 500
    assert (problem.kind, problem.file) == ("input", name)
    assert said in problem.detail
    assert "\n" not in problem.detail
    assert everything_kept(client, data_dir) == before


def test_a_missing_resource_is_named_and_leaves_nothing_behind(
    client: Client, data_dir: Path, ball: MeshFile
) -> None:
    document, _ = shapes.gltf(*shapes.sphere(1), "ball.bin")
    before = everything_kept(client, data_dir)

    with pytest.raises(ServiceError, match=r"'ball\.bin', which was not sent") as refusal:
        client.submit(MeshFile("ball.gltf", document), ball)

    assert refusal.value.problem.status == 422
    assert everything_kept(client, data_dir) == before


@pytest.mark.parametrize(
    "fields", [{"options": "[]"}, {"options": '{"sed": 1}'}, {"options": "nope"}]
)
def test_bad_options_leave_nothing_behind(
    http: httpx2.Client, client: Client, data_dir: Path, fields: dict[str, str]
) -> None:
    mesh = ("good.obj", TRIANGLE)
    before = everything_kept(client, data_dir)

    answer = http.post("/v1/jobs", files=form(mesh, mesh), data=fields)

    assert answer.status_code == 422
    assert answer.headers["content-type"] == "application/problem+json"
    assert "option" in answer.json()["detail"]
    assert everything_kept(client, data_dir) == before


def everything_kept(client: Client, data_dir: Path) -> tuple[list[str], list[Path]]:
    blobs = sorted(path for path in (data_dir / "blobs").rglob("*") if path.is_file())
    return [job.id for job in client.jobs(limit=200).jobs], blobs
