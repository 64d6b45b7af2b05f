"""The API process."""

from __future__ import annotations

import os
import socket
from contextlib import closing

import structlog
import uvicorn
from fastapi import APIRouter

from meshcone.errors import InputError
from meshcone.settings import load_settings
from service.access.auth import is_loopback
from service.api.app import create_app
from service.api.routes.events import Events
from service.settings import ServiceSettings
from worker.logs import configure_logging

_KEEP_ALIVE = 75  # seconds

logger = structlog.get_logger(__name__)


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


def asks_for_keys(settings: ServiceSettings, host: str) -> bool:
    """Whether a server that listens on an address is to ask for API keys."""
    return settings.require_keys == "always" or not is_loopback(host)


def serve(listener: socket.socket, pages: APIRouter | None = None) -> None:
    """Answer HTTP requests until SIGTERM or SIGINT.

    Args:
        listener: where they come in.
        pages: routes to add to the API's.

    Raises:
        InputError: the environment's settings cannot be used.
    """
    configure_logging()
    os.environ.setdefault("OTEL_SERVICE_NAME", "meshcone-api")
    settings = load_settings(ServiceSettings)
    settings.required_redis_url()
    keys_required = asks_for_keys(settings, listener.getsockname()[0])
    if keys_required:
        logger.info("every request needs an API key; `meshcone keys create` makes one")
    app = create_app(settings, keys_required=keys_required, pages=pages)
    config = uvicorn.Config(
        app,
        log_config=None,
        access_log=False,  # service.api.middleware.request_log writes a better one
        server_header=False,
        # Longer than clients and proxies keep a connection that is not used: whoever closes
        # first must not be the one that may just be sent a request.
        timeout_keep_alive=_KEEP_ALIVE,
        timeout_graceful_shutdown=10,
    )
    with closing(listener):
        _Server(config).run(sockets=[listener])


class _Server(uvicorn.Server):
    """One that ends the streams it sends before it waits for its answers to end."""

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Stop listening, and wait for what is being answered."""
        self._events().streams.close()
        await super().shutdown(sockets)

    def _events(self) -> Events:
        events: Events = self.config.app.state.events  # type: ignore[union-attr]
        return events
