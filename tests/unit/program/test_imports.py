"""CVXPY is slow to import: only its own model pays for that."""

from __future__ import annotations

import subprocess
import sys

import pytest

_REFINE = """
import sys
from meshcone.options import parse_options
from meshcone.verbs.refine import refine
from tests.unit.engine.pairs import rough, smooth
options = {"formulation": "centroid", "centroid": {"form": sys.argv[1]}}
refine(rough(), smooth(), parse_options(options))
print("cvxpy" in sys.modules)
"""


@pytest.mark.parametrize(("form", "imported"), [("reduced", "False"), ("cvxpy", "True")])
def test_cvxpy_is_imported_only_where_its_model_is_asked_for(form: str, imported: str) -> None:
    answer = subprocess.run(
        [sys.executable, "-c", _REFINE, form],
        capture_output=True,
        text=True,
        check=True,
        timeout=300,
    )

    assert answer.stdout.strip() == imported
