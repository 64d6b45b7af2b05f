"""Places that cannot be looked at, and names that are long or none."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

import meshcone
from meshcone.errors import InputError
from meshcone.local_files import files_of, read_local
from meshcone.outputs import require_folder, require_places, write_together
from meshcone.places import is_file, is_folder, is_missing, is_there, may_be_file, obstacle, real
from service.gating.matching import pairs_to_gate
from service.gating.pairs import read_manifest

TOO_LONG = "n" * 300
LONGEST = "n" * 251 + ".obj"  # as most file systems have it
NONE = "a\0b.obj"
_NOBODY = 65_534


@pytest.mark.parametrize("name", [TOO_LONG, NONE])
def test_what_cannot_be_looked_at_is_nothing_that_is_known(tmp_path: Path, name: str) -> None:
    place = tmp_path / name

    assert not any(look(place) for look in (is_file, is_folder, is_there, is_missing))
    assert may_be_file(place)
    assert obstacle(place) in ("file name too long", "embedded null byte")


def test_a_link_that_leads_nowhere_is_there_and_no_file(tmp_path: Path) -> None:
    link = tmp_path / "link"
    link.symlink_to("gone")

    assert (is_missing(link), is_missing(tmp_path / "gone")) == (False, True)
    assert not may_be_file(link)


def test_links_in_a_circle_have_a_place(tmp_path: Path) -> None:
    circle = tmp_path / "circle"
    circle.symlink_to(circle)

    assert real(circle) == circle


@pytest.mark.parametrize(
    ("name", "said"), [(TOO_LONG, "file name too long"), (NONE, "embedded null")]
)
def test_a_file_of_an_impossible_name_is_refused_in_words(
    tmp_path: Path, name: str, said: str
) -> None:
    place = tmp_path / name

    assert files_of(place) == [place]
    for read in (read_local, meshcone.load):
        with pytest.raises(InputError, match=f"cannot be read: {said}"):
            read(place)
    with pytest.raises(InputError, match=f"cannot be written: {said}"):
        require_places([place], [tmp_path / "input", place])
    with pytest.raises(InputError, match=f"cannot be written: {said}"):
        write_together({place: b""})
    with pytest.raises(InputError, match=f"cannot be made: {said}"):
        require_folder(place)


def test_an_input_that_cannot_be_looked_at_leaves_outputs_as_they_are(tmp_path: Path) -> None:
    (tmp_path / "report.json").touch()

    require_places([tmp_path / "report.json"], [tmp_path / TOO_LONG, tmp_path / NONE])


def test_a_name_as_long_as_one_can_be_is_written(tmp_path: Path) -> None:
    place = tmp_path / LONGEST

    require_places([place], [])
    write_together({place: b"mesh"})

    assert [each.name for each in tmp_path.iterdir()] == [LONGEST]


def test_a_pair_of_a_name_that_is_too_long_takes_no_other_pair_with_it(tmp_path: Path) -> None:
    manifest = tmp_path / "pairs.csv"
    manifest.write_text(f"source,reference\n{TOO_LONG},a.obj\nb.obj,a.obj\n")
    (tmp_path / "b.obj").touch()

    pairs = pairs_to_gate([tmp_path / "b.obj", tmp_path / TOO_LONG], manifest, None, set())

    assert [pair.name for pair in pairs] == [TOO_LONG, "b.obj"]
    assert [pair.files()[0].name for pair in pairs] == [TOO_LONG, "b.obj"]


def test_a_manifest_with_a_name_that_no_file_can_have_is_refused(tmp_path: Path) -> None:
    manifest = tmp_path / "pairs.json"
    manifest.write_text('[{"source": "a\\u0000.obj", "reference": "b.obj"}]')

    with pytest.raises(InputError, match="pair 1: a file's name has no NUL in it"):
        read_manifest(manifest)


@pytest.fixture
def locked(tmp_path: Path) -> Iterator[Path]:
    """A folder that this process may not look into; root gives its rights up meanwhile."""
    folder = tmp_path / "locked"
    folder.mkdir(mode=0)
    user = os.geteuid()
    os.seteuid(user or _NOBODY)
    try:
        yield folder
    finally:
        os.seteuid(user)


def test_a_locked_folder_is_told_as_one(locked: Path) -> None:
    with pytest.raises(InputError, match="cannot be written: permission denied"):
        require_places([locked / "out.obj"], [])
    with pytest.raises(InputError, match="cannot be read: permission denied"):
        read_local(locked / "mesh.obj")
    with pytest.raises(InputError, match="cannot be made: permission denied"):
        require_folder(locked / "pictures")
