"""A client of the HTTP API.

    with Client("https://meshes.example.org", api_key=key) as client:
        job = client.wait(client.submit(source, reference, {"effort": "fast"}).id)
        refined = client.mesh(job.id)

A service that is full, paces its clients or starts again is waited for: every request of
this client can be repeated without doing anything twice.
"""

from __future__ import annotations

import hashlib
import json
import time
import uuid
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import PurePath
from types import TracebackType
from typing import Any, Self

import httpx2

from meshcone.files import MeshFile
from meshcone.library.inputs import LoadedMesh, MeshLike, load_unread
from service.api.request_schemas import LinkedFile, NamedBlob, OutputPlace
from service.api.schemas import JOBS_PATH, Deletion, Job, JobList, ListedJob, SentFile, job_path
from service.client.batches import BatchCalls, listed_labels
from service.client.links import is_link, link_to
from service.client.transport import Transport, parsed, parsed_object
from worker.jobs.records import FINAL_STATES, OutputName

PATIENCE = 120.0  # seconds

_ByName = NamedBlob | LinkedFile
_FIRST_LOOK = 0.05  # seconds
_GROWTH = 1.5  # of the pause between two looks


class Client(BatchCalls):
    """Submits jobs to a MeshCone service and fetches their results.

    Every method raises :class:`ServiceError` where the service answers with a problem, and
    ``httpx2.HTTPError`` where it does not answer, or not as a MeshCone service does. It may be
    used by several threads.

    Args:
        base_url: where the service listens, such as ``http://127.0.0.1:8000``.
        api_key: sent with each request, if any.
        patience: seconds a call may spend waiting for a service that cannot answer just now.
            One that has never answered is not waited for.
    """

    def __init__(
        self, base_url: str, *, api_key: str | None = None, patience: float = PATIENCE
    ) -> None:
        self._transport = Transport(base_url, api_key, patience)

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
        self._transport.close()

    def submit(
        self,
        source: MeshLike | NamedBlob | LinkedFile,
        reference: MeshLike | NamedBlob | LinkedFile | None = None,
        options: Mapping[str, Any] | None = None,
        *,
        source_resources: Iterable[MeshFile | NamedBlob | LinkedFile] = (),
        reference_resources: Iterable[MeshFile | NamedBlob | LinkedFile] = (),
        resources: Iterable[MeshFile | NamedBlob | LinkedFile] = (),
        labels: str | Sequence[str] = (),
        webhook: str | None = None,
        outputs: Mapping[OutputName, OutputPlace] | None = None,
        idempotency_key: str | None = None,
    ) -> Job:
        """Submit a mesh and its reference, if it has one, each with its own resources.

        Two files of one name are two files as long as they belong to different meshes.

        Args:
            source: the mesh, as :func:`meshcone.refine` takes it, with the resources it has; or
                what :meth:`upload` has made of it; or a URL, which the service fetches. A
                ``LinkedFile`` is a URL with the name of a secret to fetch it with
                (``authorization``), or with the hash (``sha256``) that its content must have.
            reference: the mesh it should have been, likewise; None where the option ``mode`` is
                ``audit`` and there is none.
            options: those that are not to be the default.
            source_resources: further files that the source names, such as uploaded ones.
            reference_resources: further files that the reference names.
            resources: files that both name; none of them is sent for one of the two as well.
            labels: names to find the job by; text is one of them.
            webhook: where the service is to say that the job has ended.
            outputs: where the service is to put what the job makes, by name.
            idempotency_key: submissions of the same content with the same key make one job;
                by default, each call makes one.
        """
        # A part without a file name is a plain field; all of them in one list make the form
        # a multipart one even where both meshes are only named.
        parts: list[tuple[str, tuple[str | None, str | bytes]]] = [
            ("options", (None, json.dumps(options or {}))),
            *(("label", (None, label)) for label in listed_labels(labels)),
        ]
        if webhook is not None:
            parts.append(("webhook", (None, webhook)))
        if outputs:
            places = {name: place.model_dump(mode="json") for name, place in outputs.items()}
            parts.append(("outputs", (None, json.dumps(places))))
        for side, mesh in (("source", source), ("reference", reference)):
            if mesh is None:
                continue
            file: MeshFile | NamedBlob | LinkedFile
            if isinstance(mesh, _ByName):
                file = mesh
            elif isinstance(mesh, str) and is_link(mesh):
                file = link_to(mesh)
            else:
                file = load_unread(mesh, side)
            if side == "source" and isinstance(file, LoadedMesh):
                file = file.with_file(_listed(options or {}))
            parts.append((side, _content(file)))
            if isinstance(file, MeshFile):
                parts += [(f"{side}_resources", each) for each in file.resources.items()]
        for field, files in (
            ("source_resources", source_resources),
            ("reference_resources", reference_resources),
            ("resources", resources),
        ):
            parts += [(field, _content(file)) for file in files]
        headers = {"Idempotency-Key": idempotency_key or str(uuid.uuid4())}
        answer = self._transport.request("POST", JOBS_PATH, files=parts, headers=headers)
        return parsed(Job, answer)

    def upload(self, file: MeshFile) -> NamedBlob:
        """Send a file that many jobs will name, unless the service has it; without resources."""
        digest = hashlib.sha256(file.data).hexdigest()
        path = f"/v1/blobs/{digest}"
        # The question has a file that was sent kept for as long as if it were sent again.
        if self._transport.answer("HEAD", path).status_code != httpx2.codes.OK:
            self._transport.request("PUT", path, content=file.data)
        return NamedBlob(name=file.name, sha256=digest)

    def job(self, job_id: str) -> Job:
        """A job as it is now."""
        return parsed(Job, self._get(job_path(job_id)))

    def jobs(self, **filters: str | int | Sequence[str]) -> JobList:
        """A page of jobs, newest first, without their options.

        Filters are the parameters of ``GET /v1/jobs``.
        """
        answer = self._transport.request("GET", JOBS_PATH, params=filters)
        return parsed(JobList, answer)

    def all_jobs(self, **filters: str | int | Sequence[str]) -> Iterator[ListedJob]:
        """Every job that the filters select, newest first, page by page."""
        page = self.jobs(**filters)
        yield from page.jobs
        while page.next is not None:
            page = self.jobs(**{**filters, "cursor": page.next})
            yield from page.jobs

    def wait(
        self,
        job_id: str,
        *,
        timeout: float = 600.0,
        interval: float = 0.5,
        on_change: Callable[[Job], None] | None = None,
    ) -> Job:
        """Wait until a job has ended, however it ended.

        Args:
            job_id: the job.
            timeout: seconds to wait at most.
            interval: seconds between looks at most; the first ones follow each other faster.
            on_change: called with each look that shows something new.

        Raises:
            TimeoutError: the job has not ended in time.
        """
        deadline = time.monotonic() + timeout
        pause, seen = min(_FIRST_LOOK, interval), None
        while True:
            job = self.job(job_id)
            if on_change is not None and job != seen:
                on_change(job)
            seen = job
            if job.state in FINAL_STATES:
                return job
            if time.monotonic() > deadline:
                raise TimeoutError(f"job {job_id} is still {job.state} after {timeout:g} s")
            time.sleep(pause)
            pause = min(pause * _GROWTH, interval)

    def cancel(self, job_id: str) -> Job:
        """Cancel a queued job, or ask a running one to stop."""
        answer = self._transport.request("POST", f"{job_path(job_id)}/cancel")
        return parsed(Job, answer)

    def delete(self, job_id: str) -> None:
        """Remove a job that has ended, with its files."""
        self._transport.request("DELETE", job_path(job_id))

    def delete_all(self, *labels: str) -> Deletion:
        """Remove every job that has all of the labels and has ended, page by page.

        Raises:
            ValueError: no label is named.
        """
        if not labels:
            raise ValueError("name a label at least")
        deleted = not_finished = 0
        parameters: dict[str, Any] = {"label": labels}
        while True:
            answer = self._transport.request("DELETE", JOBS_PATH, params=parameters)
            page = parsed(Deletion, answer)
            deleted, not_finished = deleted + page.deleted, not_finished + page.not_finished
            if page.next is None:
                return Deletion(deleted=deleted, not_finished=not_finished, next=None)
            parameters["cursor"] = page.next

    def input(self, file: SentFile) -> bytes:
        """A file that a job was sent, byte for byte, as long as the job has not expired."""
        if file.link is None:
            raise ValueError(f"{file.name} is kept no longer: its job has expired")
        return self._get(file.link).content

    def mesh(self, job_id: str) -> bytes:
        """The refined file of a job that succeeded."""
        return self._get(f"{job_path(job_id)}/mesh").content

    def report(self, job_id: str) -> dict[str, Any]:
        """The report of a job that succeeded."""
        return parsed_object(self._get(f"{job_path(job_id)}/report"))

    def report_bytes(self, job_id: str) -> bytes:
        """The report of a job that succeeded, as it was written."""
        answer = self._get(f"{job_path(job_id)}/report")
        parsed_object(answer)  # or the page of a proxy could be taken for it
        return answer.content

    def certificate(self, job_id: str) -> bytes:
        """The certificate of a job that succeeded; there is none where nothing was proven."""
        return self._get(f"{job_path(job_id)}/certificate").content

    def preview(self, job_id: str) -> bytes:
        """Light copies of the meshes of a job that succeeded, as GLB."""
        return self._get(f"{job_path(job_id)}/preview.glb").content

    def pictures(self, job_id: str) -> bytes | None:
        """The meshes of a job that succeeded from six sides, as PNG; none without colours."""
        if self.job(job_id).links.pictures is None:
            return None
        return self._get(f"{job_path(job_id)}/pictures.png").content

    def thumbnail(self, job_id: str) -> bytes:
        """A small picture of the mesh of a job that succeeded, as WebP."""
        return self._get(f"{job_path(job_id)}/thumbnail.webp").content

    def diagnostics(self, job_id: str) -> dict[str, Any]:
        """What the solver did, of a job that succeeded."""
        return parsed_object(self._get(f"{job_path(job_id)}/diagnostics"))

    def diagnostics_csv(self, job_id: str) -> str:
        """The solver's iterations as a table, of a job that succeeded."""
        return self._get(f"{job_path(job_id)}/diagnostics.csv").text

    def _get(self, path: str) -> httpx2.Response:
        return self._transport.request("GET", path)


def _content(file: MeshFile | NamedBlob | LinkedFile) -> tuple[str | None, str | bytes]:
    if isinstance(file, _ByName):
        return None, file.model_dump_json()
    return file.name, file.data


def _listed(options: Mapping[str, Any]) -> str | None:
    """The file that options name, where they are sound; the service says what is not."""
    found: Any = options
    for name in ("cones", "pin", "vertices_file"):
        found = found.get(name) if isinstance(found, Mapping) else None
    is_name = isinstance(found, str) and found == PurePath(found).name and "\0" not in found
    return found if is_name else None
