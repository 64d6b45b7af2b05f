"""Batches over HTTP, without workers: what is accepted, refused, listed, and whose it is."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient

from service.access.keys import KeyStore
from service.api.app import create_app
from service.settings import ServiceSettings
from worker.broker.connections import connect_text
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.batches import Batches

PAIR = {
    "source": {"url": "https://assets.example.org/mug.glb"},
    "reference": {"url": "https://assets.example.org/scan.glb"},
}
MEASURE = {"mode": "measure"}


@pytest.fixture
def broker(tmp_path: Path) -> Iterator[EmbeddedBroker]:
    with EmbeddedBroker(tmp_path) as started:
        yield started


@pytest.fixture
def settings(broker: EmbeddedBroker, tmp_path: Path) -> ServiceSettings:
    return ServiceSettings(redis_url=broker.url, data_dir=tmp_path, batch_pairs=250)


@pytest.fixture
def http(settings: ServiceSettings) -> Iterator[TestClient]:
    with TestClient(create_app(settings, keys_required=False), "http://127.0.0.1:8000") as client:
        yield client


def sent(http: TestClient, pairs: list[Any], **more: Any) -> dict[str, Any]:
    answer = http.post("/v1/batches", json={"options": MEASURE, "pairs": pairs, **more})
    assert answer.status_code == 202, answer.text
    batch: dict[str, Any] = answer.json()
    assert answer.headers["location"] == batch["links"]["self"]
    return batch


def refused(http: TestClient, document: Any) -> tuple[int, str]:
    answer = http.post("/v1/batches", json=document)
    assert http.get("/v1/batches").json()["batches"] == []
    return answer.status_code, answer.json()["detail"]


def test_a_batch_is_accepted_and_its_jobs_wait_in_the_order_of_the_pairs(http: TestClient) -> None:
    names = [f"mug-{number}" for number in range(205)]

    batch = sent(http, [{**PAIR, "name": name} for name in names], name="nightly", labels=["a"])

    path = batch["links"]["self"]
    now = http.get(path).json()
    first = http.get(f"{path}/jobs", params={"limit": 200}).json()
    rest = http.get(f"{path}/jobs", params={"limit": 200, "cursor": first["next"]}).json()
    jobs = first["jobs"] + rest["jobs"]
    assert (now["state"], now["name"], now["pairs"]) == ("running", "nightly", 205)
    assert now["counts"]["queued"] == 205
    assert [job["name"] for job in jobs] == names[::-1]
    assert {job["batch"] for job in jobs} == {batch["id"]}
    assert {(job["mode"], *job["labels"]) for job in jobs} == {("measure", "a")}
    assert rest["next"] is None


def test_what_a_pair_sets_goes_before_what_the_batch_sets(http: TestClient) -> None:
    batch = sent(
        http,
        [
            PAIR,
            {
                **PAIR,
                "labels": ["b"],
                "options": {"mode": "refine", "gates": {"chamfer": {"max": 1}}},
            },
        ],
        labels=["a"],
        gates={"hausdorff": {"max": 0.1}},
        options={"mode": "measure", "quality": {"samples": 256}},
    )

    jobs = http.get(batch["links"]["jobs"]).json()["jobs"][::-1]
    options = [http.get(f"/v1/jobs/{job['id']}").json()["options"] for job in jobs]
    assert [job["labels"] for job in jobs] == [["a"], ["a", "b"]]
    assert options == [
        {"mode": "measure", "quality": {"samples": 256}, "gates": {"hausdorff": {"max": 0.1}}},
        {"mode": "refine", "quality": {"samples": 256}, "gates": {"chamfer": {"max": 1}}},
    ]


def test_the_name_of_a_pair_is_that_of_its_source_by_default(http: TestClient) -> None:
    batch = sent(http, [PAIR])

    [job] = http.get(batch["links"]["jobs"]).json()["jobs"]
    assert job["name"] == "mug.glb"


def test_files_are_named_by_the_hash_under_which_they_were_sent(http: TestClient) -> None:
    data = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    digest = hashlib.sha256(data).hexdigest()
    http.put(f"/v1/blobs/{digest}", content=data)
    file = {"name": "tri.obj", "sha256": digest}

    batch = sent(http, [{"source": file, "reference": file}] * 3)

    jobs = http.get(batch["links"]["jobs"]).json()["jobs"]
    assert [job["source"]["size"] for job in jobs] == [len(data)] * 3
    assert http.get(jobs[0]["source"]["link"]).content == data


@pytest.mark.parametrize(
    ("document", "said"),
    [
        ([], "not a JSON object of a batch"),
        ({}, "a list with a pair at least"),
        ({"pairs": []}, "a list with a pair at least"),
        ({"pairs": {"source": 1}}, "a list with a pair at least"),
        ({"pairs": [PAIR], "option": {}}, "unknown field 'option'"),
        ({"pairs": [PAIR, 1]}, r"pairs[1]: a pair is a JSON object"),
        ({"pairs": [PAIR, {}]}, "pairs[1]: field 'source'"),
        ({"pairs": [{**PAIR, "name": ""}]}, "pairs[0]: field 'name'"),
        ({"pairs": [PAIR], "options": {"mode": "polish"}}, "pairs[0]: "),
        ({"pairs": [{**PAIR, "options": {"efort": 1}}]}, "pairs[0]: "),
        ({"pairs": [PAIR, {"source": {"url": "https://10.0.0.1/a.glb"}}]}, "pairs[1]: "),
        ({"pairs": [{"source": PAIR["source"]}]}, "reference"),
        ({"pairs": [PAIR], "webhook": "https://ci.example.org"}, "nothing to sign the webhook"),
        ({"pairs": [PAIR], "gates": {}, "options": {"gates": {}}}, "leave one of them out"),
        (
            {"pairs": [PAIR, {**PAIR, "source": {"name": "a.obj", "sha256": "0" * 64}}]},
            "pairs[1]: there is no file with the SHA-256",
        ),
    ],
)
def test_one_bad_pair_refuses_the_whole_batch_and_is_named(
    http: TestClient, document: Any, said: str
) -> None:
    status, detail = refused(http, document)

    assert status == 422
    assert said in detail
    assert http.get("/v1/jobs").json()["jobs"] == []


def test_too_many_pairs_are_refused(http: TestClient) -> None:
    status, detail = refused(http, {"options": MEASURE, "pairs": [PAIR] * 251})

    assert (status, "MESHCONE_BATCH_PAIRS" in detail) == (413, True)


def test_a_document_that_is_too_long_is_refused_while_it_comes(
    broker: EmbeddedBroker, tmp_path: Path
) -> None:
    small = ServiceSettings(redis_url=broker.url, data_dir=tmp_path, batch_bytes=1000)
    with TestClient(create_app(small, keys_required=False), "http://127.0.0.1:8000") as http:
        status, detail = refused(http, {"pairs": [PAIR] * 20})

    assert (status, "MESHCONE_BATCH_BYTES" in detail) == (413, True)


def test_options_of_all_that_are_long_for_each_pair_are_refused(settings: ServiceSettings) -> None:
    document = {"options": {"cones": {"pin": {"vertices": [*range(500)]}}}, "pairs": [PAIR] * 10}
    small = settings.model_copy(update={"batch_bytes": 6000})
    with TestClient(create_app(small, keys_required=False), "http://127.0.0.1:8000") as http:
        status, detail = refused(http, document)

    assert (status, "2 times MESHCONE_BATCH_BYTES" in detail) == (413, True)


def test_what_is_no_json_is_another_media_type(http: TestClient) -> None:
    answer = http.post("/v1/batches", content=b"pairs", headers={"Content-Type": "text/plain"})

    assert answer.status_code == 415


def test_a_batch_for_which_the_queue_has_no_room_is_refused(
    broker: EmbeddedBroker, tmp_path: Path
) -> None:
    small = ServiceSettings(redis_url=broker.url, data_dir=tmp_path, queue_capacity=2)
    with TestClient(create_app(small, keys_required=False), "http://127.0.0.1:8000") as http:
        answer = http.post("/v1/batches", json={"options": MEASURE, "pairs": [PAIR] * 3})
        fitting = http.post("/v1/batches", json={"options": MEASURE, "pairs": [PAIR] * 2})

    assert (answer.status_code, answer.json()["type"]) == (503, "urn:meshcone:problem:queue-full")
    assert fitting.status_code == 202


class TestRepeating:
    HEADERS = {"Idempotency-Key": "night-7", "Content-Type": "application/json"}  # noqa: RUF012

    def test_the_same_content_is_one_batch_however_it_is_spelled(self, http: TestClient) -> None:
        document = {"options": MEASURE, "pairs": [PAIR] * 3}

        first = http.post("/v1/batches", content=json.dumps(document), headers=self.HEADERS)
        again = http.post(
            "/v1/batches", content=json.dumps(document, indent=2), headers=self.HEADERS
        )

        assert first.json()["id"] == again.json()["id"]
        assert len(http.get("/v1/jobs").json()["jobs"]) == 3

    def test_other_content_is_refused(self, http: TestClient) -> None:
        first = {"options": MEASURE, "pairs": [PAIR]}
        http.post("/v1/batches", json=first, headers=self.HEADERS)

        answer = http.post("/v1/batches", json={**first, "name": "b"}, headers=self.HEADERS)

        assert answer.json()["type"] == "urn:meshcone:problem:key-reused"

    def test_a_key_of_a_job_is_no_key_of_a_batch(self, http: TestClient) -> None:
        http.post("/v1/jobs", json=PAIR, headers=self.HEADERS)

        answer = http.post("/v1/batches", json={"pairs": [PAIR]}, headers=self.HEADERS)

        assert answer.json()["type"] == "urn:meshcone:problem:key-reused"


class TestEnding:
    def test_a_canceled_batch_has_finished_and_its_result_says_so(self, http: TestClient) -> None:
        batch = sent(http, [PAIR] * 120)
        unfinished = http.get(batch["links"]["result"])

        canceled = http.post(batch["links"]["cancel"])

        now = http.get(batch["links"]["self"]).json()
        result = http.get(batch["links"]["result"]).json()
        assert (unfinished.status_code, canceled.status_code) == (409, 202)
        assert (now["state"], now["verdict"]) == ("finished", "error")
        assert now["counts"]["canceled"] == 120
        assert result["counts"]["error"] == 120
        assert http.post(batch["links"]["cancel"]).status_code == 409

    def test_deleting_a_batch_deletes_its_jobs(self, http: TestClient) -> None:
        batch = sent(http, [PAIR] * 3)
        running = http.delete(batch["links"]["self"])
        http.post(batch["links"]["cancel"])

        deleted = http.delete(batch["links"]["self"])

        assert (running.status_code, deleted.status_code) == (409, 204)
        assert http.get(batch["links"]["self"]).status_code == 404
        assert http.get("/v1/batches").json() == {"batches": [], "next": None}
        assert http.get("/v1/jobs").json()["jobs"] == []

    def test_a_list_shows_the_newest_first(self, http: TestClient) -> None:
        made = [sent(http, [PAIR], name=name)["id"] for name in "abc"]

        first = http.get("/v1/batches", params={"limit": 2}).json()
        rest = http.get("/v1/batches", params={"cursor": first["next"]}).json()

        assert [each["id"] for each in first["batches"] + rest["batches"]] == made[::-1]


class TestKeys:
    """A batch belongs to the project of the key it was sent with."""

    @pytest.fixture
    def keyed(self, settings: ServiceSettings) -> Iterator[TestClient]:
        with TestClient(create_app(settings), "http://127.0.0.1:8000") as client:
            yield client

    def bearer(self, broker: EmbeddedBroker, project: str, **quota: Any) -> dict[str, str]:
        with connect_text(broker.url) as redis:
            scopes = ["submit", "read", "delete"]
            token = KeyStore(redis).create(project, scopes, project=project, **quota).token
        return {"Authorization": f"Bearer {token}"}

    def test_no_key_of_another_project_learns_that_there_is_such_a_batch(
        self, keyed: TestClient, broker: EmbeddedBroker
    ) -> None:
        lamps, chairs = self.bearer(broker, "lamps"), self.bearer(broker, "chairs")
        document = {"options": MEASURE, "pairs": [PAIR]}
        links = keyed.post("/v1/batches", json=document, headers=lamps).json()["links"]
        unknown = keyed.get("/v1/batches/01900000-0000-7000-8000-000000000000", headers=chairs)

        answers = [
            *(keyed.get(path, headers=chairs) for name, path in links.items() if name != "cancel"),
            keyed.post(links["cancel"], headers=chairs),
            keyed.delete(links["self"], headers=chairs),
        ]

        assert {(each.status_code, each.text) for each in answers} == {(404, unknown.text)}
        assert keyed.get("/v1/batches", headers=chairs).json()["batches"] == []
        assert keyed.get("/v1/batches?project=lamps", headers=chairs).json()["batches"] == []
        assert len(keyed.get("/v1/batches", headers=lamps).json()["batches"]) == 1

    def test_a_batch_counts_with_all_of_its_jobs_against_the_key(
        self, settings: ServiceSettings, broker: EmbeddedBroker
    ) -> None:
        paced = settings.model_copy(update={"key_active_jobs": 5})
        document = {"options": MEASURE, "pairs": [PAIR] * 4}
        headers = self.bearer(broker, "lamps")
        with TestClient(create_app(paced), "http://127.0.0.1:8000") as http:
            first = http.post("/v1/batches", json=document, headers=headers)
            second = http.post("/v1/batches", json=document, headers=headers)
            http.post(first.json()["links"]["cancel"], headers=headers)
            third = http.post("/v1/batches", json=document, headers=headers)

        assert [each.status_code for each in (first, second)] == [202, 429]
        assert "the batch has 4" in second.json()["detail"]
        assert third.status_code == 202

    def test_a_batch_of_more_jobs_than_its_key_may_have_is_refused_before_any_is_staged(
        self, settings: ServiceSettings, broker: EmbeddedBroker, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        staged = list[str]()
        monkeypatch.setattr(
            Batches, "stage", lambda _self, batch_id, _jobs: staged.append(batch_id)
        )
        paced = settings.model_copy(update={"key_active_jobs": 5})
        headers = self.bearer(broker, "lamps")
        with TestClient(create_app(paced), "http://127.0.0.1:8000") as http:
            document = {"options": MEASURE, "pairs": [PAIR] * 6}
            answer = http.post("/v1/batches", json=document, headers=headers)

        assert (answer.status_code, staged) == (429, [])
