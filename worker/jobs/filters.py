"""Which jobs are meant."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterator
from dataclasses import dataclass, replace

from worker.jobs.ledger_keys import all_jobs, index_of
from worker.jobs.records import JobRecord, JobState, Verdict


@dataclass(frozen=True)
class JobFilter:
    """Which jobs are meant: those that have all of what is given.

    Attributes:
        project: whose jobs; None for those of all projects.
        name: part of the name of a file that was sent, or of a label, in any case.
        batch: of which batch; None for those of any and of none.
        alone: those alone that belong to no batch.
        untroubled: those alone that neither failed nor have a verdict ``fail`` or ``not_tested``.
    """

    state: JobState | None = None
    verdict: Verdict | None = None
    labels: frozenset[str] = frozenset()
    name: str = ""
    project: str | None = None
    untroubled: bool = False
    batch: str | None = None
    alone: bool = False

    def index(self) -> str:
        """The smallest index certain to hold all of them."""
        place = (self.project, self.batch)
        if self.labels:
            return index_of("label", min(self.labels), *place, alone=self.alone)
        if self.verdict is not None:
            return index_of("verdict", self.verdict, *place, alone=self.alone)
        if self.state is not None:
            return index_of("state", self.state, *place, alone=self.alone)
        return all_jobs(*place, alone=self.alone)

    def admits(self, record: JobRecord) -> bool:
        """Whether a job is meant."""
        return (
            self.project in (None, record.project)
            and self.batch in (None, record.batch)
            and not (self.alone and record.batch is not None)
            and self.state in (None, record.state)
            and self.verdict in (None, record.verdict)
            and self.labels.issubset(record.labels)
            and not (self.untroubled and _is_troubled(record))
            and self._is_named(record)
        )

    def troubles_first(self) -> Iterator[tuple[int, JobFilter]]:
        """This filter in parts by rank: failed gates, failures, what was not tested, the rest.

        A part that no job can be in is left out.
        """
        decided = self.state in (None, "succeeded")
        if decided and self.verdict in (None, "fail"):
            yield 0, replace(self, verdict="fail")
        if self.state in (None, "failed") and self.verdict is None:
            yield 1, replace(self, state="failed")
        if decided and self.verdict in (None, "not_tested"):
            yield 2, replace(self, verdict="not_tested")
        if self.state != "failed" and self.verdict in (None, "pass"):
            yield 3, replace(self, untroubled=True)

    def _is_named(self, record: JobRecord) -> bool:
        part = _spelt_alike(self.name)
        names = [*record.labels, *(file.name for file in record.files)]
        return not part or any(part in _spelt_alike(name) for name in names)


def _spelt_alike(name: str) -> str:
    """The name in one spelling: a letter with an accent is one character or two, by machine."""
    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", name).casefold())


def _is_troubled(record: JobRecord) -> bool:
    return record.state == "failed" or record.verdict in ("fail", "not_tested")


EVERYTHING = JobFilter()
