"""Clients that others' tools make of the API's description: they submit, wait and download.

The tools have an environment of their own: `make generators`.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from meshcone.files import MeshFile
from service.client import Client
from service.stack import Stack

OPENAPI = Path(__file__).parents[2] / "openapi"
EXAMPLE = Path(__file__).parents[2] / "examples" / "follow_jobs.ts"
PROGRAMS = Path(__file__).parent / "generated"
GENERATORS = Path(sys.prefix) / "generators"


def run(*command: str | Path, cwd: Path, **environment: str) -> str:
    done = subprocess.run(
        command,
        cwd=cwd,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=240,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


@pytest.fixture
def generators() -> Path:
    if not (GENERATORS / ".installed").is_file():
        pytest.skip("the generators of clients are not installed: make generators")
    return GENERATORS


@pytest.fixture
def pair(tmp_path: Path, rough_ball: MeshFile, ball: MeshFile) -> list[str]:
    """Names of the two files, in the directory of the test."""
    for file in (rough_ball, ball):
        (tmp_path / file.name).write_bytes(file.data)
    return [rough_ball.name, ball.name]


def assert_done(said: str, directory: Path, client: Client, source: MeshFile) -> None:
    """What a program has said and written is what the service has."""
    told = json.loads(said.splitlines()[-1])
    assert (told["state"], told["outcome"]) == ("succeeded", "improved")
    assert told["id"] in told["listed"]
    assert (directory / "refined.obj").read_bytes() == client.mesh(told["id"])
    assert (directory / "certificate.npz").read_bytes() == client.certificate(told["id"])
    assert (directory / "source.obj").read_bytes() == source.data


def test_a_client_by_openapi_python_client(
    generators: Path,
    tmp_path: Path,
    stack: Stack,
    client: Client,
    pair: list[str],
    rough_ball: MeshFile,
) -> None:
    said = run(
        generators / "bin" / "openapi-python-client",
        *("generate", "--meta", "none", "--path", OPENAPI / "openapi.json"),
        *("--config", OPENAPI / "python-client.yaml", "--output-path", "meshcone_client"),
        cwd=tmp_path,
        PATH=f"{generators / 'bin'}{os.pathsep}{os.environ['PATH']}",
    )
    assert "WARNING" not in said.upper()

    told = run(
        generators / "bin" / "python",
        *(PROGRAMS / "refine_with.py", stack.url, *pair, "."),
        cwd=tmp_path,
        PYTHONPATH=str(tmp_path),
    )

    assert_done(told, tmp_path, client, rough_ball)


def compiled(generators: Path, directory: Path, program: str) -> None:
    """Compile a program of a directory, as strictly as TypeScript does."""
    tsc = generators / "node_modules" / "typescript" / "bin" / "tsc"
    strict = ("--strict", "--skipLibCheck", "--target", "es2022", "--module", "nodenext")
    run("node", tsc, *strict, "--types", "node", program, cwd=directory)


def test_a_client_by_openapi_typescript(
    generators: Path,
    tmp_path: Path,
    stack: Stack,
    client: Client,
    pair: list[str],
    rough_ball: MeshFile,
) -> None:
    (tmp_path / "node_modules").symlink_to(generators / "node_modules")
    for program in (OPENAPI / "typescript-client.mjs", PROGRAMS / "refine_with.ts"):
        shutil.copy(program, tmp_path)
    run("node", "typescript-client.mjs", OPENAPI / "openapi.json", "meshcone.d.ts", cwd=tmp_path)
    compiled(generators, tmp_path, "refine_with.ts")

    told = run("node", "refine_with.js", stack.url, *pair, ".", cwd=tmp_path, NO_PROXY="127.0.0.1")

    assert_done(told, tmp_path, client, rough_ball)


def test_the_example_in_typescript_lists_the_jobs(
    generators: Path, tmp_path: Path, stack: Stack, client: Client, ball: MeshFile
) -> None:
    gates = {"validity.watertight": {"equals": True}}
    sent = client.submit(ball, ball, {"mode": "measure", "gates": gates})
    client.wait(sent.id)
    (tmp_path / "node_modules").symlink_to(generators / "node_modules")
    (tmp_path / "package.json").write_text('{"type": "module"}')
    shutil.copy(EXAMPLE, tmp_path)
    compiled(generators, tmp_path, EXAMPLE.name)

    said = run("node", "follow_jobs.js", stack.url, cwd=tmp_path, NO_PROXY="127.0.0.1")

    assert f"✓ succeeded {ball.name}  {stack.url}/jobs/{sent.id}" in said.splitlines()
