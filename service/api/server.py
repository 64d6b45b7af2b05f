"""The API process."""

from __future__ import annotations

import asyncio
import os
import socket
from contextlib import closing, suppress

import structlog
import uvicorn
from fastapi import APIRouter

from meshcone.settings import load_settings
from service.access.auth import is_loopback
from service.api.app import create_app
from service.api.listening.connections import Connections
from service.api.listening.file_limit import fitted, raise_file_limit
from service.api.listening.protocol import BoundedProtocol
from service.api.routes.events import Events
from service.settings import ServiceSettings
from worker.logs import configure_logging

_KEEP_ALIVE = 75  # seconds

logger = structlog.get_logger(__name__)


def asks_for_keys(settings: ServiceSettings, host: str) -> bool:
    """Whether a server that listens on an address is to ask for API keys."""
    return settings.require_keys == "always" or not is_loopback(host)


def serve(listener: socket.socket, pages: APIRouter | None = None) -> None:
    """Answer HTTP requests until SIGTERM or SIGINT.

    Args:
        listener: where they come in.
        pages: routes to add to the API's.

    Raises:
        InputError: the environment's settings cannot be used, or too few files may be open.
    """
    configure_logging()
    os.environ.setdefault("OTEL_SERVICE_NAME", "meshcone-api")
    settings = fitted(load_settings(ServiceSettings), raise_file_limit())
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
        ws="none",
        # Longer than clients and proxies keep a connection that is not used: whoever closes
        # first must not be the one that may just be sent a request.
        timeout_keep_alive=_KEEP_ALIVE,
        timeout_graceful_shutdown=10,
    )
    with closing(listener):
        _Server(config, settings).run(sockets=[listener])


class _Server(uvicorn.Server):
    """One that bounds its connections, and ends the streams it sends before it stops."""

    def __init__(self, config: uvicorn.Config, settings: ServiceSettings) -> None:
        super().__init__(config)
        self._settings = settings
        self._connections = Connections(settings)
        self._watching: asyncio.Task[None] | None = None

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Start the application, then take in connections."""
        await super().startup(sockets=[])
        self._watching = asyncio.create_task(self._connections.watch())
        for listener in sockets or []:
            accepting = asyncio.create_task(self._connections.accept(listener, self._connection))
            self.servers.append(_Accepting(accepting))  # type: ignore[arg-type]

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Stop listening, and wait for what is being answered."""
        self._events().streams.close()
        await super().shutdown(sockets)
        if self._watching is not None:
            self._watching.cancel()

    def _connection(self) -> BoundedProtocol:
        return BoundedProtocol(
            self._settings,
            self._connections,
            config=self.config,
            server_state=self.server_state,
            app_state=self.lifespan.state,
        )

    def _events(self) -> Events:
        events: Events = self.config.app.state.events  # type: ignore[union-attr]
        return events


class _Accepting:
    """A task that accepts connections, as the kind of server that uvicorn closes."""

    def __init__(self, task: asyncio.Task[None]) -> None:
        self._task = task

    def close(self) -> None:
        self._task.cancel()

    async def wait_closed(self) -> None:
        with suppress(asyncio.CancelledError):
            await self._task
