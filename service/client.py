"""A client of the HTTP API."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping
from types import TracebackType
from typing import Any, Self

import httpx2

from meshcone.files import MeshFile
from service.problems import MEDIA_TYPE, Problem
from service.schemas import JOBS_PATH, Job, JobList, job_path

_FINAL_STATES = ("succeeded", "failed", "canceled")
REQUEST_TIMEOUT = 60.0  # seconds


class ServiceError(Exception):
    """The service answered with a problem.

    Attributes:
        problem: what it said.
    """

    def __init__(self, problem: Problem) -> None:
        where = ", ".join(part for part in (problem.file, problem.place) if part)
        super().__init__(f"{where}: {problem.detail}" if where else problem.detail)
        self.problem = problem


class Client:
    """Submits jobs to a MeshCone service and fetches their results.

    Every method raises :class:`ServiceError` where the service answers with a problem, and
    ``httpx2.TransportError`` where it does not answer.

    Args:
        base_url: where the service listens, such as ``http://127.0.0.1:8000``.
    """

    def __init__(self, base_url: str) -> None:
        # A proxy from the environment cannot reach a service on this machine.
        is_local = httpx2.URL(base_url).host in ("127.0.0.1", "localhost", "::1")
        self._http = httpx2.Client(
            base_url=base_url, timeout=REQUEST_TIMEOUT, trust_env=not is_local
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the connections."""
        self._http.close()

    def submit(
        self,
        source: MeshFile,
        reference: MeshFile,
        options: Mapping[str, Any] | None = None,
        *,
        label: str | None = None,
    ) -> Job:
        """Submit a mesh and its reference, with the resources of both."""
        files = [
            ("source", (source.name, source.data)),
            ("reference", (reference.name, reference.data)),
        ]
        resources = {**reference.resources, **source.resources}
        files += [("resources", (name, data)) for name, data in resources.items()]
        fields = {"options": json.dumps(options or {})}
        if label is not None:
            fields["label"] = label
        return Job.model_validate_json(
            self._checked(self._http.post(JOBS_PATH, files=files, data=fields)).content
        )

    def job(self, job_id: str) -> Job:
        """A job as it is now."""
        return Job.model_validate_json(self._get(job_path(job_id)).content)

    def jobs(self, **filters: str | int) -> JobList:
        """Jobs, newest first; filters are the query parameters of ``GET /v1/jobs``."""
        answer = self._checked(self._http.get(JOBS_PATH, params=filters))
        return JobList.model_validate_json(answer.content)

    def wait(
        self,
        job_id: str,
        *,
        timeout: float = 600.0,
        interval: float = 0.2,
        on_change: Callable[[Job], None] | None = None,
    ) -> Job:
        """Wait until a job has ended, however it ended.

        Args:
            job_id: the job.
            timeout: seconds to wait at most.
            interval: seconds between looks.
            on_change: called with each look that shows something new.

        Raises:
            TimeoutError: the job has not ended in time.
        """
        deadline = time.monotonic() + timeout
        seen: Job | None = None
        while True:
            job = self.job(job_id)
            if on_change is not None and job != seen:
                on_change(job)
            seen = job
            if job.state in _FINAL_STATES:
                return job
            if time.monotonic() > deadline:
                raise TimeoutError(f"job {job_id} is still {job.state} after {timeout:g} s")
            time.sleep(interval)

    def mesh(self, job_id: str) -> bytes:
        """The refined file of a job that succeeded."""
        return self._get(f"{job_path(job_id)}/mesh").content

    def report(self, job_id: str) -> dict[str, Any]:
        """The report of a job that succeeded."""
        report: dict[str, Any] = self._get(f"{job_path(job_id)}/report").json()
        return report

    def certificate(self, job_id: str) -> bytes:
        """The certificate of a job that succeeded; there is none where its input was kept."""
        return self._get(f"{job_path(job_id)}/certificate").content

    def diagnostics(self, job_id: str) -> dict[str, Any]:
        """What the solver did, of a job that succeeded."""
        diagnostics: dict[str, Any] = self._get(f"{job_path(job_id)}/diagnostics").json()
        return diagnostics

    def diagnostics_csv(self, job_id: str) -> str:
        """The solver's iterations as a table, of a job that succeeded."""
        return self._get(f"{job_path(job_id)}/diagnostics.csv").text

    def _get(self, path: str) -> httpx2.Response:
        return self._checked(self._http.get(path))

    def _checked(self, answer: httpx2.Response) -> httpx2.Response:
        if answer.headers.get("content-type", "").startswith(MEDIA_TYPE):
            raise ServiceError(Problem.model_validate_json(answer.content))
        return answer.raise_for_status()
