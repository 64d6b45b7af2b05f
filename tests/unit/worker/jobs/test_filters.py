"""Which jobs are found by a part of a name."""

from __future__ import annotations

import unicodedata
from datetime import UTC, datetime
from typing import Literal

import pytest

from worker.jobs.filters import JobFilter
from worker.jobs.records import JobRecord, StoredFile

Form = Literal["NFC", "NFD"]


def named(name: str) -> JobRecord:
    file = StoredFile(name=name, digest="0" * 64, size=1)
    created = datetime(2030, 1, 1, tzinfo=UTC)
    return JobRecord(id="0", created=created, source=file, reference=file, options={})


@pytest.mark.parametrize("stored", ["NFC", "NFD"])
@pytest.mark.parametrize("asked", ["NFC", "NFD"])
def test_a_file_is_found_however_its_accents_are_stored(stored: Form, asked: Form) -> None:
    record = named(unicodedata.normalize(stored, "Möbel-Türe.glb"))

    assert JobFilter(name=unicodedata.normalize(asked, "TÜRE")).admits(record)


def test_a_letter_without_its_accent_is_another_letter() -> None:
    assert not JobFilter(name="ture").admits(named(unicodedata.normalize("NFD", "türe.glb")))
