"""Checks of sent meshes: what they find, and what they may use."""

from __future__ import annotations

import os
import resource
import signal
from pathlib import Path

import pytest
from anyio.from_thread import BlockingPortal

from meshcone.assets import Limits
from meshcone.errors import InputError, LimitError
from service.api.checking import process
from service.api.checking.checks import MeshChecks, MeshFiles
from service.settings import ServiceSettings
from tests.integration.mesh_checks.checking import (
    MEBIBYTE,
    Keep,
    Pipe,
    begun,
    checked,
    open_files,
)


def test_sound_meshes_pass(portal: BlockingPortal, checks: MeshChecks, mesh: MeshFiles) -> None:
    assert checked(portal, checks, mesh, mesh)


def test_a_fault_is_told_with_file_and_place(
    portal: BlockingPortal, checks: MeshChecks, mesh: MeshFiles, kept: Keep
) -> None:
    broken = kept(b"v 0 0 0\nv 1 x 0\n", "broken.obj")

    with pytest.raises(InputError, match="found 'x'") as caught:
        checked(portal, checks, mesh, broken)

    assert (caught.value.file, caught.value.place) == ("broken.obj", "line 2")


def test_a_source_that_cannot_be_written_back_is_refused(
    portal: BlockingPortal, checks: MeshChecks, mesh: MeshFiles, kept: Keep
) -> None:
    header = (
        b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
        b"property float z\nproperty list uchar int of\nelement face 1\n"
        b"property list uchar int vertex_indices\nend_header\n"
    )
    only_readable = kept(header + b"0 0 0 0\n1 0 0 0\n0 1 0 0\n3 0 1 2\n", "mesh.ply")

    assert checked(portal, checks, mesh, only_readable)
    with pytest.raises(InputError) as caught:
        checked(portal, checks, only_readable, mesh)

    assert caught.value.file == "mesh.ply"


def test_a_file_is_handed_over_whole_whatever_its_size(
    portal: BlockingPortal, checks: MeshChecks, mesh: MeshFiles, kept: Keep
) -> None:
    large = kept(b"# " + b"x" * (8 * MEBIBYTE) + b"\nv 0 0 0\n", "large.obj")

    with pytest.raises(InputError, match="it has no faces"):
        checked(portal, checks, mesh, large)


def test_more_files_come_along_than_one_message_can_carry(
    portal: BlockingPortal, checks: MeshChecks, mesh: MeshFiles, kept: Keep
) -> None:
    resources = {f"{number}.bin": mesh.file for number in range(300)}
    gltf = MeshFiles("a.gltf", kept(b'{"asset": {"version": "2.0"}}').file, resources)

    with pytest.raises(InputError) as caught:
        checked(portal, checks, mesh, gltf)

    assert caught.value.file == "a.gltf"


def test_memory_is_bounded_and_what_takes_more_is_refused(
    portal: BlockingPortal, kept: Keep
) -> None:
    settings = ServiceSettings(precheck_memory_bytes=64 * MEBIBYTE)
    hungry = kept(b"v 0 0 0\n" * Limits().vertices + b"f 1 2 3\n" * Limits().faces)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

    with (
        MeshChecks(settings) as checks,
        pytest.raises(LimitError, match=r"67,108,864 bytes .*MESHCONE_PRECHECK_MEMORY_BYTES"),
    ):
        checked(portal, checks, hungry, hungry)

    grown = 1024 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
    assert grown < 16 * MEBIBYTE  # of this process, which stands for the API


def test_processor_time_is_bounded_and_what_takes_more_is_refused(
    portal: BlockingPortal, checks: MeshChecks, mesh: MeshFiles, pipe: Pipe
) -> None:
    running = begun(portal, checks, MeshFiles("slow.obj", pipe), mesh)

    os.kill(pipe.reader(checks), signal.SIGXCPU)  # what the kernel sends when the time is over

    with pytest.raises(
        LimitError, match=r"30 seconds of processor time .*MESHCONE_PRECHECK_SECONDS"
    ):
        running.result(240)


def test_the_kernel_knows_the_limits_of_a_check(
    portal: BlockingPortal, checks: MeshChecks, mesh: MeshFiles, pipe: Pipe
) -> None:
    running = begun(portal, checks, MeshFiles("p.obj", pipe), mesh)
    child = pipe.reader(checks)

    processor = resource.prlimit(child, resource.RLIMIT_CPU)
    memory = resource.prlimit(child, resource.RLIMIT_DATA)
    written = resource.prlimit(child, resource.RLIMIT_FSIZE)
    pipe.give(b"x")

    assert processor[0] == ServiceSettings().precheck_seconds
    assert 0 < memory[0] - ServiceSettings().precheck_memory_bytes < 512 * MEBIBYTE
    assert written == (0, process.SCRATCH_BYTES)  # the second is for programs it starts
    with pytest.raises(InputError):
        running.result(240)


def test_a_check_has_its_files_and_nothing_else(
    portal: BlockingPortal, mesh: MeshFiles, pipe: Pipe, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MESHCONE_REDIS_URL", "redis://:password@broker:6379")
    monkeypatch.setenv("AWS_SECRET_ACCESS_KEY", "secret")
    monkeypatch.setenv("MESHCONE_LIMIT_VERTICES", "1234")
    with MeshChecks(ServiceSettings()) as checks:
        running = begun(portal, checks, MeshFiles("p.obj", pipe), mesh)
        child = pipe.reader(checks)

        environment = Path(f"/proc/{child}/environ").read_bytes()
        files = [name for name in open_files(child) if name not in open_files(checks.pid)]
        pipe.give(b"x")
        with pytest.raises(InputError):
            running.result(240)

    assert b"MESHCONE_LIMIT_VERTICES=1234" in environment
    assert b"password" not in environment
    assert b"secret" not in environment
    assert len([name for name in files if name.startswith("socket:")]) == 1  # to answer on
    assert len(files) <= 4  # beside it the two meshes and the request
