"""ZIP archives that tests make, with Python's own module."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping


def packed(files: Mapping[str, bytes], method: int = zipfile.ZIP_DEFLATED) -> bytes:
    """An archive of some files, with a fixed time for each."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", method) as archive:
        for name, content in files.items():
            entry = zipfile.ZipInfo(name, (2020, 2, 2, 20, 20, 20))
            entry.compress_type = method
            entry.external_attr = 0o100644 << 16
            entry.comment = f"what {name} is".encode()
            archive.writestr(entry, content)
        archive.comment = b"made by a test"
    return out.getvalue()


def unpacked(data: bytes) -> dict[str, bytes]:
    """What is in an archive; its checksums are compared."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}
