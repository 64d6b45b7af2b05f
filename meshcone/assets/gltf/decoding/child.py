"""Decodes compressed geometry in a process of its own, which may run out of memory or crash.

Started by file name with the name of a decoder, so that it imports nothing but NumPy and that.
It reads on standard input the bytes of memory it may use, the seconds it may take, the number of
blobs, their lengths (unsigned 64-bit, little-endian) and the blobs; writes an ``.npz`` archive to
standard output, each array named after the number of its blob and its own name; and a byte to
standard error before each blob, so that the one at fault is known.
"""

import io
import struct
import sys
from collections.abc import Callable
from typing import Any

_Decode = Callable[[bytes], "dict[str, Any] | None"]

# Exit codes: the decoder says that a blob is damaged; memory ran out.
REFUSED, OUT_OF_MEMORY = 3, 4

# Before the data of a meshopt blob: elements, bytes of each, and the names' places in these lists.
MESHOPT_HEAD = struct.Struct("<QQBB")
MODES = ("ATTRIBUTES", "TRIANGLES", "INDICES")
FILTERS = ("NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR")


def main() -> int:
    """Decode all blobs."""
    memory, seconds, count = struct.unpack("<QQQ", sys.stdin.buffer.read(24))
    lengths = struct.unpack(f"<{count}Q", sys.stdin.buffer.read(8 * count))
    blobs = [sys.stdin.buffer.read(length) for length in lengths]
    import numpy as np

    decode = {"draco": _draco, "meshopt": _meshopt}[sys.argv[1]]()
    _limit(memory, seconds)
    arrays = {}
    for number, blob in enumerate(blobs):
        sys.stderr.buffer.write(b".")
        sys.stderr.buffer.flush()
        try:
            found = decode(blob)
        except MemoryError:
            return OUT_OF_MEMORY
        if found is None:
            return REFUSED
        arrays.update({f"{number}/{name}": array for name, array in found.items()})
    archive = io.BytesIO()
    try:
        np.savez(archive, allow_pickle=False, **arrays)
    except MemoryError:
        return OUT_OF_MEMORY
    sys.stdout.buffer.write(archive.getbuffer())
    sys.stdout.buffer.flush()
    return 0


def _draco() -> _Decode:
    import DracoPy
    import numpy as np

    def decode(blob: bytes) -> dict[str, Any] | None:
        try:
            mesh = DracoPy.decode(blob)
            faces = np.asarray(mesh.faces)
        except (DracoPy.FileTypeException, AttributeError, ValueError, RuntimeError):
            return None
        attributes = {str(a["unique_id"]): np.asarray(a["data"]) for a in mesh.attributes}
        return {"faces": faces, **attributes}

    return decode


def _meshopt() -> _Decode:
    import meshopt
    import numpy as np

    def decode(blob: bytes) -> dict[str, Any] | None:
        count, size, mode, kind = MESHOPT_HEAD.unpack_from(blob)
        data = blob[MESHOPT_HEAD.size :]
        try:
            rows = meshopt.decode_gltf_buffer(data, count, size, MODES[mode], FILTERS[kind])
        except ValueError:
            return None
        return {"rows": np.frombuffer(np.ascontiguousarray(rows).tobytes(), np.uint8)}

    return decode


def _limit(memory: int, seconds: int) -> None:
    try:
        import resource
    except ImportError:  # not on Windows, where the caller's time limit is all there is
        return
    resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


if __name__ == "__main__":
    sys.exit(main())
