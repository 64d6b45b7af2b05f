"""Files that are either written whole or not at all."""

from __future__ import annotations

import errno
import os
import stat
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path, PurePath

from meshcone.errors import InputError
from meshcone.places import is_folder, is_missing, is_there, obstacle, real, reason


def write_together(contents: Mapping[Path, bytes]) -> None:
    """Write files beside their places first, and move them there when all are complete.

    Links stay: what they lead to is written. Devices and pipes stay too, and are written into
    before anything is moved.

    Raises:
        InputError: one of them cannot be written; then no file is.
    """
    written: dict[Path, Path] = {}
    try:
        for path, data in contents.items():
            if not _takes_bytes(path):
                written[path] = _write_beside(_target(path), data)
        for path, data in contents.items():
            if path not in written:
                path.write_bytes(data)
        for path, temporary in written.items():
            temporary.replace(_target(path))
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be written: {reason(error)}", file=str(path)) from None
    finally:
        for temporary in written.values():
            temporary.unlink(missing_ok=True)


def certificate_path(report: Path) -> Path:
    """Where the certificate of a report is: beside it, under the same name."""
    return report.with_name(f"{report.stem}.certificate.npz")


def certificate_place(report: Path | None) -> Path | None:
    """Where the certificate of a report will be, if one is to be written.

    Raises:
        InputError: the report is to go into a device or a pipe, which has no place beside it.
    """
    if report is None:
        return None
    if _takes_bytes(report):
        raise InputError(
            "it is no regular file, and a report has its certificate beside it: "
            "give a name of a file for the report",
            file=str(report),
        )
    return certificate_path(report)


def require_places(outputs: Iterable[Path | None], inputs: Iterable[Path]) -> None:
    """Refuse places that cannot be written, before any work is done for them.

    Args:
        outputs: where files are to be written; None is left out.
        inputs: what was read or will be, under whatever name or link.

    Raises:
        InputError: a directory does not exist or is in a file's place, two files have the same
            place, or a file would take the place of an input.
    """
    places = [path for path in outputs if path is not None]
    taken: set[Path] = set()
    for path in places:
        _require_writable(path)
        if real(path) in taken:
            raise InputError(
                "two files are to be written here: give each a name of its own", file=str(path)
            )
        taken.add(real(path))
    existing = [path for path in places if is_there(path)]  # others cannot be an input
    for own in inputs if existing else ():
        for path in existing:
            if is_there(own) and path.samefile(own):
                raise InputError(
                    "it is an input and would be overwritten: choose another name "
                    "for what is written",
                    file=str(path),
                )


def require_format(out: Path, source: str) -> None:
    """Refuse a name for a refined mesh that says another format than its source's.

    Args:
        out: where the refined mesh is to be written.
        source: file name of the source.

    Raises:
        InputError: the two end in different ways.
    """
    suffix = PurePath(source).suffix
    if suffix and out.suffix.lower() != suffix.lower():
        raise InputError(
            f"the refined mesh has the source's format: its name must end in '{suffix}'",
            file=str(out),
        )


def require_folder(folder: Path) -> None:
    """Refuse a folder that is not there and cannot be made, before any work is done for it.

    Raises:
        InputError: a file is in its place or above it, or nothing may be written there.
    """
    place = folder
    while is_missing(place) and place != place.parent:
        place = place.parent
    if not is_folder(place):
        words = obstacle(place) or "not a directory"
        raise InputError(f"cannot be made: {words}", file=str(folder))
    if not os.access(place, os.W_OK | os.X_OK):
        words = "be written" if place == folder else "be made"
        raise InputError(f"cannot {words}: permission denied", file=str(folder))


def _require_writable(path: Path) -> None:
    if is_folder(path):
        raise InputError("cannot be written: is a directory", file=str(path))
    if _takes_bytes(path):
        allowed = os.access(path, os.W_OK)
    else:
        try:
            folder = _target(path).parent
        except (OSError, ValueError) as error:
            raise InputError(f"cannot be written: {reason(error)}", file=str(path)) from None
        if not is_folder(folder):
            words = "its directory does not exist" if is_missing(folder) else obstacle(folder)
            words = words or "its directory is none"
            raise InputError(f"cannot be written: {words}", file=str(path))
        allowed = os.access(folder, os.W_OK | os.X_OK)  # which gets a new file
    if not allowed:
        raise InputError("cannot be written: permission denied", file=str(path))


def _takes_bytes(path: Path) -> bool:
    """Whether a device or a pipe is there. A file in its place would end it for all who use it."""
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError):
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))


def _target(path: Path) -> Path:
    """What a path leads to, through links that are there, whether or not that is."""
    target = Path(os.path.realpath(path))
    if target.is_symlink():  # links that lead in a circle
        raise OSError(errno.ELOOP, os.strerror(errno.ELOOP))
    return target


def _write_beside(path: Path, data: bytes) -> Path:
    # Not under the file's own name, which may be as long as a name can be.
    descriptor, name = tempfile.mkstemp(prefix=".meshcone-", dir=path.parent)
    temporary = Path(name)
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(data)
        # mkstemp's 0600 is for secrets; what is written anew stays as open as it was.
        temporary.chmod(_mode(path))
    except BaseException:  # an interrupt, too, leaves nothing behind
        temporary.unlink(missing_ok=True)
        raise
    return temporary


def _mode(path: Path) -> int:
    try:
        return stat.S_IMODE(path.stat().st_mode) & 0o777
    except FileNotFoundError:
        return 0o666 & ~_umask()


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
