"""The limit on open files, and how many connections fit below it."""

from __future__ import annotations

import resource
import sys
from typing import TYPE_CHECKING

import structlog

from meshcone.errors import InputError

if TYPE_CHECKING:
    from service.settings import ServiceSettings

logger = structlog.get_logger(__name__)

OWN_FILES = 64
"""Files of the process itself: libraries, logs, the connections of its threads to the broker."""
FILES_PER_CONNECTION = 3
"""Its socket, a connection to the broker, and on average one upload that is spooled to disk."""
_FEWEST = 8  # connections; below this a single browser would keep everybody else out
_STREAM_SHARE = 0.75  # of the connections, which streams may take
_MAC_LIMIT = 10_240  # macOS takes no more where it says "unlimited"


def raise_file_limit() -> int:
    """Let this process open as many files as the system allows it, and return how many."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if hard == resource.RLIM_INFINITY:
        hard = _MAC_LIMIT if sys.platform == "darwin" else sys.maxsize
        if soft == resource.RLIM_INFINITY:
            return hard
    if soft < hard:
        try:
            resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
        except (OSError, ValueError):
            return soft
    return hard


def fitted(settings: ServiceSettings, files: int) -> ServiceSettings:
    """Settings whose connections and streams fit below a limit on open files.

    Args:
        settings: as the operator wants them.
        files: how many may be open.

    Raises:
        InputError: there is not room for a few connections.
    """
    room = (files - OWN_FILES) // FILES_PER_CONNECTION
    if room < _FEWEST:
        raise InputError(
            f"this process may open {files} files, which leaves room for {max(room, 0)} "
            f"connections; raise the limit (ulimit -n, LimitNOFILE=) to "
            f"{OWN_FILES + FILES_PER_CONNECTION * settings.max_connections}"
        )
    connections = min(settings.max_connections, room)
    streams = min(settings.event_streams, int(_STREAM_SHARE * connections))
    if connections < settings.max_connections:
        logger.warning(
            "fewer connections than MESHCONE_MAX_CONNECTIONS: too few files may be open",
            connections=connections,
            wanted=settings.max_connections,
            files=files,
            files_needed=OWN_FILES + FILES_PER_CONNECTION * settings.max_connections,
        )
    if streams < settings.event_streams:
        logger.warning(
            "fewer streams than MESHCONE_EVENT_STREAMS: they leave others a quarter of the "
            "connections",
            streams=streams,
            wanted=settings.event_streams,
        )
    return settings.model_copy(update={"max_connections": connections, "event_streams": streams})
