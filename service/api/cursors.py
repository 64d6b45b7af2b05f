"""Where a list goes on, as something no client can build or read."""

from __future__ import annotations

import base64
import binascii
import uuid

from worker.jobs.identifiers import is_job_id


def cursor_after(job_id: str) -> str:
    """The cursor of the jobs listed after a job."""
    return base64.urlsafe_b64encode(uuid.UUID(job_id).bytes).rstrip(b"=").decode()


def job_before(cursor: str) -> str | None:
    """The job a cursor was made of; None if it is no cursor of this service."""
    try:
        job_id = str(uuid.UUID(bytes=base64.urlsafe_b64decode(f"{cursor}==")))
    except (binascii.Error, ValueError):
        return None
    return job_id if is_job_id(job_id) and cursor_after(job_id) == cursor else None
