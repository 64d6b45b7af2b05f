"""Jobs whose files are where a pipeline keeps them."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import httpx2

from meshcone.files import MeshFile
from service.client import Client, LinkedFile, OutputPlace
from service.stack import Stack
from tests.acceptance.test_submit import meshcone
from tests.integration.file_server import FileServer
from tests.integration.waiting import wait_for

MEASURE = {"mode": "measure", "quality": {"samples": 256, "emd_samples": 64}}


def sent(stack: Stack, document: dict[str, Any]) -> dict[str, Any]:
    with httpx2.Client(base_url=stack.url, timeout=60, trust_env=False) as http:
        answer = http.post("/v1/jobs", json=document)
        assert answer.status_code == 202, answer.text
        with Client(stack.url) as client:
            ended = client.wait(answer.json()["id"])
        job: dict[str, Any] = http.get(f"/v1/jobs/{ended.id}").json()
        return job


def test_a_pair_is_measured_from_where_it_is_and_its_report_put_where_it_is_wanted(
    fetching: Stack, server: FileServer, rough_ball: MeshFile, ball: MeshFile
) -> None:
    source = server.has("/a/rough.obj", rough_ball.data) + "?signature=3f9a"

    job = sent(
        fetching,
        {
            "source": {"url": source},
            "reference": {
                "url": server.has("/b/ball.obj", ball.data),
                "sha256": hashlib.sha256(ball.data).hexdigest(),
            },
            "options": MEASURE,
            "labels": ["nightly"],
            "outputs": {"report": {"url": server.has("/out/report.json", b"") + "?signature=9d0c"}},
        },
    )

    with Client(fetching.url) as client:
        report = client.report(job["id"])
        wait_for(lambda: client.job(job["id"]).outputs["report"].state == "delivered")
        put = server.seen[-1]
        assert (put.method, put.body) == ("PUT", client.report_bytes(job["id"]))
        assert client.job(job["id"]).outputs["report"].url == f"{server.url}/out/report.json"
    assert job["state"] == "succeeded"
    assert job["source"]["url"] == f"{server.url}/a/rough.obj"
    assert job["source"]["sha256"] == hashlib.sha256(rough_ball.data).hexdigest()
    assert report["inputs"]["source"]["sha256"] == job["source"]["sha256"]
    assert report["inputs"]["source"]["name"] == "rough.obj"


def test_the_command_line_and_a_manifest_take_urls(
    fetching: Stack, server: FileServer, rough_ball: MeshFile, ball: MeshFile, tmp_path: Path
) -> None:
    source = server.has("/a/rough.obj", rough_ball.data)
    reference = server.has("/a/ball.obj", ball.data)
    options = ("--set", "quality.samples=256", "--set", "quality.emd_samples=64")
    report = tmp_path / "report.json"
    (tmp_path / "pairs.json").write_text(json.dumps([{"source": source, "reference": reference}]))
    (tmp_path / "gates.toml").write_text('[gates]\n"quality.input.fscore" = { min = 0.0 }\n')

    place = server.has("/out/report.json", b"")

    submitted = meshcone(
        *("submit", source, reference, "--server", fetching.url, "--report", str(report)),
        *("--set", "mode=measure", "--put", f"report={place}", *options),
    )
    gated = meshcone(
        *("gate", "--manifest", str(tmp_path / "pairs.json")),
        *("--gates", str(tmp_path / "gates.toml"), "--server", fetching.url, *options),
    )
    local = meshcone(
        *("gate", "--manifest", str(tmp_path / "pairs.json")),
        *("--gates", str(tmp_path / "gates.toml"), *options),
    )

    assert submitted.returncode == 0, submitted.stderr
    assert json.loads(report.read_text())["inputs"]["source"]["name"] == "rough.obj"
    wait_for(lambda: any(each.method == "PUT" for each in server.seen))
    [sent_there] = [each.body for each in server.seen if each.method == "PUT"]
    assert json.loads(sent_there) == json.loads(report.read_text())
    assert gated.returncode == 0, gated.stdout + gated.stderr
    assert local.returncode != 0
    assert "only a service fetches" in local.stdout + local.stderr


def test_the_client_has_files_fetched_and_results_put(
    fetching: Stack, server: FileServer, rough_ball: MeshFile, ball: MeshFile
) -> None:
    source = LinkedFile(url=server.has("/a/rough.obj", rough_ball.data))
    place = OutputPlace(url=server.has("/out/report.json", b""))

    with Client(fetching.url) as client:
        job = client.submit(source, ball, MEASURE, outputs={"report": place})
        done = client.wait(job.id)

        assert done.state == "succeeded"
        assert done.reference is not None
        assert done.reference.url is None
        wait_for(lambda: client.job(job.id).outputs["report"].state == "delivered")


def test_a_file_that_is_not_there_fails_its_job_in_words(
    fetching: Stack, server: FileServer
) -> None:
    job = sent(fetching, {"source": {"url": f"{server.url}/mug.obj"}, "options": {"mode": "audit"}})

    assert job["state"] == "failed"
    assert job["source"]["sha256"] is None
    assert job["error"]["type"] == "urn:meshcone:problem:input"
    assert job["error"]["file"] == "mug.obj"
    assert "answered 404" in job["error"]["detail"]
    again = httpx2.get(f"{fetching.url}/v1/jobs/{job['id']}/source", trust_env=False, timeout=60)
    assert again.status_code == 404
    assert again.json()["detail"] == "the file has not been fetched"


def test_a_file_of_this_machine_is_none_of_a_senders_business(
    stack: Stack, server: FileServer, tmp_path: Path
) -> None:
    (tmp_path / "mug.obj").write_bytes(b"v 0 0 0\n")
    for url in (server.has("/mug.obj", b""), f"file://{tmp_path}/mug.obj", "https://[::1]/mug.obj"):
        document = {"source": {"url": url}, "options": {"mode": "audit"}}

        answer = httpx2.post(f"{stack.url}/v1/jobs", json=document, trust_env=False, timeout=60)

        assert answer.status_code == 422
    assert server.seen == []


def test_a_shell_names_secrets_and_hashes_of_what_is_fetched(
    fetching: Stack, server: FileServer, ball: MeshFile, tmp_path: Path
) -> None:
    url, report = server.has("/ball.obj", ball.data), tmp_path / "report.json"
    sent = ("submit", url, url, "--server", fetching.url, "--set", "mode=measure")
    sound = hashlib.sha256(ball.data).hexdigest()

    right = meshcone(*sent, "--reference-sha256", sound, "--report", str(report))
    wrong = meshcone(*sent, "--source-sha256", "0" * 64, "--report", str(report))
    unknown = meshcone(*sent, "--source-secret", "nobody")

    assert right.returncode == 0, right.stderr
    assert wrong.returncode != 0
    assert f"their SHA-256 is {sound}" in wrong.stderr
    assert unknown.returncode != 0
    assert "nobody" in unknown.stderr


def test_the_client_takes_a_url_where_it_takes_a_path(
    fetching: Stack, server: FileServer, ball: MeshFile
) -> None:
    url = server.has("/ball.obj", ball.data)

    with Client(fetching.url) as client:
        job = client.wait(client.submit(url, LinkedFile(url=url), MEASURE).id)

    assert (job.state, job.source.url) == ("succeeded", url)
