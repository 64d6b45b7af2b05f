"""The command line: one module a command, put together here."""

from service.cli import (
    api,
    demo,
    gate,
    keys,
    measure,
    openapi,
    refine,
    serve,
    submit,
    verify,
    webhooks,
    worker,
)
from service.cli.boundary import CommandLine

app = CommandLine(
    name="meshcone",
    help="Refine a mesh against a reference, with proof that the answer is optimal.",
    add_completion=False,
    no_args_is_help=True,
    rich_markup_mode=None,
)
app.command("demo")(demo.command)
app.command("refine")(refine.command)
app.command("measure")(measure.command)
app.command("gate")(gate.command)
app.command("verify")(verify.command)
app.command("submit")(submit.command)
app.command("serve")(serve.command)
app.command("api")(api.command)
app.command("worker")(worker.command)
app.command("webhooks")(webhooks.command)
app.add_typer(keys.commands, name="keys")
app.command("openapi")(openapi.command)

__all__ = ["app"]
