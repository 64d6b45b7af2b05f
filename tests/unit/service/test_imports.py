from __future__ import annotations

import subprocess
import sys

import pytest

HEAVY = ("cvxpy", "scs", "trimesh", "igl", "numba", "meshcone.verbs.refine", "worker.run.task")


@pytest.mark.parametrize(
    "module", ["service.api.app", "service.cli", "service.stack", "worker.jobs.queue"]
)
def test_the_front_end_starts_without_the_solver(module: str) -> None:
    program = f"import sys, {module}; print([name for name in {HEAVY} if name in sys.modules])"

    answer = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=60
    )

    assert answer.stdout.strip() == "[]"


def test_the_process_that_answers_requests_has_no_reader_of_meshes() -> None:
    modules = "service.api.server, service.dashboard.routes"
    readers = ("numpy", "meshcone.assets")
    program = f"import sys, {modules}; print([name for name in {readers} if name in sys.modules])"

    answer = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=60
    )

    assert answer.stdout.strip() == "[]"


@pytest.mark.parametrize("module", ["service.cli", "worker.main"])
def test_numpy_is_imported_only_after_its_threads_are_set(module: str) -> None:
    program = f"import sys, {module}; print('numpy' in sys.modules)"

    answer = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=60
    )

    assert answer.stdout.strip() == "False"
