"""Directories for the temporary files of processes that may be killed."""

from __future__ import annotations

import tempfile
from pathlib import Path

import pytest

from meshcone.scratch import remove_orphans, scratch, work_in


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where this test's temporary files go."""
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def orphan(place: Path) -> Path:
    """What is left of a directory whose owner was killed."""
    with scratch() as path:
        assert path is not None
        (path / "meshcone-scs-x").mkdir()
        (path / "meshcone-scs-x/iterations.csv").write_text("1")
        return path.rename(place / "kept")


def test_what_a_process_leaves_is_removed_with_its_directory(place: Path) -> None:
    with scratch() as path:
        assert path is not None
        (path / "scene.usd").write_bytes(b"left")

    assert not list(place.iterdir())


def test_a_process_puts_its_temporary_files_there(place: Path) -> None:
    with scratch() as path:
        work_in(path)

        with tempfile.TemporaryDirectory() as made:
            assert Path(made).parent == path != place


def test_a_directory_whose_owner_was_killed_is_removed(place: Path) -> None:
    orphan(place).rename(place / "meshcone-job-12345678")

    remove_orphans()

    assert not list(place.iterdir())


def test_a_directory_whose_owner_lives_stays(place: Path) -> None:
    with scratch() as path:
        remove_orphans()

        assert list(place.iterdir()) == [path]


def test_somebodys_folder_with_such_a_name_stays(place: Path) -> None:
    own = place / "meshcone-job-notes"
    own.mkdir()
    (own / "notes.txt").touch()

    remove_orphans()

    assert (own / "notes.txt").exists()


def test_a_link_with_such_a_name_leads_to_nothing_that_is_removed(place: Path) -> None:
    elsewhere = orphan(place)
    (place / "meshcone-job-12345678").symlink_to(elsewhere)

    remove_orphans()

    assert (elsewhere / "meshcone-scs-x").exists()


def test_where_none_can_be_made_a_process_has_none(
    place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(**_: object) -> str:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(tempfile, "mkdtemp", full)

    with scratch() as path:
        assert path is None
    assert not list(place.iterdir())
