"""The API process."""

from __future__ import annotations

import logging
import socket
from contextlib import closing

import uvicorn

from meshcone.errors import InputError
from service.app import create_app


def listen(host: str, port: int) -> socket.socket:
    """A listening socket; port 0 lets the system choose.

    Raises:
        InputError: the address cannot be had.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listener = socket.socket(family, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((host, port))
    except (OSError, OverflowError) as error:
        listener.close()
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"cannot listen on {host} port {port}: {reason.lower()}") from None
    return listener


def serve(listener: socket.socket) -> None:
    """Answer HTTP requests until SIGTERM or SIGINT.

    Raises:
        InputError: the environment's settings cannot be used.
    """
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(name)s %(levelname)s %(message)s")
    logging.getLogger("uvicorn.access").addFilter(_is_worth_a_line)
    app = create_app()
    app.state.settings.required_redis_url()
    config = uvicorn.Config(
        app,
        log_config=None,
        server_header=False,
        timeout_graceful_shutdown=10,
    )
    with closing(listener):
        uvicorn.Server(config).run(sockets=[listener])


def _is_worth_a_line(record: logging.LogRecord) -> bool:
    """Probes that found all well come every second or so, and say nothing."""
    message = record.getMessage()
    return not (message.endswith(" 200") and ("/livez " in message or "/readyz " in message))
