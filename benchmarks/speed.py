"""Time and memory by size, constraints and number of threads, each row in a fresh process."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from conic_peers import CONIC_PEERS
from methods import PEERS
from rich.console import Console
from rich.table import Table
from speed_row import ENGINE, PROGRAM, Case, Constraint
from threads import processors, thread_environment

_ROW = Path(__file__).with_name("speed_row.py")
_ROW_SECONDS = 900
_SMALL, _MEDIUM = 4_400, 134_000
_SCALING = (4_400, 17_000, 67_000, 134_000, 270_000, 540_000, 1_000_000)
_CONSTRAINTS: tuple[Constraint, ...] = ("none", "displacement", "edges")


def cases(largest: int) -> list[tuple[Case, int]]:
    """The rows up to a size, with the number of threads of each."""
    chosen: list[tuple[Case, int]] = []
    for threads in (1, 2):
        for constraint in _CONSTRAINTS:
            for certify in (False, True):
                case = Case(ENGINE, _SMALL, certify=certify, constraint=constraint)
                chosen.append((case, threads))
        for certify in (False, True):
            chosen.append((Case(ENGINE, _SMALL, effort="best", certify=certify), threads))
        chosen.append((Case(ENGINE, _MEDIUM, certify=True), threads))
    chosen += [(Case(ENGINE, size), 1) for size in _SCALING if size != _SMALL]
    chosen += [(Case(ENGINE, size), 2) for size in (_MEDIUM, 1_000_000)]
    chosen.append((Case(ENGINE, _MEDIUM, radius_noise=0.02), 1))
    chosen += [(Case(name, size), 1) for size in (_SMALL, _MEDIUM, 1_000_000) for name in PEERS]
    for constraint in _CONSTRAINTS:
        for name in (PROGRAM, *CONIC_PEERS):
            chosen.append((Case(name, _SMALL, constraint=constraint), 1))
    return [(case, threads) for case, threads in chosen if case.vertices <= largest]


def run_speed(largest: int) -> dict[str, Any]:
    """Run every case up to a size, one after the other."""
    rows = []
    for case, threads in cases(largest):
        rows.append({"threads": threads, **run_row(case, threads)})
        print(json.dumps(rows[-1]), file=sys.stderr, flush=True)
    return {"rows": rows, "growth": growth(rows)}


def run_row(case: Case, threads: int) -> dict[str, Any]:
    """Measure a case in a process of its own, on as many processors as threads."""
    command = [sys.executable, str(_ROW), json.dumps(asdict(case))]
    try:
        with processors(threads):
            done = subprocess.run(
                command,
                env=thread_environment(threads),
                capture_output=True,
                text=True,
                timeout=_ROW_SECONDS,
            )
    except subprocess.TimeoutExpired:
        return {**asdict(case), "trouble": f"not finished after {_ROW_SECONDS} s"}
    if done.returncode != 0:
        last = (done.stderr.strip().splitlines() or ["no message"])[-1]
        return {**asdict(case), "trouble": f"exit code {done.returncode}: {last}"}
    row: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return row


def growth(rows: Sequence[dict[str, Any]]) -> dict[str, float]:
    """Fit seconds = a (n log n)^e over the sizes of the unconstrained engine on one thread."""
    plain = {"method": ENGINE, "effort": "fast", "certify": False, "constraint": "none"}
    plain |= {"radius_noise": 0.0, "threads": 1}
    points = [
        (row["vertices"], row["seconds"])
        for row in rows
        if "seconds" in row and all(row[key] == value for key, value in plain.items())
    ]
    if len(points) < 3:
        return {}
    n, seconds = np.array(sorted(points)).T
    exponent, offset = np.polyfit(np.log(n * np.log(n)), np.log(seconds), 1)
    return {"exponent": float(exponent), "factor": float(np.exp(offset)), "sizes": len(points)}


def print_speed(results: dict[str, Any], console: Console) -> None:
    """Print the rows and the fit."""
    table = Table(title="a bumpy torus with noise, refined against itself")
    for title in ("method", "asked"):
        table.add_column(title)
    for title in ("processors", "vertices", "active", "s", "cpu s", "peak MiB", "p2s", "normals"):
        table.add_column(title, justify="right")
    table.add_column("objective, violation")
    rows: Sequence[dict[str, Any]] = results["rows"]
    for row in rows:
        table.add_row(*_cells(row, rows))
    console.print(table)
    fit = results["growth"]
    if fit:
        console.print(
            f"seconds grow as (n log n)^{fit['exponent']:.2f} over {fit['sizes']} sizes, "
            "one processor, nothing asked for"
        )


def _cells(row: dict[str, Any], rows: Sequence[dict[str, Any]]) -> list[str]:
    asked = [row["effort"]] if row["method"] == ENGINE else []
    asked += [row["constraint"]] * (row["constraint"] != "none")
    asked += ["certify"] * row["certify"] + ["noise .02"] * bool(row["radius_noise"])
    head = [row["method"], ", ".join(asked), str(row["threads"]), str(row["vertices"])]
    if "seconds" not in row:
        return [*head, *["-"] * 6, row["trouble"]]
    return [
        *head,
        f"{row['active_share']:.3f}" if row["constraint"] != "none" else "-",
        f"{row['seconds']:.3f}",
        f"{row['processor_seconds']:.3f}",
        f"{row['peak_mebibytes']:.0f}",
        f"{row['ratio']:.4f}",
        f"{row['normals']:.4f}",
        _optimality(row, rows),
    ]


def _optimality(row: dict[str, Any], rows: Sequence[dict[str, Any]]) -> str:
    if "objective" not in row:
        return ""
    ours = [r for r in rows if r["method"] == PROGRAM and r["constraint"] == row["constraint"]]
    if not ours or "objective" not in ours[0]:
        return f"{row['objective']:.6g}, {row['violation']:.1e}"
    difference = row["objective"] / ours[0]["objective"] - 1
    times = row["seconds"] / ours[0]["seconds"]
    return f"{difference:+.1e}, {row['violation']:.1e}; {times:.1f} times"
