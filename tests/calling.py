"""Somebody who uses the service by HTTP, and never asks twice."""

from __future__ import annotations

import json
from collections import Counter
from typing import Self

import httpx2

from tests import shapes

Form = dict[str, tuple[str, bytes]]
OPTIONS = json.dumps({"effort": "fast", "quality": {"samples": 256, "emd_samples": 32}})


def small_form() -> Form:
    """The files of a form that sends a small pair."""
    vertices, faces = shapes.sphere(1)
    return {
        "source": ("rough.obj", shapes.obj(shapes.noisy(vertices), faces)),
        "reference": ("ball.obj", shapes.obj(vertices, faces)),
    }


class Caller:
    """Asks once and takes what comes; every answer is noted.

    Attributes:
        alive: statuses of ``/livez``, with how often each came.
        statuses: those of all else.
        accepted: the ids of the jobs that were.
    """

    def __init__(self, url: str) -> None:
        self._http = httpx2.Client(base_url=url, timeout=60, trust_env=False)
        self.alive: Counter[int] = Counter()
        self.statuses: Counter[int] = Counter()
        self.accepted: list[str] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._http.close()

    def submit(self, pair: Form) -> httpx2.Response:
        answer = self._noted(self._http.post("/v1/jobs", files=pair, data={"options": OPTIONS}))
        if answer.status_code == 202:
            self.accepted.append(answer.json()["id"])
        return answer

    def look(self) -> None:
        """Ask for what answers at any time, and for what may say that something is missing."""
        self.alive[self._http.get("/livez").status_code] += 1
        self.readiness()
        self._noted(self._http.get("/v1/jobs"))

    def readiness(self) -> tuple[int, str]:
        answer = self._noted(self._http.get("/readyz"))
        return answer.status_code, answer.json().get("detail", "")

    def state(self, job_id: str) -> str:
        answer = self._noted(self._http.get(f"/v1/jobs/{job_id}"))
        return str(answer.json().get("state", "unknown just now"))

    def states(self) -> set[str]:
        """States of the accepted jobs."""
        return {self.state(each) for each in self.accepted}

    def has_seen_all_end(self) -> bool:
        self.look()
        return self.states() <= {"succeeded", "failed", "canceled"}

    def _noted(self, answer: httpx2.Response) -> httpx2.Response:
        if answer.status_code == 503:
            assert answer.headers["content-type"] == "application/problem+json"
            assert "retry-after" in answer.headers
            assert answer.json()["detail"]
        self.statuses[answer.status_code] += 1
        return answer
