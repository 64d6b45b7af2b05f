"""``meshcone api``: the HTTP front end alone."""

from __future__ import annotations

import socket
from typing import Annotated

import typer


def command(
    host: Annotated[str, typer.Option(help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port to listen on.")] = 8000,
    fd: Annotated[
        int | None, typer.Option(hidden=True, help="Listening socket of the parent process.")
    ] = None,
) -> None:
    """Run the HTTP front end alone.

    Broker and data directory come from MESHCONE_* variables.
    """
    from service.api.listening.address import listen
    from service.api.server import serve
    from service.dashboard.routes import router

    serve(listen(host, port) if fd is None else socket.socket(fileno=fd), router)
