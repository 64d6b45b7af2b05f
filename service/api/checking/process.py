"""The program that reads strangers' meshes, so that the API's own process never does.

``python -m service.api.checking.process CONTROL MEMORY PROCESSOR_SECONDS SECONDS`` imports the
readers once and forks a child, which gives up what it does not need and waits. It takes one
connection from the socket CONTROL, and another child is forked, to wait for the next. It reads the
files it is handed by their descriptors, answers on its connection and ends. Whatever a file does
to its reader, it does to a process of its own.
"""

from __future__ import annotations

import gc
import json
import os
import signal
import socket
import sys
import traceback
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import FrameType
from typing import IO, TYPE_CHECKING, Any, NoReturn

from meshcone.lifeline import die_with_parent
from meshcone.scratch import work_in
from meshcone.threads import use_one_thread
from worker.run.sandbox import guard_network, limit_resources

SCRATCH_BYTES = 1 << 30  # of a file that a reader of design files writes and removes

if TYPE_CHECKING:
    from meshcone.options import Options

MORE, LAST = b"+", b"."  # said with file descriptors: whether others follow
DESCRIPTORS_AT_ONCE = 200  # the kernel takes 253 with one message (unix(7), SCM_RIGHTS)
_TAKEN, _NO_MORE = b"+", b"."  # said to the parent: whether another child is wanted
# Kinds of an answer that no error of a file has.
OUT_OF_MEMORY, OUT_OF_TIME, LATE = "memory", "time", "late"


class _TimeOver(BaseException):
    """No ``except Exception`` of a reader is to swallow it.

    It is raised where the child is, so that what the reader has started and written is ended and
    removed on the way out.
    """

    def __init__(self, kind: str) -> None:
        super().__init__(kind)
        self.kind = kind


def main(arguments: list[str]) -> None:
    """Have a child waiting for each connection, until the API closes the socket or ends."""
    use_one_thread()
    _warm_up()
    control_fd, *limits = map(int, arguments)
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # the kernel forgets children that have ended
    with socket.socket(fileno=control_fd) as control:
        while _serve_one(control, limits):
            pass


def _serve_one(control: socket.socket, limits: list[int]) -> bool:
    """Have a child take the next connection; false where there will be none."""
    parent = os.getpid()
    ours, its = os.pipe()
    with os.fdopen(ours, "rb", 0) as told, os.fdopen(its, "wb", 0) as telling:
        try:
            pid = os.fork()
        except OSError:
            return _turn_away(control)
        if pid == 0:
            told.close()
            _become_child(parent, control, telling, limits)
        telling.close()
        return told.read(1) != _NO_MORE  # one that was killed while it waited told nothing


def _turn_away(control: socket.socket) -> bool:
    """Take a connection and close it: the API sees that, and that there was no answer."""
    connection = _next_connection(control)
    if connection is not None:
        connection.close()
    return connection is not None


def _next_connection(control: socket.socket) -> socket.socket | None:
    descriptors = socket.recv_fds(control, 1, 1)[1]
    return socket.socket(fileno=descriptors[0]) if descriptors else None


def _warm_up() -> None:
    """Import, and build what is built at a first use, here once and not in every child."""
    gc.disable()  # nothing that is imported becomes garbage
    from meshcone.assets import read_asset
    from meshcone.options import Options

    asset = read_asset("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    asset.ensure_writable(asset.policy(Options()))
    # Counting references to what is there already would copy its pages into every child.
    gc.collect()
    gc.freeze()
    gc.enable()


def _become_child(
    parent: int, control: socket.socket, telling: IO[bytes], limits: list[int]
) -> NoReturn:
    memory, processor_seconds, seconds = limits
    try:
        die_with_parent(parent, signal.SIGKILL)
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        signal.signal(signal.SIGXCPU, _on_time_over)
        signal.signal(signal.SIGALRM, _on_time_over)
        limit_resources(
            seconds=processor_seconds,
            memory=memory,
            file_bytes=0,
            file_bytes_below=SCRATCH_BYTES,
        )
        guard_network(())
        connection = _next_connection(control)
        telling.write(_NO_MORE if connection is None else _TAKEN)
        telling.close()
        control.close()
        if connection is not None:
            signal.alarm(seconds)
            connection.sendall(json.dumps(_answer(_received(connection))).encode() + b"\n")
    finally:
        os._exit(0)  # no answer says the rest; the parent's loop is not this process's to go on


def _on_time_over(number: int, _frame: FrameType | None) -> None:
    raise _TimeOver(LATE if number == signal.SIGALRM else OUT_OF_TIME)


def _received(connection: socket.socket) -> list[int]:
    descriptors: list[int] = []
    said = MORE
    while said == MORE:
        said, found, _, _ = socket.recv_fds(connection, 1, DESCRIPTORS_AT_ONCE)
        descriptors += found
    return descriptors


def _answer(descriptors: list[int]) -> dict[str, Any]:
    from meshcone.errors import MeshConeError

    try:
        _check(iter(descriptors))
    except MeshConeError as error:
        return {
            "kind": error.kind,
            "message": error.message,
            "file": error.file,
            "place": error.place,
        }
    except MemoryError:
        return {"kind": OUT_OF_MEMORY}
    except _TimeOver as over:
        return {"kind": over.kind}
    except Exception:  # noqa: BLE001 - a fault of ours: the API logs it
        return {"kind": "internal", "message": traceback.format_exc()}
    return {}


def _check(descriptors: Iterator[int]) -> None:
    from meshcone.assets import read_asset
    from meshcone.assets.policy import ReadPolicy
    from meshcone.options import Options

    request = json.loads(_content(next(descriptors)))
    options = Options.model_validate(request["options"])
    work_in(None if request["scratch"] is None else Path(request["scratch"]))
    for side, mesh in request["meshes"].items():
        data = _content(next(descriptors))
        resources = {name: _content(next(descriptors)) for name in mesh["resources"]}
        reading = ReadPolicy.of_source if side == "source" else ReadPolicy.of_reference
        asset = read_asset(mesh["name"], data, resources, policy=reading(options))
        if side == "source" and options.mode == "refine":
            asset.ensure_writable(asset.policy(options))
            _check_list(options, resources, len(asset.weld))
        del asset, data, resources  # before the other is read: a limit holds for each


def _check_list(options: Options, resources: Mapping[str, bytes], count: int) -> None:
    if options.cones.pin.vertices_file is not None:
        from meshcone.vertex_list import listed_vertices

        listed_vertices(options, resources, count)


def _content(descriptor: int) -> bytes:
    with open(descriptor, "rb") as file:
        return file.read()


if __name__ == "__main__":
    main(sys.argv[1:])
