"""Routes: files sent once, to be named by their hash in jobs."""

from __future__ import annotations

import hashlib
import tempfile
from datetime import UTC, datetime, timedelta
from typing import Annotated, BinaryIO, cast

from fastapi import Path, Request, Response, status
from pydantic import BaseModel, Field
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import UploadFile

from service.api.context import Context, ContextDependency
from service.api.downloads import BYTES
from service.api.routing import ResourceRouter
from service.api.sender import Sender, SenderDependency
from service.problems import ProblemError, problem
from worker.storage.errors import DamagedFileError

router = ResourceRouter(prefix="/v1/blobs", tags=["files"])

_IN_MEMORY = 1024 * 1024  # bytes; what is larger goes to disk while it comes
_BODY = {
    "requestBody": {
        "required": True,
        "content": {"application/octet-stream": {"schema": BYTES}},
    }
}

Digest = Annotated[
    str, Path(pattern=r"^[0-9a-f]{64}$", description="SHA-256 in lower-case hexadecimal digits")
]


class Blob(BaseModel):
    """A file known by its hash."""

    sha256: str
    size: int = Field(description="bytes")
    expires: datetime = Field(description="until when it is kept at least, if no job names it")


@router.put(
    "/{sha256}",
    status_code=status.HTTP_201_CREATED,
    responses={200: {"description": "the file was there already", "model": Blob}},
    openapi_extra=_BODY,
    summary="Send a file",
)
async def put_blob(
    sha256: Digest,
    request: Request,
    context: ContextDependency,
    sender: SenderDependency,
    response: Response,
) -> Blob:
    """Store a file whose hash is known, so that jobs can name it instead of bringing it.

    Sending it again keeps it for longer. What another project has sent is new all the same.
    """
    spool = tempfile.SpooledTemporaryFile(max_size=_IN_MEMORY)  # noqa: SIM115 - closed below
    upload = UploadFile(cast(BinaryIO, spool), size=0)
    try:
        found = hashlib.sha256()
        async for chunk in request.stream():
            found.update(chunk)
            await upload.write(chunk)
        if found.hexdigest() != sha256:
            detail = f"the {upload.size} bytes received have the SHA-256 {found.hexdigest()}"
            raise ProblemError(problem("hash-mismatch", detail))
        expires = datetime.now(UTC) + timedelta(seconds=context.settings.upload_ttl)
        if not await run_in_threadpool(_keep, upload, sha256, sender, context):
            response.status_code = status.HTTP_200_OK
    finally:
        await upload.close()
    return Blob(sha256=sha256, size=upload.size or 0, expires=expires)


@router.head(
    "/{sha256}",
    response_class=Response,
    responses={200: {"description": "the file is there; its size is the Content-Length"}},
    summary="Ask for a file",
)
def head_blob(sha256: Digest, context: ContextDependency, sender: SenderDependency) -> Response:
    """Whether a file is there, and need not be sent.

    One that was sent is kept for as long as if it had been sent again, for a key that may name it.
    """
    if sender.key is None or sender.key.allows("submit"):
        context.register.prolong_upload(sha256, sender.project, context.settings.upload_ttl)
    unknown = ProblemError(problem("not-found", "there is no file of this hash"))
    if not context.register.is_had(sha256, sender.view):
        raise unknown
    try:
        size = context.blobs.size(sha256)
    except (FileNotFoundError, DamagedFileError):
        raise unknown from None
    headers = {"Content-Length": str(size), "ETag": f'"{sha256}"'}
    return Response(headers=headers, media_type="application/octet-stream")


def _keep(upload: UploadFile, sha256: str, sender: Sender, context: Context) -> bool:
    """Store a file, and return whether it is new to its sender."""
    is_new = not context.register.is_had(sha256, sender.view)
    context.register.lease_upload(sha256, sender.project, context.settings.upload_ttl)
    return context.blobs.put_file(upload.file, sha256, anew=is_new)
