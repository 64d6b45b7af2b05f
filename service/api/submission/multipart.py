"""A multipart form that came whole.

The framework takes what there is of a form for all of it: one that was cut off would be read as a
form that never had its last fields.
"""

from __future__ import annotations

from collections.abc import AsyncGenerator, AsyncIterator
from contextlib import aclosing

from fastapi import Request
from python_multipart.multipart import parse_options_header
from starlette.datastructures import FormData, Headers
from starlette.formparsers import MultiPartException, MultiPartParser

from meshcone.errors import LimitError
from service.api.submission.parts import MAX_LABELS, OPTIONS_BYTES, too_long
from service.problems import ProblemError, problem
from service.settings import ServiceSettings

MEDIA_TYPE = "multipart/form-data"
_MESHES_AND_OPTIONS = 3  # any of them as a file or as a plain field
_UNFINISHED = (
    "the form ends before its last boundary ('--', the boundary, '--'), so a part of it may be "
    "missing: send it again"
)


class _WholeForm(MultiPartParser):
    """Reads a form, and raises where its content ends before its last boundary."""

    def __init__(
        self,
        headers: Headers,
        stream: AsyncIterator[bytes],
        *,
        max_files: int,
        max_fields: int,
        max_part_size: int,
    ) -> None:
        super().__init__(
            headers,
            self._until_end(stream),
            max_files=max_files,
            max_fields=max_fields,
            max_part_size=max_part_size,
        )
        self._has_ended = False

    def on_end(self) -> None:
        """Take note of the last boundary."""
        self._has_ended = True

    async def _until_end(self, stream: AsyncIterator[bytes]) -> AsyncGenerator[bytes, None]:
        async for chunk in stream:
            yield chunk
        # Raised here, inside of parse(), which closes the files of a form that it cannot read.
        if not self._has_ended:
            raise MultiPartException(_UNFINISHED)


def require_utf8(content_type: str) -> None:
    """Refuse another charset, which can hold what is no text or end in an error of its decoder.

    Raises:
        ProblemError: it names one.
    """
    charset = parse_options_header(content_type)[1].get(b"charset", b"utf-8")
    if charset.lower() not in (b"utf-8", b"us-ascii"):
        raise ProblemError(problem("media-type", "send the form as UTF-8, without another charset"))


async def read_multipart(request: Request, settings: ServiceSettings) -> FormData:
    """All parts of the form that a request brings; its files are the caller's to close.

    Raises:
        ProblemError: it cannot be read, or is not there to its end.
        LimitError: it has too many parts, or one that is too long.
    """
    async with aclosing(request.stream()) as stream:
        parser = _WholeForm(
            request.headers,
            stream,
            max_files=settings.max_resources + _MESHES_AND_OPTIONS,
            max_fields=settings.max_resources + _MESHES_AND_OPTIONS + MAX_LABELS + 2,
            max_part_size=OPTIONS_BYTES,
        )
        try:
            return await parser.parse()
        except MultiPartException as error:
            raise _error(error.message) from None


def _error(message: str) -> ProblemError | LimitError:
    # The framework tells what is too much from what is broken by its words alone.
    if "exceeded maximum" in message:
        return too_long("a text field of the form is longer")
    if message.startswith("Too many"):
        return LimitError(f"the form has more than is accepted here: {message}")
    return ProblemError(problem("bad-request", message))
