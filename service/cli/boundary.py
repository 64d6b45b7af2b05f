"""Where the command line ends: errors become one line and an exit code."""

from __future__ import annotations

import codecs
import io
import os
import sys
import traceback
from contextlib import suppress
from typing import Any

import typer
from typer.main import get_command

from meshcone.errors import InternalError, MeshConeError
from meshcone.text import printable
from meshcone.threads import use_one_thread
from service.cli.streams import lasting_streams

NOT_REACHED, BAD_INPUT, INTERNAL = 1, 2, 3  # exit codes; 1 also of gates that are not passed


class CommandLine(typer.Typer):
    """A Typer application whose errors are one line on stderr, never a traceback.

    Exit codes: what a command returns or 0; 2 for files, options or arguments that cannot be
    used, and for output that cannot be written; 3 for faults of ours. ``MESHCONE_DEBUG=1`` adds
    the traceback.
    """

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        """Run the command that the arguments name, and exit."""
        sys.exit(self._run(*args, **kwargs))

    def _run(self, *args: Any, **kwargs: Any) -> int:
        use_one_thread()
        with lasting_streams() as said:
            _print_anything()
            code = self._code(*args, **kwargs)
        if said.lost is None:
            return code
        reason = (said.lost.strerror or str(said.lost)).lower()
        return _fail(f"standard output cannot be written: {reason}", max(code, BAD_INPUT))

    def _code(self, *args: Any, **kwargs: Any) -> int:
        try:
            code = get_command(self)(*args, prog_name="meshcone", standalone_mode=False, **kwargs)
        except typer.TyperException as error:
            # Asked for nothing, it answers with its help, whose lines stay as they are.
            if type(error).__name__ == "NoArgsIsHelpError":
                typer.echo(error.format_message(), err=True)
                return BAD_INPUT
            return _fail(error.format_message(), BAD_INPUT)
        except MeshConeError as error:
            return _fail(str(error), INTERNAL if isinstance(error, InternalError) else BAD_INPUT)
        except typer.Abort:
            return _fail("aborted", BAD_INPUT)
        except Exception as error:  # noqa: BLE001 - the last boundary: nobody is left to handle it
            return _fail(f"unexpected {type(error).__name__}: {error}", INTERNAL)
        return code if isinstance(code, int) else 0


def _print_anything() -> None:
    """Have a terminal of few characters show the others as escapes, as stderr does.

    A command that has written its files must not fail for an arrow in what it says of them.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper) and _refuses_some(stream):
            stream.reconfigure(errors="backslashreplace")


def _refuses_some(stream: io.TextIOWrapper) -> bool:
    # Names of files that are no UTF-8 pass through a stream that escapes their bytes again.
    is_unicode = codecs.lookup(stream.encoding).name == "utf-8"
    return stream.errors == "strict" or (stream.errors == "surrogateescape" and not is_unicode)


def _fail(message: str, code: int) -> int:
    if os.environ.get("MESHCONE_DEBUG") == "1":
        traceback.print_exc()
    with suppress(OSError):  # nobody can be told
        print("meshcone:", printable(" ".join(message.split())), file=sys.stderr)
    return code
