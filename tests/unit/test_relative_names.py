"""Which file beside a mesh a name means, and that none means one elsewhere."""

from __future__ import annotations

from pathlib import PurePosixPath

import pytest
from hypothesis import given
from hypothesis import strategies as st

from meshcone.relative_names import from_uri, inside, sent_as


@pytest.mark.parametrize(
    ("uri", "path"),
    [
        ("a.bin", "a.bin"),
        ("./a.bin", "a.bin"),
        ("data/a%20b.bin", "data/a b.bin"),
        ("data/./x/../a.bin", "data/a.bin"),
        ("data\\a.bin", "data/a.bin"),
        ("%64ata%2Fa.bin", "data/a.bin"),
    ],
)
def test_a_relative_uri_means_a_file_in_the_folder(uri: str, path: str) -> None:
    assert from_uri(uri) == path


@pytest.mark.parametrize(
    "uri",
    [
        "",
        ".",
        "..",
        "a/",
        "/a",
        "\\a",
        "../a",
        "a/../../a",
        "%2e%2e/a",
        "file:a",
        "C:\\a",
        "./C:",
        "a%00",
    ],
)
def test_anything_else_means_none(uri: str) -> None:
    assert from_uri(uri) is None


@given(st.text("ab./\\%:2eE5cC\0", max_size=20))
def test_no_name_leads_out_of_the_folder(uri: str) -> None:
    for path in filter(None, (from_uri(uri), inside(uri))):
        parts = PurePosixPath(path).parts
        assert not PurePosixPath(path).is_absolute()
        assert ".." not in parts
        assert "\\" not in path
        assert inside(path) == path


def test_a_file_is_found_below_the_name_of_its_folder_unless_two_are() -> None:
    sent = {"model/a.bin": b"", "model/b.bin": b"", "other/b.bin": b""}
    assert sent_as("a.bin", sent) == "model/a.bin"
    assert sent_as("model/a.bin", sent) == "model/a.bin"
    assert sent_as("b.bin", sent) is None
    assert sent_as("in.bin", sent) is None
