"""Decodes images in a process of its own, which may run out of memory or crash.

Started by file name, so that it imports nothing but Pillow. For each image it reads on
standard input the bytes of memory it may use, the seconds it may take, the number of bytes
(unsigned 64-bit, little-endian) and the bytes. It answers on standard output with a status (one
byte), the number of bytes that follow (unsigned 64-bit), and these: RGBA row by row, or why not.
What says nothing of the image, such as too little memory, has a status of its own.
"""

import io
import struct
import sys
import time
from collections.abc import Iterator
from typing import BinaryIO

from PIL import Image

DECODED, DAMAGED, REFUSED = 0, 1, 2
REQUEST, ANSWER = struct.Struct("<QQQ"), struct.Struct("<BQ")
FORMATS = ("PNG", "JPEG", "WEBP")
_ROWS = 64


def main() -> int:
    """Decode what is asked for until nothing is."""
    source, sink = sys.stdin.buffer, sys.stdout.buffer
    while len(head := source.read(REQUEST.size)) == REQUEST.size:
        memory, seconds, length = REQUEST.unpack(head)
        data = source.read(length)
        _limit(memory, seconds)
        try:
            image = _decoded(data)
        except MemoryError:
            why = "decoding it takes more memory than an image of its size needs"
            _refuse(sink, REFUSED, why)
        except Exception as error:  # noqa: BLE001 - whatever Pillow raises over damaged files
            _refuse(sink, DAMAGED, f"damaged: {error}")
        else:
            sink.write(ANSWER.pack(DECODED, 4 * image.width * image.height))
            for strip in _strips(image):
                sink.write(strip)
            del image  # its memory is the next one's
        sink.flush()
    return 0


def _refuse(sink: BinaryIO, status: int, why: str) -> None:
    reason = why.encode()
    sink.write(ANSWER.pack(status, len(reason)) + reason)


def _decoded(data: bytes) -> Image.Image:
    opened = Image.open(io.BytesIO(data), formats=FORMATS)
    if opened.format == "PNG":  # whose checksums are not looked at otherwise
        Image.open(io.BytesIO(data), formats=("PNG",)).verify()
    opened.load()
    if not opened.mode.startswith("I"):
        return opened
    # 16 bits of grey: the upper byte of each.
    width = 2 if ";16" in opened.mode else 4
    return Image.frombytes("L", opened.size, opened.tobytes()["B" not in opened.mode :: width])


def _strips(image: Image.Image) -> Iterator[bytes]:
    """RGBA of some rows at a time: a second copy of all of it would double the memory."""
    for top in range(0, image.height, _ROWS):
        box = (0, top, image.width, min(top + _ROWS, image.height))
        yield image.crop(box).convert("RGBA").tobytes()


def _limit(memory: int, seconds: int) -> None:
    try:
        import resource
    except ImportError:  # not on Windows, where nothing but the cap on texels bounds it
        return
    for which, soft in (
        (resource.RLIMIT_AS, memory),
        (resource.RLIMIT_CPU, int(time.process_time()) + seconds),
        (resource.RLIMIT_CORE, 0),
    ):
        _, hard = resource.getrlimit(which)
        if hard != resource.RLIM_INFINITY:
            soft = min(soft, hard)
        resource.setrlimit(which, (soft, hard))


if __name__ == "__main__":
    sys.exit(main())
