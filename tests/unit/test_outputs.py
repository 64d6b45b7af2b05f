"""Where files are written, and what is there already."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from pathlib import Path

import pytest

from meshcone.errors import InputError
from meshcone.outputs import certificate_place, require_places, write_together


@pytest.fixture
def pipe(tmp_path: Path) -> Iterator[Path]:
    """A pipe that is open for reading."""
    place = tmp_path / "pipe"
    os.mkfifo(place)
    descriptor = os.open(place, os.O_RDWR)
    yield place
    os.close(descriptor)


def waiting_in(pipe: Path) -> bytes:
    descriptor = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        return os.read(descriptor, 1000)
    finally:
        os.close(descriptor)


def test_a_pipe_is_written_into_and_stays(pipe: Path) -> None:
    require_places([pipe], [])
    write_together({pipe: b"report"})

    assert stat.S_ISFIFO(pipe.stat().st_mode)
    assert waiting_in(pipe) == b"report"


def test_a_link_stays_and_what_it_leads_to_is_written(tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    link, target = tmp_path / "link.json", tmp_path / "there" / "report.json"
    link.symlink_to(target)

    for data in (b"first", b"second"):  # where nothing is, and where a file is
        require_places([link], [])
        write_together({link: data})

        assert (link.is_symlink(), target.read_bytes()) == (True, data)
    assert [each.name for each in target.parent.iterdir()] == ["report.json"]


def test_links_in_a_circle_and_into_no_directory_are_refused(tmp_path: Path) -> None:
    circle, nowhere = tmp_path / "circle", tmp_path / "nowhere"
    circle.symlink_to(circle)
    nowhere.symlink_to(tmp_path / "missing" / "file")

    for link, words in ((circle, "symbolic links"), (nowhere, "directory does not exist")):
        with pytest.raises(InputError, match=words):
            require_places([link], [])
        with pytest.raises(InputError, match="cannot be written"):
            write_together({link: b""})
        assert link.is_symlink()


def test_what_cannot_be_written_leaves_no_file(tmp_path: Path) -> None:
    beside = tmp_path / "beside"
    gone = tmp_path / "gone"
    gone.symlink_to(gone)

    with pytest.raises(InputError, match="cannot be written"):
        write_together({beside: b"mesh", gone: b"report"})
    assert {each.name for each in tmp_path.iterdir()} == {"gone"}


def test_a_file_that_is_written_anew_keeps_its_permissions(tmp_path: Path) -> None:
    place = tmp_path / "report.json"
    place.touch()
    place.chmod(0o640)

    write_together({place: b"report"})

    assert stat.S_IMODE(place.stat().st_mode) == 0o640


def test_a_report_with_a_certificate_beside_it_goes_into_no_pipe(pipe: Path) -> None:
    with pytest.raises(InputError, match="no regular file, and a report has its certificate"):
        certificate_place(pipe)


def test_an_interrupt_leaves_no_part_of_a_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(Path, "chmod", interrupted)

    with pytest.raises(KeyboardInterrupt):
        write_together({tmp_path / "report.json": b"{}"})

    assert not list(tmp_path.iterdir())
