"""What is slow to import is imported only where it is needed."""

from __future__ import annotations

import subprocess
import sys

_REFINE = """
import sys
from meshcone.options import parse_options
from meshcone.verbs.refine import refine
from tests.unit.engine.pairs import rough, smooth
options = {"formulation": "centroid", "centroid": {"form": sys.argv[1]}}
refine(rough(), smooth(), parse_options(options))
print(sorted({"cvxpy", "scipy.stats"} & set(sys.modules)))
"""


def slow_imports(form: str) -> str:
    answer = subprocess.run(
        [sys.executable, "-c", _REFINE, form],
        capture_output=True,
        text=True,
        check=True,
        timeout=300,
    )
    return answer.stdout.strip()


def test_cvxpy_is_imported_where_its_model_is_asked_for() -> None:
    assert "cvxpy" in slow_imports("cvxpy")


def test_elsewhere_neither_cvxpy_nor_scipys_distributions_are_imported() -> None:
    assert slow_imports("reduced") == "[]"
