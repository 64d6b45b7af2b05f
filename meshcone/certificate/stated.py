"""Whether the report says of its files, its frame and its tolerance what they are."""

from __future__ import annotations

from collections.abc import Iterator
from math import isclose

from meshcone.certificate.checks import Check
from meshcone.errors import InputError
from meshcone.files import MeshFile
from meshcone.gates.judge import judge
from meshcone.gates.units import sized, unit_for
from meshcone.options import WITHIN_GATE
from meshcone.options.tolerance import Tolerance
from meshcone.pair import Pair, describe
from meshcone.report.reaching import within_record
from meshcone.report.report import InputRecord, Report
from meshcone.report.within import WithinRecord

_ROUNDING = 1e-9  # of the radius
# Names are whatever files are called where they are; hashes are checks of their own.
_LEFT_OUT = {"name", "sha256", "resources", "validity"}


def files_checks(report: Report, pair: Pair, refined: MeshFile) -> Iterator[Check]:
    """Hold what the report says of its files and of the frame against those at hand.

    Args:
        report: which is looked at.
        pair: as it was read, before anything was moved or divided.
        refined: the refined file.
    """
    fault = None
    for side, file, asset, stated in (
        ("source", pair.source_file, pair.source_asset, report.inputs.source),
        ("reference", pair.reference_file, pair.reference_asset, report.inputs.reference),
    ):
        fault = fault or _difference(side, stated, describe(file, asset, stated.validity))
    words = "sizes and counts are as the report states; names and validity: not checked"
    yield Check("inputs", fault is None, fault or words)
    size, stated_size = len(refined.data), report.output.bytes
    ok = size == stated_size
    words = "as the report states; its name: not checked"
    words = words if ok else f"the report states {stated_size:,}"
    yield Check("output", ok, f"the refined file has {size:,} bytes, {words}")
    yield _frame_check(report, pair)


def _difference(side: str, stated: InputRecord, found: InputRecord) -> str | None:
    there = stated.model_dump(exclude=_LEFT_OUT)
    for name, value in found.model_dump(exclude=_LEFT_OUT).items():
        if there[name] != value:
            return f"{name} of the {side} is {value}, the report states {there[name]}"
    return None


def _frame_check(report: Report, pair: Pair) -> Check:
    found, stated = pair.frame_record(), report.frame
    near = _ROUNDING * found.radius
    apart = [abs(a - b) for a, b in zip(found.centre, stated.centre, strict=True)]
    ok = all(each <= near for each in (*apart, abs(found.radius - stated.radius)))
    words = f"the radius of the reference is {found.radius:.6g}, the report states "
    words += "it and the centre" if ok else f"{stated.radius:.6g}, or another centre"
    return Check("frame", ok, words)


def solver_check(report: Report) -> Check:
    """Hold what the report says of its program against the options, and its sums against rounds."""
    stated, options = report.solver, report.options
    asked = [record.info for record in stated.rounds if record.info is not None]
    last = stated.rounds[-1].info if stated.rounds else None
    centroid = options.formulation == "centroid"
    found = {
        "formulation": options.formulation,
        "form": options.centroid.form if centroid else "reduced",
        "effort": options.effort,
        "solved": all(info.solved for info in asked),
        "confirmed": last is not None and last.solved,
        "iterations": sum(info.iterations for info in asked),
    }
    for name, value in found.items():
        if (told := getattr(stated, name)) != value:
            words = f"'{name}' is {value} by the options and rounds, the report states {told}"
            return Check("solver", False, words)
    words = "formulation, form and effort are those of the options, and sums those of the rounds; "
    return Check("solver", True, words + "the rounds themselves: not checked")


def within_checks(report: Report, pair: Pair) -> Iterator[Check]:
    """Hold what the report says of a tolerance against its intervals, which are checked apart.

    Args:
        report: which is looked at.
        pair: which knows the radius, and whose formats say what lengths are in.
    """
    stated = report.within
    if stated is None:
        if WITHIN_GATE in report.options.gates:
            words = f"there is a gate on '{WITHIN_GATE}', and the report states no tolerance; "
            yield Check("within", True, words + "whether one was asked for: not checked")
        return
    try:
        fault = _not_reached_so(report, stated, pair)
    except InputError as error:
        fault = error.message
    reached = "reached" if stated.reached else "not reached"
    words = f"{stated.asked} is {reached}, as the intervals say; attempts and the distances of "
    yield Check("within", fault is None, fault or words + "samples: not checked")


def _not_reached_so(report: Report, stated: WithinRecord, pair: Pair) -> str | None:
    rule = report.options.gates.get(WITHIN_GATE)
    if rule is None or report.deviation is None or report.deviation.max is None:
        return "the report states a tolerance, and its options or intervals have none"
    judged = report.model_copy(update={"gates": judge(report, {WITHIN_GATE: rule})})
    own = judged.model_copy(update={"frame": pair.frame_record()})
    found = within_record(own, stated.asked, stated.attempts)
    if not isclose(found.limit_model, _asked(report, stated.asked, pair), rel_tol=_ROUNDING):
        return f"the options ask for {found.limit_model:.6g} in model units, not for {stated.asked}"
    if not isclose(found.limit_model, stated.limit_model, rel_tol=_ROUNDING):
        return f"the limit is {found.limit_model:.6g}, the report states {stated.limit_model:.6g}"
    if found.unit != stated.unit:
        return f"lengths are in {found.unit}, the report states {stated.unit}"
    if found.reached != stated.reached:
        return "the intervals say otherwise whether the tolerance is reached"
    if len(found.places) != len(stated.places) or not all(
        here.on == there.on
        and here.position == there.position
        and isclose(here.distance_model, there.distance_model, rel_tol=_ROUNDING)
        for here, there in zip(found.places, stated.places, strict=True)
    ):
        return "the places beyond the tolerance are not those of the report's worst points"
    return None


def _asked(report: Report, text: str, pair: Pair) -> float:
    """A tolerance in model units."""
    tolerance = Tolerance.parse(text)
    if tolerance.relative:
        return tolerance.value * pair.frame.radius
    formats = sized(
        pair.source_asset.format,
        pair.reference_asset.format,
        scaled=report.options.align == "similarity",
    )
    return tolerance.value * unit_for(tolerance.unit, *formats).length
