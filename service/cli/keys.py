"""``meshcone keys``: API keys, made, listed and revoked."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from meshcone.errors import InputError
from meshcone.suggestions import did_you_mean
from service.cli.telling import tell

if TYPE_CHECKING:
    from service.access.keys import KeyStore, Scope

commands = typer.Typer(help="Make, list and revoke API keys.", no_args_is_help=True)

DataDirectory = Annotated[
    Path | None,
    typer.Option(help="Where `meshcone serve` keeps its data. [default: ./meshcone-data]"),
]
Limit = Annotated[int | None, typer.Option(min=0, help="0 for any number.", show_default=False)]


@commands.command("create")
def create(
    name: Annotated[
        str, typer.Argument(metavar="NAME", help="Name of the key: whose it is, or what it is for.")
    ],
    scopes: Annotated[
        str, typer.Option(help="What it may do: submit, read, delete, admin; separated by commas.")
    ] = "submit,read",
    project: Annotated[
        str, typer.Option(help="Whose jobs and files it may see, unless it is an admin's.")
    ] = "default",
    requests_per_minute: Limit = None,
    active_jobs: Limit = None,
    daily_bytes: Limit = None,
    data_dir: DataDirectory = None,
) -> None:
    """Make a key and print it, once.

    The secret of its webhooks is printed too; neither is shown again.

    What is not limited here is limited as the installation says.
    """
    from service.access.keys import Quota

    wanted = _scopes(scopes)
    quota = Quota(
        requests_per_minute=requests_per_minute, active_jobs=active_jobs, daily_bytes=daily_bytes
    )
    with _store(data_dir) as store:
        made = store.create(name, wanted, quota, project)
    typer.echo(f"id              {made.key.id}")
    typer.echo(f"key             {made.token}")
    typer.echo(f"webhook secret  {made.webhook_secret}")


@commands.command("list")
def show(data_dir: DataDirectory = None) -> None:
    """List the keys there are."""
    with _store(data_dir) as store:
        keys = store.all()
    for key in keys:
        created = key.created.astimezone().isoformat(timespec="seconds")
        tell(f"{key.id}  {created}  {','.join(key.scopes):<18}  {key.project:<12}  {key.name}")


@commands.command("revoke")
def revoke(
    key_id: Annotated[str, typer.Argument(metavar="ID", help="Its id, as `keys list` shows it.")],
    data_dir: DataDirectory = None,
) -> None:
    """Take a key back.

    Requests with it are refused from now on, and its webhooks are not sent.
    """
    with _store(data_dir) as store:
        store.revoke(key_id)


def _scopes(text: str) -> list[Scope]:
    from service.access.keys import SCOPES

    known = {scope: scope for scope in SCOPES}
    names = [name.strip() for name in text.split(",")]
    for name in names:
        if name not in known:
            hint = did_you_mean(name, SCOPES) or f"; there are {', '.join(SCOPES)}"
            raise InputError(f"unknown scope '{name}'{hint}")
    return [known[name] for name in names if name in known]


@contextmanager
def _store(data_dir: Path | None) -> Iterator[KeyStore]:
    from redis.exceptions import RedisError

    from meshcone.settings import load_settings
    from service.access.keys import KeyStore
    from worker.broker.connections import connect_text
    from worker.broker.embedded import running_broker_url
    from worker.settings import WorkerSettings

    overrides = {} if data_dir is None else {"data_dir": data_dir}
    settings = load_settings(WorkerSettings, **overrides)
    url = settings.redis_url if data_dir is None else None
    try:
        with connect_text(url or running_broker_url(settings.data_dir)) as client:
            yield KeyStore(client)
    except RedisError as error:
        raise InputError(f"the broker cannot be reached: {error}") from None
