"""Image data in, pixels out, with the decoders at arm's length.

PNG, JPEG and WebP are decoded by C libraries that trust their input more than this project
does. They run in a process of their own, with bounds on memory and processor time that follow
from the size that the image's header declares, and die there.
"""

from __future__ import annotations

import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import IO, Self

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.pictures.child import ANSWER, DAMAGED, DECODED, REQUEST
from meshcone.assets.pictures.picture import MOST_TEXELS, Picture, UndecodableError
from meshcone.lifeline import tied_command

_CHILD = Path(__file__).with_name("child.py")
_CHANNELS = 4
_BASE_MEMORY = 256 << 20  # Python and Pillow, idle
_MEMORY_PER_TEXEL = 16  # twice as RGBA, or once and the coefficients of a progressive JPEG
_BASE_SECONDS = 5
_TEXELS_PER_SECOND = 4 << 20  # a tenth of what it does on a slow machine
_LONGEST_REASON = 200


class PictureDecoder:
    """Decodes images, one at a time; its process starts with the first of them.

    A process that ended over an image is started anew for the next one.
    """

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._end()

    def pixels(self, picture: Picture) -> NDArray[np.uint8]:
        """(h, w, 4) RGBA as encoded, 16 bits cut to 8; colour profiles are not applied.

        glTF has viewers ignore them (section 3.8.4.3).

        Raises:
            UndecodableError: it has too many texels, is damaged, or of a format that is not
                decoded here.
        """
        if picture.fault is not None:
            raise UndecodableError(picture.fault, damaged=picture.image.data is not None)
        if picture.format == "ktx2":
            raise UndecodableError("KTX2 images are not decoded")
        width, height = picture.width or 0, picture.height or 0
        if not 0 < width * height <= MOST_TEXELS:
            raise UndecodableError(
                f"{width}x{height} are more than the {MOST_TEXELS:,} texels decoded here"
            )
        pixels = self._ask(picture.image.data or b"", width * height)
        if len(pixels) != width * height * _CHANNELS:
            raise UndecodableError(
                "damaged: it has another size than its header says", damaged=True
            )
        return np.frombuffer(pixels, dtype=np.uint8).reshape(height, width, _CHANNELS)

    def _ask(self, data: bytes, texels: int) -> bytes:
        memory = _BASE_MEMORY + _MEMORY_PER_TEXEL * texels + 2 * len(data)
        seconds = _BASE_SECONDS + texels // _TEXELS_PER_SECOND
        process = self._process = self._process or _started()
        assert process.stdin is not None  # noqa: S101 - both are pipes
        assert process.stdout is not None  # noqa: S101
        try:
            process.stdin.write(REQUEST.pack(memory, seconds, len(data)))
            process.stdin.write(data)
            process.stdin.flush()
            status, length = ANSWER.unpack(_read(process.stdout, ANSWER.size))
            answer = _read(process.stdout, length)
        except (OSError, EOFError):
            self._end()
            raise UndecodableError("it crashes the decoder") from None
        except MemoryError:
            self._end()
            raise UndecodableError("there is not enough memory for its pixels") from None
        except BaseException:  # a time limit, an interrupt: what is in the pipe belongs to nobody
            self._end()
            raise
        if status != DECODED:
            reason = answer[:_LONGEST_REASON].decode("utf-8", "replace")
            raise UndecodableError(reason, damaged=status == DAMAGED)
        return answer

    def _end(self) -> None:
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            # Bytes that it did not take are dropped with it.
            with suppress(BrokenPipeError), process:
                pass


def _started() -> subprocess.Popen[bytes]:
    return subprocess.Popen(  # noqa: S603 - our own interpreter and file
        tied_command([sys.executable, "-I", str(_CHILD)], signal.SIGKILL),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    )


def _read(stream: IO[bytes], length: int) -> bytes:
    data = stream.read(length)
    if len(data) < length:
        raise EOFError
    return data
