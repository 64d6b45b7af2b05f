"""The names that a fetched glTF has for files beside it."""

from __future__ import annotations

import io
import json

import pytest

from meshcone.errors import InputError, LimitError
from worker.transfers.relative import NAMES_BYTES, RELATIVE_FILES, beside, joined, names_in

FOLDER = "https://assets.example.org/mug"


def gltf(*uris: str) -> io.BytesIO:
    return io.BytesIO(json.dumps({"buffers": [{"uri": uri} for uri in uris]}).encode())


def test_each_name_is_told_once() -> None:
    assert names_in(gltf("a.bin", "data/b%20c.bin", "./a.bin")) == ["a.bin", "data/b c.bin"]


def test_a_name_may_have_spaces_of_any_width() -> None:
    assert names_in(gltf("a%C2%A0b.bin", "c%E3%80%80d.bin")) == ["a\u00a0b.bin", "c\u3000d.bin"]


@pytest.mark.parametrize("uri", ["a" * 256, "a%0ab.bin", "a%1b[2Jb.bin", "a%E2%80%AEnib.bin"])
def test_a_name_that_is_too_long_or_not_printable_is_refused_in_printable_words(uri: str) -> None:
    with pytest.raises(InputError, match="one line of up to 255 characters") as caught:
        names_in(gltf("a.bin", uri))

    assert caught.value.message.isprintable()


def test_names_are_bounded_together() -> None:
    letters = 252  # of two bytes each
    uris = [f"{number:03}" + "é" * letters for number in range(RELATIVE_FILES)]
    fitting = NAMES_BYTES // (3 + 2 * letters)

    assert len(names_in(gltf(*uris[:fitting]))) == fitting
    with pytest.raises(LimitError, match="bytes together"):
        names_in(gltf(*uris[: fitting + 1]))


def test_a_file_beside_another_has_its_folder_and_no_query() -> None:
    assert beside(f"{FOLDER}/mug.gltf?token=3f9a", "a b.bin") == f"{FOLDER}/a%20b.bin"
    assert beside("s3://incoming/mug/mug.gltf", "a b.bin") == "s3://incoming/mug/a b.bin"


@pytest.mark.parametrize("folder", ["a/", "a/.", "a/b/..", "/a", "a//b", "%61;v=1"])
def test_a_folder_is_spelled_as_it_was_however_odd(folder: str) -> None:
    url = f"https://assets.example.org/{folder}"

    assert beside(f"{url}/m.gltf?folder=a/b", "c/x.bin") == f"{url}/c/x.bin"


def test_a_file_beside_one_without_a_path_is_at_the_same_host() -> None:
    assert beside("https://assets.example.org?id=a/m.gltf", "x.bin") == (
        "https://assets.example.org/x.bin"
    )


@pytest.mark.parametrize(
    ("reference", "target"),
    [
        ("x.glb", "https://h/a//x.glb"),
        ("../x.glb", "https://h/a/x.glb"),
        ("/b//x.glb", "https://h/b//x.glb"),
        ("?v=2", "https://h/a//m.glb?v=2"),
        ("//other/x.glb", "https://other/x.glb"),
        ("https://other/a//x.glb", "https://other/a//x.glb"),
    ],
)
def test_a_reference_is_beside_a_url_whose_folders_are_kept(reference: str, target: str) -> None:
    assert joined("https://h/a//m.glb", reference) == target


def test_an_empty_first_folder_is_not_taken_for_a_host() -> None:
    assert joined("https://h//a/m.glb", "x.glb") == "https://h//a/x.glb"


@pytest.mark.parametrize("scheme", ["https", "s3"])
def test_a_url_that_becomes_too_long_is_refused(scheme: str) -> None:
    folder = f"{scheme}://assets.example.org/" + "d" * 2000

    with pytest.raises(InputError, match="2048 can be fetched"):
        beside(f"{folder}/mug.gltf", "é" * 255)
