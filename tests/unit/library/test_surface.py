"""What ``import meshcone`` gives, and what it costs."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from importlib.metadata import version
from pathlib import Path

import pytest

import meshcone

ROOT = Path(__file__).parents[3]
HEAVY = ("numpy", "scipy", "scs", "cvxpy", "trimesh", "igl", "pydantic", "httpx2", "service")
NAMES = {
    "Audited",
    "Client",
    "LoadedMesh",
    "Measured",
    "Refined",
    "ServiceError",
    "Verdict",
    "Verification",
    "__version__",
    "audit",
    "errors",
    "gate",
    "load",
    "measure",
    "refine",
    "thresholds",
    "verify",
}


def loaded_after(program: str) -> str:
    probe = f"{program}; import sys; print([name for name in {HEAVY} if name in sys.modules])"
    answer = subprocess.run(
        [sys.executable, "-c", probe], capture_output=True, text=True, check=True, timeout=60
    )
    return answer.stdout.strip()


def test_the_import_loads_nothing_heavy() -> None:
    assert loaded_after("import meshcone") == "[]"


@pytest.mark.parametrize("name", ["errors", "__version__"])
def test_errors_and_version_load_nothing_heavy(name: str) -> None:
    assert loaded_after(f"import meshcone; meshcone.{name}") == "[]"


def test_every_public_name_is_there_and_is_listed() -> None:
    assert set(meshcone.__all__) == NAMES
    assert {name for name in dir(meshcone) if not name.startswith("__")} == NAMES - {"__version__"}
    assert all(getattr(meshcone, name) is not None for name in NAMES)


def test_loading_the_engine_puts_no_module_in_the_place_of_a_function() -> None:
    program = (
        "import meshcone.library.functions, meshcone.verbs.refine, meshcone.verbs.measure, "
        "meshcone.verbs.verify, meshcone.verbs.audit, meshcone; "
        "print({callable(getattr(meshcone, n)) for n in "
        "('refine', 'measure', 'audit', 'verify', 'gate')})"
    )

    answer = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=60
    )

    assert answer.stdout.strip() == "{True}"


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="module 'meshcone' has no attribute 'refyne'"):
        meshcone.refyne  # noqa: B018


def test_the_version_is_that_of_the_package() -> None:
    assert meshcone.__version__ == version("meshcone")


@pytest.mark.parametrize("package", ["meshcone", "worker", "service"])
def test_the_packages_say_that_they_are_typed(package: str) -> None:
    data = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]

    assert "py.typed" in data["package-data"][package]
    assert (ROOT / package / "py.typed").is_file()


def test_a_type_checker_sees_the_names(tmp_path: Path) -> None:
    program = tmp_path / "program.py"
    program.write_text(
        "import meshcone\n"
        "reveal_type(meshcone.refine('a.obj', 'b.obj', effort='fast'))\n"
        "reveal_type(meshcone.Client('http://127.0.0.1').job('x'))\n"
        "meshcone.refine('a.obj', 'b.obj', effort='quick')\n"
    )

    answer = subprocess.run(
        [sys.executable, "-m", "mypy", "--config-file", str(ROOT / "pyproject.toml"), program],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=240,
    )

    said = [line for line in answer.stdout.splitlines() if "program.py" in line]
    assert 'Revealed type is "meshcone.library.results.Refined"' in said[0]
    assert 'Revealed type is "service.api.schemas.Job"' in said[1]
    assert 'Argument "effort" to "refine" has incompatible type' in said[2]
