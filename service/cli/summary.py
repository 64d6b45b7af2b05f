"""The result of a refinement as text for a terminal."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

_ROUNDING = 1e-12  # of distances that are zero
_TOLD_AS_TIMES = 1.01  # of less, "1 times closer" would say that nothing was gained
_OUTCOMES = {
    "improved": "on average the refined surface lies {times} times closer to the reference than "
    "the input",
    "indistinguishable": "the input lay on the reference already, as closely as files store "
    "positions",
    "undecided": "input and refined mesh are equally close, as far as samples can tell",
    "unchanged": "no vertex moved",
    "kept": "every answer found was worse somewhere, so the input is returned",
    "misaligned": "source and reference do not fit, so the input is returned",
    "reference_copy": "the answer is a copy of the reference, which is no refinement",
    "worse": "the refined surface lies farther from the reference than the input",
}


def summary_lines(report: Mapping[str, Any]) -> list[str]:
    """What was solved and proved, how long each stage took, and the outcome in words."""
    solver = report["solver"]
    rounds = solver["rounds"]
    methods = Counter(record["method"] for record in rounds)
    seconds = {name: spent for name, spent in report["timings"].items() if name != "metrics"}
    stages = ", ".join(f"{stage} {spent:.2f}" for stage, spent in seconds.items())
    return [
        f"rounds         {len(rounds)} with the setting '{solver['candidate']}': "
        + ", ".join(f"{count} by {method}" for method, count in methods.items()),
        *_certificate_lines(report),
        f"SCS            {_asked_of_scs(solver)}",
        f"seconds        {stages}",
        outcome_line(report),
    ]


def outcome_line(report: Mapping[str, Any]) -> str:
    """The outcome, and what it means."""
    return f"outcome        {report['outcome']}: {_in_words(report)}"


def kept_words(report: Mapping[str, Any]) -> str:
    """What the certificate of an input that was kept is about."""
    about = "none" if report.get("statement") is None else "of closeness alone"
    return f"{about}: the input was kept as it was"


def _certificate_lines(report: Mapping[str, Any]) -> list[str]:
    certificate = report["certificate"]
    if certificate is None:
        return [f"certificate    {kept_words(report)}"]
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


def _in_words(report: Mapping[str, Any]) -> str:
    before, after = (
        report["quality"][name]["point_to_surface"]["mean"] for name in ("input", "refined")
    )
    times = before / max(after, _ROUNDING)
    if report["outcome"] == "improved" and times < _TOLD_AS_TIMES:
        return (
            "on average the refined surface lies closer to the reference than the input, by less "
            "than 1 %"
        )
    written = f"{times:,.0f}" if times >= 10 else f"{times:.3g}"
    return _OUTCOMES[report["outcome"]].format(times=written)
