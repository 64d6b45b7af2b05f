"""What ``meshcone gate`` shows on a terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from meshcone.gates.results import AssetResult, GateRun
from meshcone.gates.words import label
from meshcone.text import printable

if TYPE_CHECKING:
    from rich.table import Table


@contextmanager
def progress_bar(total: int) -> Iterator[Callable[[AssetResult], None]]:
    """Show on stderr how many assets are done; silent if stderr is not a terminal."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    columns = (
        TextColumn("gate"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.description}", markup=False),
        TimeElapsedColumn(),
    )
    with Progress(
        *columns, console=console, transient=True, disable=not console.is_terminal
    ) as bar:
        task = bar.add_task("", total=total)
        failed = 0

        def show(result: AssetResult) -> None:
            nonlocal failed
            failed += result.ending != "pass"
            description = f"{failed} not passed" if failed else ""
            bar.update(task, advance=1, description=description)

        yield show


def summary_table(run: GateRun) -> Table:
    """A row for each asset: its verdict, how many checks it passed, how long it took."""
    from rich import box
    from rich.table import Table
    from rich.text import Text

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("asset", overflow="fold")
    table.add_column("verdict")
    table.add_column("checks passed", justify="right")
    table.add_column("seconds", justify="right")
    for asset in run.assets:
        checks = asset.checks()
        passed = sum(check.status == "pass" for check in checks)
        table.add_row(
            Text(printable(asset.name)),  # a string would be read as markup
            _shown(asset.ending),
            f"{passed} of {len(checks)}" if checks else "-",
            f"{asset.seconds:.2f}",
        )
    return table


def check_lines(asset: AssetResult) -> Iterator[str]:
    """What is proven of an asset, then a line for each check and for each warning."""
    if asset.statement is not None:
        yield f"{'proven':<11} {asset.statement}"
    for check in asset.checks():
        yield f"{label(check.status, check.severity):<11} {check.words}"
    for warning in asset.warnings:
        yield f"{'warning':<11} {warning}"


def finding_lines(run: GateRun) -> Iterator[str]:
    """A line for each check, of any asset, that did not pass, and for each kind of warning."""
    for asset in run.assets:
        for check in asset.checks():
            if check.status != "pass":
                yield f"{label(check.status, check.severity):<11} {asset.name}: {check.words}"
    warned: dict[str, list[str]] = {}
    for asset in run.assets:
        for warning in asset.warnings:
            warned.setdefault(warning.code, []).append(f"{asset.name}: {warning.words}")
    for code, lines in sorted(warned.items()):
        others = f" (and {len(lines) - 1:,} more)" if len(lines) > 1 else ""
        yield f"{'warning':<11} {code}: {lines[0]}{others}"


def closing_line(run: GateRun) -> str:
    """How many assets ended how."""
    ends = ", ".join(f"{number} {_shown(name)}" for name, number in run.counts.items() if number)
    return f"{len(run.assets)} {'asset' if len(run.assets) == 1 else 'assets'}: {ends}"


def _shown(ending: str) -> str:
    return {"not_tested": "not tested", "fail": "FAILED", "error": "ERROR"}.get(ending, ending)
