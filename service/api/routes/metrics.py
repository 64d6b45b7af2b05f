"""``/metrics``: what the ledger counts, in Prometheus' text format.

Everything is read from the broker when it is asked for, so every API process gives the same
answer and none has a count of its own to lose. Of the processes themselves, whoever runs
them knows more.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, get_args

from fastapi import Response
from prometheus_client import CollectorRegistry
from prometheus_client.core import (
    CounterMetricFamily,
    GaugeMetricFamily,
    HistogramMetricFamily,
    Metric,
)
from prometheus_client.exposition import CONTENT_TYPE_LATEST, generate_latest
from prometheus_client.registry import Collector

from meshcone.errors import ErrorKind
from service.api.context import ContextDependency
from service.api.routing import HeadRouter
from service.api.sender import SenderDependency
from worker.jobs.ledger_keys import DELIVERIES, FETCHES, WEBHOOKS
from worker.jobs.records import JobState, OutputState
from worker.jobs.tallies import (
    ITERATIONS,
    ROUNDS,
    SECONDS,
    SOLVER_ITERATIONS,
    STAGE_SECONDS,
    STAGES,
    bucket,
)
from worker.webhooks.schedule import DUE, Outcome

if TYPE_CHECKING:
    from service.api.context import Context

router = HeadRouter(tags=["health"])

_TEXT: dict[int | str, dict[str, Any]] = {
    200: {"content": {"text/plain": {"schema": {"type": "string"}}}}
}


@router.get("/metrics", response_class=Response, responses=_TEXT)
def metrics(context: ContextDependency, sender: SenderDependency) -> Response:
    """The service's metrics, in the text format of Prometheus; those of a project for its keys."""
    registry = CollectorRegistry(auto_describe=False)
    registry.register(LedgerCollector(context, sender.view))
    return Response(generate_latest(registry), media_type=CONTENT_TYPE_LATEST)


class LedgerCollector(Collector):
    """Reads the broker once for each scrape.

    Args:
        context: where to.
        project: whose jobs are counted; None for all, and the processes beside them.
    """

    def __init__(self, context: Context, project: str | None) -> None:
        self._context = context
        self._project = project

    def collect(self) -> Iterable[Metric]:
        """Every metric with its present value.

        Raises:
            RedisError: the broker is unreachable.
        """
        counters = self._context.ledger.index.counters(self._project)
        yield from self._present()
        if self._project is None:
            yield from self._of_the_installation(counters)
        yield _by_label(
            "meshcone_transitions",
            "Steps of jobs from one state to another; none is from 'new'.",
            ("from", "to"),
            {
                tuple(part or "new" for part in name.split(":")[1:]): value
                for name, value in counters.items()
                if name.startswith("transitions:")
            },
        )
        kinds = get_args(ErrorKind)
        yield _by_label(
            "meshcone_failures",
            "Jobs that failed, by who is responsible.",
            ("kind",),
            {(kind,): counters.get(f"failures:{kind}", 0) for kind in kinds},
        )
        for name in ("expired", "deleted"):
            yield CounterMetricFamily(
                f"meshcone_jobs_{name}", f"Jobs {name}.", value=counters.get(name, 0)
            )
        yield _by_label(
            "meshcone_state_seconds",
            "Seconds jobs have spent in a state before they left it.",
            ("state",),
            {
                (name.split(":")[1],): value
                for name, value in counters.items()
                if name.startswith("seconds:")
            },
        )
        yield _by_label(
            "meshcone_outputs",
            "Results to be put somewhere, by what became of them.",
            ("outcome",),
            {
                (outcome,): counters.get(f"outputs:{outcome}", 0)
                for outcome in get_args(OutputState)
                if outcome != "waiting"
            },
        )
        yield from _of_the_work(counters)

    def _present(self) -> Iterable[Metric]:
        index = self._context.ledger.index
        jobs = GaugeMetricFamily(
            "meshcone_jobs", "Jobs by state; an ended one until it expires.", labels=["state"]
        )
        for state in get_args(JobState):
            jobs.add_metric([state], index.count(state, self._project))
        yield jobs
        yield GaugeMetricFamily(
            "meshcone_queue_depth",
            "Jobs that wait for a worker.",
            value=index.count("queued", self._project),
        )
        oldest = GaugeMetricFamily(
            "meshcone_oldest_job_seconds",
            "How long the job has been in its state that has been there longest.",
            labels=["state"],
        )
        waiting: tuple[JobState, ...] = ("queued", "running")
        for state in waiting:
            oldest.add_metric([state], index.longest(state, self._project))
        yield oldest

    def _of_the_installation(self, counters: Mapping[str, float]) -> Iterable[Metric]:
        index = self._context.ledger.index
        divided = GaugeMetricFamily(
            "meshcone_project_jobs", "Jobs by project and state.", labels=["project", "state"]
        )
        for project in index.projects():
            for state in get_args(JobState):
                divided.add_metric([project, state], index.count(state, project))
        yield divided
        outcomes = get_args(Outcome)
        yield _by_label(
            "meshcone_webhooks",
            "Webhooks by what became of them; those dropped were too many, or could not be read.",
            ("outcome",),
            {(outcome,): counters.get(f"webhooks:{outcome}", 0) for outcome in outcomes},
        )
        yield GaugeMetricFamily(
            "meshcone_workers",
            "Workers that have been heard of lately.",
            value=self._context.queue.worker_count(),
        )
        client = self._context.redis
        yield GaugeMetricFamily(
            "meshcone_fetches_pending",
            "Queued jobs some of whose files are still to be fetched.",
            value=client.zcard(FETCHES),
        )
        yield GaugeMetricFamily(
            "meshcone_outputs_pending",
            "Results not put where they are to be yet, those to be tried again among them.",
            value=client.zcard(DELIVERIES),
        )
        yield GaugeMetricFamily(
            "meshcone_webhooks_pending",
            "Webhooks not delivered yet, those to be tried again among them.",
            value=client.zcard(DUE) + client.xlen(WEBHOOKS),
        )


def _of_the_work(counters: Mapping[str, float]) -> Iterable[Metric]:
    seconds = HistogramMetricFamily(
        "meshcone_stage_seconds", "Seconds of each stage of jobs that succeeded.", labels=["stage"]
    )
    for stage in STAGES:
        name = f"{STAGE_SECONDS}:{stage}"
        seconds.add_metric([stage], *_histogram(counters, name, SECONDS))
    yield seconds
    iterations = HistogramMetricFamily(
        "meshcone_solver_iterations", "Iterations of each call of the conic solver SCS."
    )
    iterations.add_metric([], *_histogram(counters, SOLVER_ITERATIONS, ITERATIONS))
    yield iterations
    yield _by_label(
        "meshcone_rounds",
        "Rounds solved, by what solved them.",
        ("method",),
        {
            (name.split(":")[1],): value
            for name, value in counters.items()
            if name.startswith(f"{ROUNDS}:")
        },
    )


def _histogram(
    counters: Mapping[str, float], name: str, bounds: Sequence[float]
) -> tuple[list[tuple[str, float]], float]:
    buckets, below = [], 0.0
    for bound in bounds:
        below += counters.get(bucket(name, bound), 0)
        buckets.append(("+Inf" if bound == float("inf") else f"{bound:g}", below))
    return buckets, counters.get(f"{name}:sum", 0)


def _by_label(
    name: str, words: str, labels: Sequence[str], values: Mapping[tuple[str, ...], float]
) -> Metric:
    family = CounterMetricFamily(name, words, labels=labels)
    for key, value in sorted(values.items()):
        family.add_metric(key, value)
    return family
