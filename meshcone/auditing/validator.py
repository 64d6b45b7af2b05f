"""Khronos' glTF validator, where it is on this machine, in a process of its own.

It is either the program ``gltf_validator`` or the npm package of that name, which Node runs.
Both get bounds on time, memory and output, no shell, and no network. Where there is neither, or
no answer comes, nothing was tested, which no gate takes for a pass.
"""

from __future__ import annotations

import json
import shutil
import struct
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from pydantic import Field, ValidationError
from pydantic_settings import BaseSettings, SettingsConfigDict

from meshcone.auditing.records.validator import MESSAGES_KEPT, Validator, ValidatorMessage
from meshcone.errors import InputError
from meshcone.files import MeshFile
from meshcone.places import is_file
from meshcone.relative_names import inside
from meshcone.settings import load_settings

_PROGRAM = "gltf_validator"
_PACKAGE = Path("node_modules") / "gltf-validator"
_DRIVER = Path(__file__).with_name("validate.js")
_SECONDS = 60
_MEMORY = 2 << 30  # bytes of private memory
_OUTPUT = 16 << 20  # bytes
_SEVERITIES = ("error", "warning", "info", "hint")  # by the validator's numbers
_LONGEST = 500  # characters of a message


class ValidatorSettings(BaseSettings):
    """Where Khronos' validator is."""

    model_config = SettingsConfigDict(
        env_prefix="MESHCONE_", env_ignore_empty=True, frozen=True, extra="ignore"
    )

    gltf_validator: Path | None = Field(
        None,
        description="the program, or a directory with `node_modules/gltf-validator`; by default "
        "`gltf_validator` on the PATH, or the npm package beside Python, where `make validator` "
        "puts it",
    )


def validate(file: MeshFile) -> Validator:
    """Ask the validator about a file, if it is a glTF and there is a validator.

    Returns:
        What it found, or why nothing was tested.
    """
    if not _is_gltf(file.data):
        return Validator(not_tested="Khronos' validator reads glTF alone")
    try:
        command = _found()
        return _record(command.run(file))
    except _NoAnswerError as reason:
        return Validator(not_tested=str(reason))
    except OSError as error:  # no process, no disk space, or a sandbox that refuses both
        return Validator(not_tested=f"the validator cannot be run: {error.strerror or error}")


class _NoAnswerError(Exception):
    """The validator gave no answer; the message says why."""


def _is_gltf(data: bytes) -> bool:
    start = data[:1024].removeprefix(b"\xef\xbb\xbf").lstrip()
    return data.startswith(b"glTF") or start.startswith(b"{")


@dataclass(frozen=True)
class _Program:
    """The program: it reads files."""

    path: str

    def run(self, file: MeshFile) -> bytes:
        with tempfile.TemporaryDirectory() as directory:
            place = Path(directory)
            for name, data in {**file.resources, file.name: file.data}.items():
                own = inside(name)
                if own is not None:
                    (place / own).parent.mkdir(parents=True, exist_ok=True)
                    (place / own).write_bytes(data)
            name = inside(file.name) or ""
            if not (place / name).is_file():
                raise _NoAnswerError("the file's name cannot be written to disk")
            return _output([self.path, "-o", "-a", "--", str(place / name)], b"")


@dataclass(frozen=True)
class _Package:
    """The npm package: a script of ours hands it the bytes."""

    node: str
    path: Path

    def run(self, file: MeshFile) -> bytes:
        files = {file.name: file.data, **file.resources}
        listed = [{"name": name, "length": len(data)} for name, data in files.items()]
        header = json.dumps({"files": listed}).encode()
        data = b"".join([struct.pack("<I", len(header)), header, *files.values()])
        limit = f"--max-old-space-size={_MEMORY >> 21}"  # MiB, half of what it may have at all
        command = [self.node, limit, str(_DRIVER), str(self.path), str(MESSAGES_KEPT)]
        return _output(command, data)


def _found() -> _Program | _Package:
    given = load_settings(ValidatorSettings).gltf_validator
    if given is not None and is_file(given):
        return _Program(str(given))
    program = shutil.which(_PROGRAM) if given is None else None
    if program is not None:
        return _Program(program)
    package = (Path(sys.prefix) if given is None else given) / _PACKAGE
    if not is_file(package / "package.json"):
        if given is not None:
            raise InputError(
                f"environment variable MESHCONE_GLTF_VALIDATOR: {given} is no program and has no "
                f"{_PACKAGE.as_posix()}"
            )
        raise _NoAnswerError("Khronos' validator is not on this machine: see `make validator`")
    node = shutil.which("node")
    if node is None:
        raise _NoAnswerError("the npm package gltf-validator is here, but Node is not")
    return _Package(node, package)


def _output(command: list[str], data: bytes) -> bytes:
    """What a command writes; its exit code says nothing, as errors in a file give it 1 too."""
    with tempfile.TemporaryFile() as out, _started(command, out) as process:
        try:
            process.communicate(data, timeout=_SECONDS)
        except subprocess.TimeoutExpired:
            raise _NoAnswerError(f"the validator took longer than {_SECONDS} s") from None
        out.seek(0)
        answer = out.read(_OUTPUT)
    if process.returncode < 0 or not answer:
        raise _NoAnswerError("the validator ended without an answer; it may have lacked memory")
    return answer


@contextmanager
def _started(command: list[str], out: IO[bytes]) -> Iterator[subprocess.Popen[bytes]]:
    process = subprocess.Popen(  # noqa: S603 - a program of this machine, a list of arguments
        command,
        stdin=subprocess.PIPE,
        stdout=out,
        stderr=subprocess.DEVNULL,
        env={"LC_ALL": "C.UTF-8"},
    )
    try:
        _bound(process.pid)
        yield process
    finally:
        process.kill()
        with suppress(BrokenPipeError), process:
            pass


def _bound(pid: int) -> None:
    """Limit a process that has only just begun; where that is not possible, time alone does."""
    try:
        from resource import RLIMIT_CORE, RLIMIT_CPU, RLIMIT_DATA, RLIMIT_FSIZE, prlimit
    except ImportError:
        return
    limits = {
        RLIMIT_CPU: 2 * _SECONDS,  # several threads of one process
        RLIMIT_DATA: _MEMORY,
        RLIMIT_FSIZE: _OUTPUT,
        RLIMIT_CORE: 0,
    }
    with suppress(ProcessLookupError, PermissionError):
        for which, most in limits.items():
            soft, hard = prlimit(pid, which)
            bounded = [most if each < 0 else min(each, most) for each in (soft, hard)]
            prlimit(pid, which, (bounded[0], bounded[1]))


def _record(answer: bytes) -> Validator:
    try:
        report = json.loads(answer)
        return _read(report["validatorVersion"], report["issues"])
    except (ValueError, KeyError, TypeError, IndexError, RecursionError, ValidationError):
        raise _NoAnswerError("the validator's answer is no report") from None


def _read(version: str, issues: Mapping[str, Any]) -> Validator:
    messages = sorted(issues["messages"], key=lambda each: int(each["severity"]))
    return Validator(
        version=version,
        errors=issues["numErrors"],
        warnings=issues["numWarnings"],
        infos=issues["numInfos"],
        hints=issues["numHints"],
        messages=tuple(
            ValidatorMessage.model_validate(
                {
                    "severity": _SEVERITIES[each["severity"]],
                    "code": each["code"],
                    "pointer": each.get("pointer", ""),
                    "words": each["message"][:_LONGEST],
                }
            )
            for each in messages[:MESSAGES_KEPT]
        ),
    )
