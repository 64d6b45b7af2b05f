"""Conditions and ranges (RFC 9110), decided without a file."""

from __future__ import annotations

from pathlib import Path

import pytest
from redis import Redis

from service.api.downloads import Conditions, file_response
from service.problems import ProblemError
from worker.jobs.records import Artifact
from worker.storage.blobs import BlobStore
from worker.storage.local import Directory
from worker.storage.register import BlobRegister

TAG = '"abc"'


@pytest.mark.parametrize("known", ['"abc"', 'W/"abc"', '"x", "abc"', '"x" , W/"abc"', "*"])
def test_a_client_that_names_the_tag_has_the_file(known: str) -> None:
    assert Conditions(none_match=known).has_current(TAG)


@pytest.mark.parametrize("known", [None, "", '"x"', "abc", '"ab"', '"abcd"', '"x*"'])
def test_any_other_client_has_not(known: str | None) -> None:
    assert not Conditions(none_match=known).has_current(TAG)


@pytest.mark.parametrize(
    ("span", "part"),
    [
        ("bytes=0-3", range(4)),
        ("bytes=4-", range(4, 10)),
        ("bytes=8-99", range(8, 10)),
        ("bytes=-3", range(7, 10)),
        ("bytes=-99", range(10)),
        ("Bytes = 9-9", range(9, 10)),
    ],
)
def test_a_span_is_a_part_of_the_file(span: str, part: range) -> None:
    assert Conditions(span=span).part(TAG, 10) == part


@pytest.mark.parametrize("span", ["bytes=10-", "bytes=99-100", "bytes=-0"])
def test_a_span_beyond_the_file_cannot_be_had(span: str) -> None:
    with pytest.raises(ProblemError) as refusal:
        Conditions(span=span).part(TAG, 10)

    assert refusal.value.problem.status == 416
    assert refusal.value.headers == {"Content-Range": "bytes */10"}


def test_nothing_of_an_empty_file_can_be_had() -> None:
    with pytest.raises(ProblemError):
        Conditions(span="bytes=0-").part(TAG, 0)


@pytest.mark.parametrize("span", [None, "", "bytes=", "bytes=-", "bytes=3-2", "bytes=0-1,3-4", "x"])
def test_what_is_no_single_span_means_the_whole(span: str | None) -> None:
    assert Conditions(span=span).part(TAG, 10) is None


@pytest.mark.parametrize(("if_range", "partial"), [(TAG, True), ('"x"', False), ('W/"abc"', False)])
def test_a_part_is_only_of_the_file_the_client_began_with(if_range: str, partial: bool) -> None:
    part = Conditions(span="bytes=0-3", if_range=if_range).part(TAG, 10)

    assert (part is not None) == partial


@pytest.mark.parametrize(
    ("name", "plain"),
    [
        ("red mug.glb", "red mug.glb"),
        ('50%"mug".glb', "50__mug_.glb"),
        ("m\u00fcg.glb", "m_g.glb"),
        ("mug\r\nSet-Cookie: a.glb", "mug__Set-Cookie: a.glb"),
        ("mug\x7f\x1b.glb", "mug__.glb"),
    ],
)
def test_the_plain_name_of_a_download_is_printable_ascii(
    name: str, plain: str, tmp_path: Path
) -> None:
    blobs = BlobStore(Directory(tmp_path), BlobRegister(Redis()))  # neither is asked anything
    artifact = Artifact(digest="abc", media_type="model/gltf-binary", filename=name, size=1)

    answer = file_response(blobs, artifact, Conditions(none_match="*"))

    assert f'filename="{plain}"' in answer.headers["content-disposition"]
