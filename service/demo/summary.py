"""The result of a refinement as text for a terminal."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.table import Table

_ZERO = 1e-12  # the rounding of distances that are zero

_OUTCOMES = {
    "improved": "the refined surface lies {times:.0f} times closer to the reference than the input",
    "indistinguishable": "input and refined mesh are equally close, as far as samples can tell",
    "unchanged": "no vertex moved",
    "reference_copy": "the answer is a copy of the reference, which is no refinement",
    "worse": "the refined surface lies farther from the reference than the input",
}


def metrics_table(report: dict[str, Any]) -> Table:
    """One row for each metric: input, refined, floor, and refined over input."""
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("metric")
    for heading in ("input", "refined", "floor", "refined / input"):
        table.add_column(heading, justify="right")
    quality = report["quality"]
    refined, floor = dict(_leaves(quality["refined"])), dict(_leaves(quality["floor"]))
    for name, before in _leaves(quality["input"]):
        after = refined[name]
        ratio = f"{after / before:.3f}" if before > _ZERO else "-"
        table.add_row(name, _number(before), _number(after), _number(floor[name]), ratio)
    return table


def summary_lines(report: dict[str, Any]) -> list[str]:
    """What was solved and proved, how long each stage took, and the outcome in words."""
    solver = report["solver"]
    rounds = solver["rounds"]
    methods = Counter(record["method"] for record in rounds)
    stages = ", ".join(f"{stage} {seconds:.2f}" for stage, seconds in report["timings"].items())
    return [
        f"rounds         {len(rounds)} with the setting '{solver['candidate']}': "
        + ", ".join(f"{count} by {method}" for method, count in methods.items()),
        *_certificate_lines(report["certificate"]),
        f"SCS            {_asked_of_scs(solver)}",
        f"seconds        {stages}",
        f"outcome        {report['outcome']}: {_in_words(report)}",
    ]


def _certificate_lines(certificate: dict[str, Any] | None) -> list[str]:
    if certificate is None:
        return ["certificate    none: the input was kept as it was"]
    residuals = ", ".join(f"{name} {value:.1e}" for name, value in certificate["optimum"].items())
    verdict = "holds" if certificate["holds"] else "does not hold"
    return [
        f"cones          {_count(certificate['cones'])}; active {_count(certificate['active'])}",
        f"certificate    {verdict}: residuals {residuals}, allowed {certificate['tolerance']:.0e}",
    ]


def _count(cones: dict[str, int]) -> str:
    return ", ".join(f"{number:,} {kind}" for kind, number in cones.items())


def _asked_of_scs(solver: dict[str, Any]) -> str:
    last = solver["rounds"][-1]["info"]
    if last is None:
        return "was not asked"
    verdict = (
        "confirms the last round" if solver["confirmed"] else "does not confirm the last round"
    )
    return (
        f"{verdict} in {last['setup_seconds'] + last['solve_seconds']:.2f} s: "
        f"{last['status']}, {last['iterations']} iterations, {last['linear_solver']}"
    )


def _in_words(report: dict[str, Any]) -> str:
    before, after = (
        report["quality"][name]["point_to_surface"]["mean"] for name in ("input", "refined")
    )
    return _OUTCOMES[report["outcome"]].format(times=before / max(after, _ZERO))


def _leaves(metrics: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, float]]:
    """Every number with its dotted name, as gates name it."""
    for name, value in metrics.items():
        if isinstance(value, dict):
            yield from _leaves(value, f"{prefix}{name}.")
        elif isinstance(value, int | float):
            yield prefix + name, float(value)


def _number(value: float) -> str:
    return "0" if abs(value) < _ZERO else f"{value:.3g}"
