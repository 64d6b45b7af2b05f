"""Files that are either written whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path

from meshcone.errors import InputError


def write_together(contents: Mapping[Path, bytes]) -> None:
    """Write files beside their places first, and move them there when all are complete.

    Raises:
        InputError: one of them cannot be written; then none is.
    """
    written: dict[Path, Path] = {}
    try:
        for path, data in contents.items():
            written[path] = _write_beside(path, data)
        for path, temporary in written.items():
            temporary.replace(path)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise InputError(f"cannot be written: {reason}", file=str(path)) from None
    finally:
        for temporary in written.values():
            temporary.unlink(missing_ok=True)


def certificate_path(report: Path) -> Path:
    """Where the certificate of a report is: beside it, under the same name."""
    return report.with_name(f"{report.stem}.certificate.npz")


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
        if path.resolve() in taken:
            raise InputError(
                "two files are to be written here: give each a name of its own", file=str(path)
            )
        taken.add(path.resolve())
    existing = [path for path in places if path.exists()]  # others cannot be an input
    for own in inputs if existing else ():
        for path in existing:
            if own.exists() and path.samefile(own):
                raise InputError(
                    "it is an input and would be overwritten: choose another name "
                    "for what is written",
                    file=str(path),
                )


def _require_writable(path: Path) -> None:
    if path.is_dir():
        raise InputError("cannot be written: is a directory", file=str(path))
    if not path.parent.is_dir():
        raise InputError("cannot be written: its directory does not exist", file=str(path))
    if not os.access(path.parent, os.W_OK):
        raise InputError("cannot be written: permission denied", file=str(path))


def _write_beside(path: Path, data: bytes) -> Path:
    descriptor, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    temporary = Path(name)
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(data)
        temporary.chmod(0o666 & ~_umask())  # mkstemp's 0600 is for secrets
    except OSError:
        temporary.unlink(missing_ok=True)
        raise
    return temporary


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
