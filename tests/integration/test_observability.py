"""What an operator sees of a job: metrics, log lines, a trace."""

from __future__ import annotations

import gzip
import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler
from pathlib import Path

import httpx2
import pytest
from opentelemetry.proto.collector.trace.v1.trace_service_pb2 import ExportTraceServiceRequest
from opentelemetry.proto.trace.v1.trace_pb2 import Span
from prometheus_client.parser import text_string_to_metric_families

from meshcone.files import MeshFile
from service.api.schemas import Job
from service.client import Client
from service.stack import Stack
from tests.integration.waiting import wait_for
from tests.listening import Silent, listening
from worker.settings import WorkerSettings

REQUEST_ID = "release-build-7"
TRACE_ID = "4bf92f3577b34da6a3ce929d0e0e4736"

Samples = dict[tuple[str, frozenset[tuple[str, str]]], float]


@dataclass
class Collector:
    """Receives spans as an OpenTelemetry collector does (OTLP over HTTP)."""

    url: str = ""
    spans: dict[str, Span] = field(default_factory=dict)
    services: dict[str, str] = field(default_factory=dict)

    def receive(self, body: bytes) -> None:
        """Take an export."""
        for resource in ExportTraceServiceRequest.FromString(body).resource_spans:
            names = {each.key: each.value.string_value for each in resource.resource.attributes}
            for scope in resource.scope_spans:
                for span in scope.spans:
                    self.spans[span.name] = span
                    self.services[span.name] = names["service.name"]


@pytest.fixture(scope="module")
def collector() -> Iterator[Collector]:
    collected = Collector()

    class Handler(Silent, BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers["Content-Length"]))
            packed = self.headers.get("Content-Encoding") == "gzip"
            collected.receive(gzip.decompress(body) if packed else body)
            self.send_response(200)
            self.send_header("Content-Length", "0")
            self.end_headers()

    with listening(Handler) as address:
        collected.url = f"http://{address}"
        yield collected


@pytest.fixture(scope="module")
def directory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("observed")


@pytest.fixture(scope="module")
def observed(directory: Path, collector: Collector) -> Iterator[Stack]:
    """A service that says where its spans go."""
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("OTEL_EXPORTER_OTLP_ENDPOINT", collector.url)
        environment.setenv("OTEL_BSP_SCHEDULE_DELAY", "100")
        settings = WorkerSettings(data_dir=directory)
        with Stack(settings, log=directory / "service.log") as running:
            yield running


@pytest.fixture(scope="module")
def job(observed: Stack, rough_ball: MeshFile, ball: MeshFile) -> Job:
    """A job that has succeeded, sent by somebody who follows it."""
    answer = httpx2.post(
        f"{observed.url}/v1/jobs",
        files={
            "source": (rough_ball.name, rough_ball.data),
            "reference": (ball.name, ball.data),
        },
        data={"options": "{}"},
        headers={
            "X-Request-Id": REQUEST_ID,
            "Traceparent": f"00-{TRACE_ID}-00f067aa0ba902b7-01",
        },
        trust_env=False,
        timeout=60,
    )
    assert answer.headers["x-request-id"] == REQUEST_ID
    with Client(observed.url) as client:
        done = client.wait(answer.json()["id"])
    assert done.state == "succeeded"
    return done


@pytest.fixture
def lines(directory: Path, job: Job) -> list[dict[str, object]]:
    """The log, of which every line is a JSON object."""
    log = directory / "service.log"
    wait_for(lambda: f'"job_id": "{job.id}"' in log.read_text())
    return [json.loads(line) for line in log.read_text().splitlines()]


@pytest.fixture
def samples(observed: Stack, job: Job) -> Samples:
    assert job.state == "succeeded"
    text = httpx2.get(f"{observed.url}/metrics", trust_env=False, timeout=60).text
    return {
        (sample.name, frozenset(sample.labels.items())): sample.value
        for family in text_string_to_metric_families(text)
        for sample in family.samples
    }


def sample(samples: Samples, name: str, **labels: str) -> float:
    return samples[name, frozenset(labels.items())]


def test_metrics_tell_what_there_is(samples: Samples) -> None:
    assert sample(samples, "meshcone_jobs", state="succeeded") == 1
    assert sample(samples, "meshcone_jobs", state="queued") == 0
    assert sample(samples, "meshcone_queue_depth") == 0
    assert sample(samples, "meshcone_oldest_job_seconds", state="queued") == 0
    assert sample(samples, "meshcone_workers") == 1
    assert sample(samples, "meshcone_webhooks_pending") == 0
    assert sample(samples, "meshcone_webhooks_total", outcome="dropped") == 0


def test_metrics_tell_what_was_done(samples: Samples, job: Job, observed: Stack) -> None:
    with Client(observed.url) as client:
        report = client.report(job.id)
    transitions = {"from": "running", "to": "succeeded"}
    solve = {"stage": "solve"}
    iterations = [each["info"]["iterations"] for each in report["solver"]["rounds"] if each["info"]]

    assert sample(samples, "meshcone_transitions_total", **transitions) == 1
    assert sample(samples, "meshcone_failures_total", kind="internal") == 0
    assert sample(samples, "meshcone_stage_seconds_count", **solve) == 1
    assert sample(samples, "meshcone_stage_seconds_bucket", **solve, le="+Inf") == 1
    assert sample(samples, "meshcone_stage_seconds_sum", **solve) == pytest.approx(
        report["timings"]["solve"]
    )
    assert sample(samples, "meshcone_solver_iterations_count") == len(iterations)
    assert sample(samples, "meshcone_solver_iterations_sum") == sum(iterations)


def test_a_histograms_buckets_never_fall(samples: Samples) -> None:
    buckets = sorted(
        (float(dict(labels)["le"]), value)
        for (name, labels), value in samples.items()
        if name == "meshcone_stage_seconds_bucket" and ("stage", "solve") in labels
    )

    values = [value for _, value in buckets]
    assert values == sorted(values)
    assert len(values) > 5


def test_a_job_can_be_followed_through_every_processs_log(
    lines: list[dict[str, object]], job: Job
) -> None:
    of_request = [line for line in lines if line.get("request_id") == REQUEST_ID]
    of_job = [line for line in lines if line.get("job_id") == job.id]

    assert any(line["event"] == "request" and line["status"] == 202 for line in of_request)
    assert any("attempt runs" in str(line["event"]) for line in of_job)
    assert {line["attempt"] for line in of_job if "attempt" in line} == {1}
    # The line in which the API takes the job up names both, which is what joins the two.
    assert any(line.get("job_id") == job.id for line in of_request)


def test_a_log_line_says_when_how_grave_and_by_whom(lines: list[dict[str, object]]) -> None:
    assert all({"timestamp", "level", "logger", "event"} <= set(line) for line in lines)


def test_probes_that_find_all_well_are_not_logged(lines: list[dict[str, object]]) -> None:
    assert not [line for line in lines if line.get("path") == "/readyz" and line["status"] == 200]


def test_one_trace_leads_from_the_senders_span_to_the_workers(
    collector: Collector, job: Job
) -> None:
    wait_for(lambda: {"POST /v1/jobs", "queued", "attempt"} <= set(collector.spans))

    request, attempt = collector.spans["POST /v1/jobs"], collector.spans["attempt"]
    attributes = {each.key: each.value for each in attempt.attributes}
    assert {span.trace_id.hex() for span in (request, attempt)} == {TRACE_ID}
    assert attempt.parent_span_id == request.span_id
    assert attributes["meshcone.job.id"].string_value == job.id
    assert attributes["meshcone.seconds.solve"].double_value > 0
    assert collector.services["attempt"] == "meshcone-worker"
    assert collector.services["POST /v1/jobs"] == "meshcone-api"


def test_waiting_and_working_follow_each_other_in_the_trace(collector: Collector, job: Job) -> None:
    assert job.state == "succeeded"
    wait_for(lambda: {"queued", "attempt"} <= set(collector.spans))

    queued, attempt = collector.spans["queued"], collector.spans["attempt"]
    assert queued.start_time_unix_nano <= queued.end_time_unix_nano
    assert queued.end_time_unix_nano == attempt.start_time_unix_nano
    assert attempt.start_time_unix_nano < attempt.end_time_unix_nano
