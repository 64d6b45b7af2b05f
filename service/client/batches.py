"""What a client does with batches."""

from __future__ import annotations

import time
import uuid
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

from meshcone.gates.results import GateRun
from service.api.batch_schemas import (
    BATCHES_PATH,
    Batch,
    BatchHeader,
    BatchList,
    PairRequest,
    batch_path,
)
from service.api.schemas import JobList, ListedJob
from service.client.transport import parsed

if TYPE_CHECKING:
    from service.client.transport import Transport

Summary = Literal["junit.xml", "sarif.json", "summary.md"]
"""What the service writes of a batch that has finished."""

_PAGE = 200  # jobs


class BatchCalls:
    """Sends batches, and follows them; raises as :class:`service.client.Client` does."""

    _transport: Transport

    def submit_batch(
        self,
        pairs: Sequence[PairRequest | Mapping[str, Any]],
        header: BatchHeader | Mapping[str, Any] | None = None,
        *,
        idempotency_key: str | None = None,
    ) -> Batch:
        """Submit many jobs at once.

        Args:
            pairs: each a job, whose files are named by URL or as :meth:`upload` has made of them.
            header: name, labels, options, gates and webhook of all.
            idempotency_key: batches of the same content with the same key are one batch; by
                default, each call makes one.
        """
        sent = {**_as_sent(header or {}), "pairs": [_as_sent(pair) for pair in pairs]}
        headers = {"Idempotency-Key": idempotency_key or str(uuid.uuid4())}
        answer = self._transport.request("POST", BATCHES_PATH, json=sent, headers=headers)
        return parsed(Batch, answer)

    def batch(self, batch_id: str) -> Batch:
        """A batch as it is now."""
        answer = self._transport.request("GET", batch_path(batch_id))
        return parsed(Batch, answer)

    def batches(self, **filters: str | int) -> BatchList:
        """A page of batches, newest first; filters are the parameters of ``GET /v1/batches``."""
        answer = self._transport.request("GET", BATCHES_PATH, params=filters)
        return parsed(BatchList, answer)

    def batch_jobs(self, batch_id: str, **filters: str | int) -> Iterator[ListedJob]:
        """Every job of a batch that the filters select, those of its last pairs first."""
        parameters: dict[str, str | int] = {"limit": _PAGE, **filters}
        while True:
            answer = self._transport.request(
                "GET", f"{batch_path(batch_id)}/jobs", params=parameters
            )
            page = parsed(JobList, answer)
            yield from page.jobs
            if page.next is None:
                return
            parameters["cursor"] = page.next

    def wait_for_batch(
        self,
        batch_id: str,
        *,
        timeout: float = 3600.0,
        interval: float = 1.0,
        on_change: Callable[[Batch], None] | None = None,
    ) -> Batch:
        """Wait until the last job of a batch has ended, however it ended.

        Args:
            batch_id: the batch.
            timeout: seconds to wait at most.
            interval: seconds between looks.
            on_change: called with each look that shows something new.

        Raises:
            TimeoutError: the batch has not finished in time.
        """
        deadline, seen = time.monotonic() + timeout, None
        while True:
            batch = self.batch(batch_id)
            if on_change is not None and batch != seen:
                on_change(batch)
            seen = batch
            if batch.state == "finished":
                return batch
            if time.monotonic() > deadline:
                raise TimeoutError(f"batch {batch_id} has not finished after {timeout:g} s")
            time.sleep(interval)

    def batch_result(self, batch_id: str) -> GateRun:
        """What came of each pair of a batch that has finished, in the order of the pairs."""
        answer = self._transport.request("GET", f"{batch_path(batch_id)}/result")
        return parsed(GateRun, answer)

    def batch_summary(self, batch_id: str, kind: Summary) -> bytes:
        """The result of a batch that has finished, as JUnit XML, SARIF or Markdown."""
        return self._transport.request("GET", f"{batch_path(batch_id)}/{kind}").content

    def cancel_batch(self, batch_id: str) -> Batch:
        """Cancel the queued jobs of a batch, and ask those that run to stop."""
        answer = self._transport.request("POST", f"{batch_path(batch_id)}/cancel")
        return parsed(Batch, answer)

    def delete_batch(self, batch_id: str) -> None:
        """Remove a batch that has finished, with its jobs and their files."""
        self._transport.request("DELETE", batch_path(batch_id))


def listed_labels(labels: str | Sequence[str]) -> Sequence[str]:
    """Labels as a list; text is one label, and not one for each of its letters."""
    return [labels] if isinstance(labels, str) else labels


def _as_sent(part: PairRequest | BatchHeader | Mapping[str, Any]) -> Mapping[str, Any]:
    if isinstance(part, PairRequest | BatchHeader):
        return part.model_dump(mode="json", exclude_unset=True)
    if isinstance(part.get("labels"), str):
        return {**part, "labels": listed_labels(part["labels"])}
    return part
