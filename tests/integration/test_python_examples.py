"""The examples in README.md, docs/python.md and docs/simplify.md, run as they stand."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

from service.stack import Stack

ROOT = Path(__file__).parents[2]
MANUAL = ROOT / "docs" / "python.md"
SIMPLIFY = ROOT / "docs" / "simplify.md"
_BLOCK = re.compile(r"^```python *(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def blocks(document: Path, kind: str = "") -> list[str]:
    return [code for found, code in _BLOCK.findall(document.read_text()) if found == kind]


def run(folder: Path, program: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=folder, capture_output=True, text=True, timeout=240
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_lines_in_the_readme_run_in_an_empty_directory(tmp_path: Path) -> None:
    [program] = blocks(ROOT / "README.md")

    said = run(tmp_path, program)

    shown = program.partition("print(refined)  # ")[2].partition("\n")[0]
    assert said == f"<Refined source.obj → reference.obj: {shown}>\n"
    written = {"refined.obj", "report.json", "report.certificate.npz"}
    assert {path.name for path in tmp_path.iterdir()} == written
    assert len(list(filter(None, program.splitlines()))) == 8


def test_the_examples_of_the_manual_run_one_after_the_other(tmp_path: Path) -> None:
    said = run(tmp_path, "\n".join(blocks(MANUAL)))

    shown = [line.partition("#")[2].strip() for line in MANUAL.read_text().splitlines()]
    told = [text.removesuffix(" …") for text in shown if text.startswith(("<", "source, face"))]
    assert len(told) == 3
    assert all(text in said for text in told)


def test_the_way_from_a_simplified_copy_to_a_passed_gate_can_be_gone(tmp_path: Path) -> None:
    said = run(tmp_path, "\n".join(blocks(SIMPLIFY))).splitlines()

    moved, detailed = (float(line.removesuffix(" of the distance is left")) for line in said[:2])
    assert detailed < moved / 2 < 0.5
    assert said[2:4] == ["coarse.obj fail", "detailed.obj pass"]
    assert "the refined file is the optimum of its last round" in said[4]


def test_the_manuals_client_runs_against_a_service(tmp_path: Path, stack: Stack) -> None:
    [example] = blocks(MANUAL, "service")
    program = "\n".join([blocks(MANUAL)[0], example, "print(job.state, report['outcome'])"])

    said = run(tmp_path, program.replace("http://127.0.0.1:8000", stack.url))

    assert said == "succeeded improved\n"
