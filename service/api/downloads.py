"""A file of a job as an answer: whole, in part, or not at all where the client has it.

RFC 9110: section 8.8.3 (ETag), 13.1.2 (If-None-Match), 13.1.5 (If-Range), 14 (Range).
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any
from urllib.parse import quote

from fastapi import Depends, Header, Request, Response, status
from starlette.responses import StreamingResponse

from service.api.routing import Absent
from service.problems import MEDIA_TYPE, ProblemError, problem
from worker.jobs.records import Artifact
from worker.storage.blobs import BlobStore

_SPAN = re.compile(r"bytes\s*=\s*(\d{0,18})-(\d{0,18})", re.ASCII | re.IGNORECASE)
_TAG = re.compile(r'(?:W/)?("[^"]*")')
BYTES: Mapping[str, Any] = {
    "type": "string",
    # What OpenAPI 3.0 called it: generators of clients look for that still.
    "format": "binary",
    "contentMediaType": "application/octet-stream",
}
"""The schema of a file of any kind."""

_PROBLEM = {"content": {MEDIA_TYPE: {"schema": {"$ref": "#/components/schemas/Problem"}}}}


@dataclass(frozen=True)
class Conditions:
    """What a request says of the copy its sender has, and the part it wants."""

    none_match: str | None = None
    span: str | None = None
    if_range: str | None = None
    headers_only: bool = False

    def has_current(self, tag: str) -> bool:
        """Whether the client has what the tag stands for."""
        if self.none_match is None:
            return False
        return self.none_match.strip() == "*" or tag in _TAG.findall(self.none_match)

    def part(self, tag: str, size: int) -> range | None:
        """The positions that are wanted; None for the whole, which also answers what is unclear.

        Only a GET has parts (RFC 9110, section 14.2).

        Raises:
            ProblemError: there are none of those positions in the file.
        """
        if self.headers_only:
            return None
        if self.span is None or (self.if_range is not None and self.if_range.strip() != tag):
            return None
        match = _SPAN.fullmatch(self.span.strip())
        if match is None or match.groups() == ("", ""):
            return None  # several parts, or no part of bytes
        first, last = match.groups()
        if first == "":
            part = range(max(0, size - int(last)), size)
        else:
            part = range(int(first), size if last == "" else min(size, int(last) + 1))
        if last and first and int(last) < int(first):
            return None
        if not part:
            detail = f"the file has {size} bytes"
            raise ProblemError(problem("range", detail), {"Content-Range": f"bytes */{size}"})
        return part


def _conditions(
    request: Request,
    if_none_match: Annotated[
        str | Absent, Header(description="ETags of copies the client has")
    ] = None,
    range_: Annotated[
        str | Absent, Header(alias="Range", description="a part, such as bytes=0-1023")
    ] = None,
    if_range: Annotated[
        str | Absent, Header(description="the ETag the part is to be of; else all is sent")
    ] = None,
) -> Conditions:
    return Conditions(if_none_match, range_, if_range, request.method == "HEAD")


ConditionsDependency = Annotated[Conditions, Depends(_conditions)]


def file_response(blobs: BlobStore, artifact: Artifact, conditions: Conditions) -> Response:
    """The answer to a request for a file.

    Raises:
        ProblemError: it is gone, or the part that is wanted is not in it.
    """
    tag = f'"{artifact.digest}"'
    headers = {
        **cache_headers(tag),
        "Accept-Ranges": "bytes",
        "Content-Disposition": _attachment(artifact.filename),
    }
    if conditions.has_current(tag):
        return Response(status_code=status.HTTP_304_NOT_MODIFIED, headers=headers)
    part = conditions.part(tag, artifact.size)
    length = artifact.size if part is None else len(part)
    headers["Content-Length"] = str(length)
    if part is not None:
        headers["Content-Range"] = f"bytes {part.start}-{part.stop - 1}/{artifact.size}"
    code = status.HTTP_200_OK if part is None else status.HTTP_206_PARTIAL_CONTENT
    try:
        if conditions.headers_only:
            blobs.size(artifact.digest)  # a file that a GET would not serve is no 200 here either
            return Response(status_code=code, headers=headers, media_type=artifact.media_type)
        content = blobs.chunks(artifact.digest, part)
    except FileNotFoundError:
        raise ProblemError(problem("gone", "the file has been removed")) from None
    return StreamingResponse(content, code, headers, artifact.media_type)


def cache_headers(tag: str) -> Mapping[str, str]:
    """Keep it, but ask each time: the job can be deleted."""
    return {"ETag": tag, "Cache-Control": "private, no-cache"}


def file_responses(
    description: str, *media_types: str, schema: Mapping[str, Any] | None = None
) -> dict[int | str, dict[str, Any]]:
    """What the API's description says of such an answer.

    Args:
        description: what the file is.
        media_types: what it can be sent as.
        schema: of the file's content, where it is JSON.
    """
    whole: dict[str, Any] = {
        media_type: {"schema": schema or {**BYTES, "contentMediaType": media_type}}
        for media_type in media_types
    }
    part: dict[str, Any] = {"description": "the part that was asked for"}
    if schema is None:  # a part of a document is none, whatever its media type says
        part["content"] = whole
    return {
        200: {"description": description, "content": whole},
        206: part,
        304: {"description": "the copy named by If-None-Match is current"},
        416: {"description": "the file has no such part", **_PROBLEM},
    }


def _attachment(filename: str) -> str:
    """Content-Disposition of a download (RFC 6266, section 4.3)."""
    plain = re.sub(r'[^\x20-\x7e]|["\\%]', "_", filename)
    return f"attachment; filename=\"{plain}\"; filename*=UTF-8''{quote(filename, safe='')}"
