"""Who asks, and what is sent and made."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from typing import Any

from httpx2 import Response
from redis import Redis
from starlette.testclient import TestClient

from service.access.keys import KeyStore, Scope
from service.api.context import Context
from worker.jobs.identifiers import new_job_id
from worker.jobs.records import Artifact

SCOPES: tuple[Scope, ...] = ("submit", "read", "delete")

VARYING = {"x-request-id", "ratelimit", "ratelimit-policy", "date"}
TRIANGLE = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n# "


@dataclass(frozen=True)
class Caller:
    """Somebody with a key."""

    http: TestClient
    token: str

    def __call__(self, method: str, path: str, **request: Any) -> Response:
        headers = {"Authorization": f"Bearer {self.token}", **request.pop("headers", {})}
        return self.http.request(method, path, headers=headers, **request)

    def send(self, source: bytes, label: str = "", **headers: str) -> Response:
        files = {"source": ("lantern.obj", source)}
        data = {"options": '{"mode": "audit"}', "label": label}
        return self("POST", "/v1/jobs", files=files, data=data, headers=headers)

    def listed(self, **filters: Any) -> list[str]:
        answer = self("GET", "/v1/jobs", params=filters)
        assert answer.status_code == 200, answer.text
        return [job["id"] for job in answer.json()["jobs"]]


def caller(http: TestClient, redis: Redis, project: str, *scopes: Scope) -> Caller:
    made = KeyStore(redis).create(f"of {project}", scopes or SCOPES, project=project)
    return Caller(http, made.token)


def content() -> bytes:
    """A mesh that nobody has sent."""
    return TRIANGLE + new_job_id().encode()


def digest_of(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def finish(http: TestClient, job_id: str) -> dict[str, bytes]:
    """Have a job succeed as a worker would; what it has made."""
    context: Context = http.app.state.context  # type: ignore[attr-defined]
    names = (
        "mesh", "report", "certificate", "preview", "heatmap", "pictures", "thumbnail",
        "diagnostics_csv",
    )  # fmt: skip
    made = {name: json.dumps({"solver": name, "id": job_id}).encode() for name in names}
    digests = context.blobs.put_all(made.values(), job_id)
    artifacts = {
        name: Artifact(digest=digest, media_type="application/json", filename=name, size=len(data))
        for (name, data), digest in zip(made.items(), digests, strict=True)
    }
    context.ledger.succeed(job_id, context.ledger.begin(job_id), artifacts, verdict="pass")
    return made


def told(answer: Response) -> tuple[int, str, dict[str, str]]:
    headers = {name: each for name, each in answer.headers.items() if name not in VARYING}
    return answer.status_code, answer.text, headers
