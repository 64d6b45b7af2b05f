"""What is at a place on this machine, also where that may not be looked at.

``Path`` raises for a folder that is locked, for names that are too long and for those that no file
can have. What is here says no, and :func:`obstacle` why.
"""

from __future__ import annotations

import os
import stat
from pathlib import Path


def is_file(path: Path) -> bool:
    """Whether a file is there, and can be seen to be."""
    return os.path.isfile(path)  # noqa: PTH113 - Path's raises


def is_folder(path: Path) -> bool:
    """Whether a folder is there, and can be seen to be."""
    return os.path.isdir(path)  # noqa: PTH112 - Path's raises


def is_there(path: Path) -> bool:
    """Whether anything is there, and can be seen to be."""
    return os.path.exists(path)  # noqa: PTH110 - Path's raises


def is_missing(path: Path) -> bool:
    """Whether nothing is there, not even a link; false where that cannot be known."""
    try:
        path.lstat()
    except (FileNotFoundError, NotADirectoryError):
        return True
    except (OSError, ValueError):
        return False
    return False


def may_be_file(path: Path) -> bool:
    """Whether a file is there, or something that cannot be looked at."""
    try:
        return stat.S_ISREG(path.stat().st_mode)
    except (FileNotFoundError, NotADirectoryError):
        return False
    except (OSError, ValueError):
        return True


def obstacle(path: Path) -> str | None:
    """Why what is there cannot be looked at; None if it can."""
    try:
        path.stat()
    except (OSError, ValueError) as error:
        return reason(error)
    return None


def real(path: Path) -> Path:
    """A path without links, as far as it can be followed; those that lead in a circle stay."""
    return Path(os.path.realpath(path))


def reason(error: OSError | ValueError) -> str:
    """What a system has said of a file, in words that go on after a colon."""
    return ((error.strerror if isinstance(error, OSError) else None) or str(error)).lower()
