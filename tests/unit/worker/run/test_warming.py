"""What a worker does before it forks is not done again in a horse."""

from __future__ import annotations

import subprocess
import sys

_LATE = """
import sys
import worker.run.task
from meshcone.options import parse_options
from meshcone.verbs.measure import measurement
from meshcone.verbs.refine import refine
from tests.unit.engine.pairs import rough, smooth
from worker.run.artifacts import of_measurement, of_refinement
from worker.run.warming import warm_up

warm_up()
before = set(sys.modules)
of_refinement("a.obj", refine(rough(), smooth(), parse_options({})))
of_measurement("a.obj", measurement(rough(), smooth(), parse_options({"mode": "measure"})))
print(sorted(set(sys.modules) - before))
"""


def test_a_job_imports_nothing_that_its_worker_has_not() -> None:
    answer = subprocess.run(
        [sys.executable, "-c", _LATE], capture_output=True, text=True, check=True, timeout=300
    )

    assert answer.stdout.strip() == "[]"
