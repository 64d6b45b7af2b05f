"""What ``meshcone submit`` refuses before it asks a service."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import Self

import pytest

from meshcone.errors import InputError, InternalError
from meshcone.gates.results import AssetResult, GateRun, Judgement
from service.api.batch_schemas import Batch
from service.cli.submit import command
from service.client import connection
from service.client.links import source_name
from worker.jobs.batches import BatchCounts, BatchRecord
from worker.jobs.records import FINAL_STATES

NOBODY = "http://127.0.0.1:9"
MUG = "https://assets.example.org/mug.glb"


@pytest.mark.parametrize(
    ("put", "said"),
    [
        (["mash=https://x.example.org/a"], "--put mash: there is no result of that name.*mesh"),
        (["mesh"], "is not a URL that a service can put a result to"),
        (["mesh=ftp://x.example.org/a"], "ftp://x.example.org/a: is not a URL"),
        (["mesh=s3://a/b", "mesh=s3://a/c"], "--put mesh: a result can be put to one place only"),
    ],
)
def test_a_place_for_results_must_be_one(put: list[str], said: str) -> None:
    with pytest.raises(InputError, match=said):
        command(MUG, MUG, server=NOBODY, put=put)


def test_a_url_is_told_without_what_may_be_secret_in_it() -> None:
    with pytest.raises(InputError) as caught:
        command(MUG, MUG, server=NOBODY, put=["mesh=ftp://x.example.org/a?signature=secret"])

    assert "secret" not in str(caught.value)


def test_results_are_not_put_over_the_files_that_were_sent(tmp_path: Path) -> None:
    mesh = tmp_path / "mug.obj"
    mesh.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")

    with pytest.raises(InputError):
        command(str(mesh), MUG, server=NOBODY, out=mesh)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"source_sha256": "5f"}, "mug.glb: '5f' is not a SHA-256: expected 64 hexadecimal digits"),
        ({"reference_sha256": "g" * 64}, "is not a SHA-256"),
    ],
)
def test_what_is_said_of_a_url_must_be_sound(more: dict[str, str], said: str) -> None:
    with pytest.raises(InputError, match=said):
        command(MUG, MUG, server=NOBODY, **more)  # type: ignore[arg-type]


@pytest.mark.parametrize("option", ["reference_secret", "reference_sha256"])
def test_secrets_and_hashes_are_for_urls(tmp_path: Path, option: str) -> None:
    mesh = tmp_path / "mug.obj"
    mesh.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")

    with pytest.raises(InputError, match=f"--{option.replace('_', '-')} is for a REFERENCE"):
        command(MUG, str(mesh), server=NOBODY, **{option: "5" * 64})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('{"gates": {"deviation.max": {}, "deviation.max": {}}}', "'deviation.max' is there twice"),
        ('{"pairs": 1}', "has no list 'pairs'"),
        ("nope", "is not valid JSON"),
    ],
)
def test_a_batch_that_cannot_be_sent_as_it_is_written_is_refused(
    tmp_path: Path, text: str, said: str
) -> None:
    batch = tmp_path / "night.json"
    batch.write_text(text)

    with pytest.raises(InputError, match=f"night.json: .*{said}"):
        command(server=NOBODY, batch=batch)


class Forgetful:
    """A service that has done a batch of two pairs, and tells of one of them."""

    batch = BatchRecord(id="0", created=datetime(2030, 1, 1, tzinfo=UTC), pairs=2)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def submit_batch(self, *_: object) -> Batch:
        none = dict.fromkeys(("queued", "running", *FINAL_STATES), 0)
        return Batch.of(self.batch, BatchCounts(none, {}))

    def wait_for_batch(self, *_: object, **how: object) -> None:
        pass

    def batch_result(self, *_: object) -> GateRun:
        verdict = Judgement.of({"gates": None, "warnings": []}).fields()
        mug = AssetResult(name="mug", source="mug.glb", reference=None, seconds=1.0, **verdict)
        return GateRun.of([mug])


def test_a_pair_of_a_batch_that_nothing_is_told_of_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    batch, report = tmp_path / "night.json", tmp_path / "result.json"
    batch.write_text('{"pairs": [1, 2]}')
    monkeypatch.setattr(connection, "connect", lambda _: Forgetful())

    with pytest.raises(InternalError, match="tells of 1 of the 2 pairs"):
        command(server=NOBODY, batch=batch, report=report)

    assert report.exists()


@pytest.mark.parametrize("source", ["mug.glb", f"{MUG}?version=3"])
def test_a_refined_mesh_is_not_called_what_it_is_not(tmp_path: Path, source: str) -> None:
    with pytest.raises(InputError, match=r"out\.obj: the refined mesh has the source's format"):
        command(source, MUG, server=NOBODY, out=tmp_path / "out.obj")


def test_the_name_of_what_a_script_sends_says_nothing() -> None:
    assert source_name("https://example.org/mesh.php?of=mug.glb") == ""
