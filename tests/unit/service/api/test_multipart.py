"""A form is read where all of it came, and only there."""

from __future__ import annotations

from tempfile import SpooledTemporaryFile

import pytest
from starlette import formparsers
from starlette.testclient import TestClient

KIND = "multipart/form-data; boundary=XX"
MESH = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
OPTIONS = b'{"mode": "measure", "gates": {"deviation.max": {"max": 1}}}'


def part(disposition: str, content: bytes) -> bytes:
    return b"--XX\r\nContent-Disposition: form-data; %s\r\n\r\n%s\r\n" % (
        disposition.encode(),
        content,
    )


MESHES = part('name="source"; filename="a.obj"', MESH) + part(
    'name="reference"; filename="b.obj"', MESH
)
PARTS = MESHES + part('name="options"', OPTIONS)
END = b"--XX--"


def sent(http: TestClient, content: bytes, kind: str = KIND) -> tuple[int, str]:
    answer = http.post("/v1/jobs", content=content, headers={"Content-Type": kind})
    return answer.status_code, answer.json()["detail"]


@pytest.mark.parametrize(
    "content",
    [
        MESHES[:-20],
        MESHES,
        MESHES + b'--XX\r\nContent-Disposition: form-data; name="opt',
        PARTS[:-30],
        PARTS[:-2],
        PARTS,
        PARTS + END[:-1],
        b"",
    ],
    ids=[
        "in a file",
        "before the options",
        "in the options' header",
        "in the options",
        "after the options",
        "before the last boundary",
        "in the last boundary",
        "before anything",
    ],
)
def test_a_form_that_was_cut_off_is_refused(http: TestClient, content: bytes) -> None:
    status, detail = sent(http, content)

    assert status == 400
    assert detail.startswith("the form ends before its last boundary")


@pytest.mark.parametrize("after", [b"", b"\r\n", b"\r\nan epilogue"])
def test_a_whole_form_is_read_whatever_follows_it(http: TestClient, after: bytes) -> None:
    status, detail = sent(http, PARTS + END + after)

    assert (status, "broker" in detail) == (503, True)  # a sound form, and nobody to take it to


def test_of_a_form_that_was_cut_off_no_file_stays_open(
    http: TestClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened: list[SpooledTemporaryFile[bytes]] = []

    def remembered(max_size: int) -> SpooledTemporaryFile[bytes]:
        opened.append(SpooledTemporaryFile(max_size))  # noqa: SIM115 - what is tested closes it
        return opened[-1]

    monkeypatch.setattr(formparsers, "SpooledTemporaryFile", remembered)

    sent(http, MESHES[:-20])

    assert [file.closed for file in opened] == [True, True]


def test_the_media_type_may_be_in_capitals(http: TestClient) -> None:
    assert sent(http, PARTS + END, "Multipart/Form-Data; boundary=XX")[0] == 503


def test_a_type_that_only_begins_like_a_form_is_none(http: TestClient) -> None:
    assert sent(http, PARTS + END, "multipart/form-database; boundary=XX")[0] == 415


def test_a_form_whose_boundary_nobody_named_is_refused_in_words(http: TestClient) -> None:
    assert sent(http, PARTS + END, "multipart/form-data")[0] == 400
