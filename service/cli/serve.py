"""``meshcone serve``: everything on this machine."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer

LOOK_INTERVAL = 0.2  # seconds between looks whether everything still runs


def command(
    host: Annotated[str, typer.Option(help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Port to listen on; 0 takes a free one.")
    ] = 8000,
    workers: Annotated[
        int, typer.Option(min=1, max=256, help="Worker processes; each solves one job at a time.")
    ] = 1,
    data_dir: Annotated[
        Path | None,
        typer.Option(help="Where jobs and files are kept. [default: ./meshcone-data]"),
    ] = None,
) -> None:
    """Run the service on this machine.

    That is the API, workers and, unless MESHCONE_REDIS_URL is set, a broker.
    """
    from meshcone.settings import load_settings
    from service.stack import Stack
    from worker.run.stopping import StopRequest
    from worker.settings import WorkerSettings

    overrides = {} if data_dir is None else {"data_dir": data_dir}
    settings = load_settings(WorkerSettings, **overrides)
    stop = StopRequest(settings.stop_grace)
    stop.listen()
    with Stack(
        settings, host=host, port=port, workers=workers, given_up=lambda: stop.made
    ) as stack:
        if not stop.made:
            typer.echo(f"MeshCone listens on {stack.url} (Ctrl-C ends it)")
        while not stop.made:
            stack.restart_ended()
            time.sleep(LOOK_INTERVAL)
