"""The command line: one module a command, put together here."""

from importlib.metadata import version
from typing import Annotated

import typer

from service.cli import (
    api,
    audit,
    demo,
    gate,
    keys,
    measure,
    openapi,
    refine,
    serve,
    submit,
    thresholds,
    transfers,
    verify,
    webhooks,
    worker,
)
from service.cli.boundary import CommandLine

app = CommandLine(
    name="meshcone",
    add_completion=False,
    no_args_is_help=True,
    rich_markup_mode=None,
)


def _show_version(asked: bool) -> None:
    if asked:
        typer.echo(f"meshcone {version('meshcone')}")
        raise typer.Exit


@app.callback()
def _main(
    _version: Annotated[
        bool,
        typer.Option(
            "--version",
            callback=_show_version,
            is_eager=True,
            help="Print the version and exit.",
            show_default=False,
        ),
    ] = False,
) -> None:
    """Refine a mesh against a reference, with proof that the answer is optimal."""


app.command("demo")(demo.command)
app.command("refine")(refine.command)
app.command("measure")(measure.command)
app.command("audit")(audit.command)
app.command("gate")(gate.command)
app.command("thresholds")(thresholds.command)
app.command("verify")(verify.command)
app.command("submit")(submit.command)
app.command("serve")(serve.command)
app.command("api")(api.command)
app.command("worker")(worker.command)
app.command("webhooks")(webhooks.command)
app.command("transfers")(transfers.command)
app.add_typer(keys.commands, name="keys")
app.command("openapi")(openapi.command)

__all__ = ["app"]
