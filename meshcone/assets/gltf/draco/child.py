"""Decodes Draco data in a process of its own, which may run out of memory or crash.

Started by file name, so that it imports nothing but NumPy and DracoPy. It reads on standard
input the bytes of memory it may use, the seconds it may take, the number of blobs, their
lengths (unsigned 64-bit, little-endian) and the blobs; writes an ``.npz`` archive to standard
output; and a byte to standard error before each blob, so that the one at fault is known.
"""

import io
import struct
import sys

# Exit codes: the decoder says that a blob is no Draco mesh; memory ran out.
REFUSED, OUT_OF_MEMORY = 3, 4


def main() -> int:
    """Decode all blobs."""
    memory, seconds, count = struct.unpack("<QQQ", sys.stdin.buffer.read(24))
    lengths = struct.unpack(f"<{count}Q", sys.stdin.buffer.read(8 * count))
    blobs = [sys.stdin.buffer.read(length) for length in lengths]
    import DracoPy
    import numpy as np

    _limit(memory, seconds)
    arrays = {}
    for number, blob in enumerate(blobs):
        sys.stderr.buffer.write(b".")
        sys.stderr.buffer.flush()
        try:
            mesh = DracoPy.decode(blob)
            arrays[f"{number}/faces"] = np.asarray(mesh.faces)
        except (DracoPy.FileTypeException, AttributeError, ValueError, RuntimeError):
            return REFUSED
        except MemoryError:
            return OUT_OF_MEMORY
        for attribute in mesh.attributes:
            arrays[f"{number}/{attribute['unique_id']}"] = np.asarray(attribute["data"])
    archive = io.BytesIO()
    try:
        np.savez(archive, allow_pickle=False, **arrays)
    except MemoryError:
        return OUT_OF_MEMORY
    sys.stdout.buffer.write(archive.getbuffer())
    sys.stdout.buffer.flush()
    return 0


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
