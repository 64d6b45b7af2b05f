"""Refining to a tolerance: refine, prove, and where the proof fails try harder."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from time import monotonic

from meshcone.errors import InfeasibleError, InputError, LimitError, SolveTimeoutError
from meshcone.files import MeshFile
from meshcone.options import Options
from meshcone.progress import Progress, ProgressCallback
from meshcone.report.reaching import is_within, within_record
from meshcone.report.report import Report
from meshcone.report.within import WithinRecord
from meshcone.verbs.refine import Refinement, refine

# Rounds with ever less fairness, after those that were asked for: they trade a smooth surface
# for a close one. The second time each vertex moves more freely besides.
_MORE_ROUNDS = (0.01, 0.003, 0.001)
_FREER = {"proximity": 0.001, "tangential": 0.03}
# Where faces are added, each further attempt aims at this share of the distance of the last.
_AIM = 0.6
# A further attempt has more rounds than the one before, and what comes after its solve takes time
# too: with less time than this many of the longest, it would end in nothing.
_TIMES_THE_LONGEST = 2.0


def refine_within(
    source: MeshFile,
    reference: MeshFile,
    options: Options,
    progress: ProgressCallback | None = None,
    solve_seconds: float | None = None,
) -> Refinement:
    """Refine; where the options have a tolerance, until the result is proven to be within it.

    Each attempt is a refinement of its own, from the source. Its report states the options it
    was made with, so that it can be verified and replayed like any other.

    Args:
        source: the mesh to refine.
        reference: the mesh it should have been.
        options: of the first attempt.
        progress: called between stages and rounds of each attempt.
        solve_seconds: what all attempts together may take. It is the machine's business, as for
            :func:`meshcone.verbs.refine.refine`.

    Returns:
        The first that is within the tolerance, or else the one whose farthest sample or vertex is
        nearest; the section ``within`` of its report says which. Without a tolerance, the only
        one.

    Raises:
        InputError: there is a gate on the deviation besides, no proof is to be made, or the unit
            of the tolerance is not known.
        InputError, LimitError, InfeasibleError, SolveTimeoutError: as a refinement, by the
            first attempt.
    """
    if options.within is None:
        return refine(source, reference, options, progress, solve_seconds)
    plans = list(_plans(options.gated_within(source.name, reference.name)))
    clock = _Clock(solve_seconds)
    best: Refinement | None = None
    attempts = 0
    for number, chosen in enumerate(plans):
        if best is not None and not clock.allows_another():
            break
        if best is not None:
            chosen = _finer(chosen, within_record(best.report, options.within, number), best.report)
        attempts += 1
        shown = None if progress is None else _part_of(progress, number, len(plans))
        try:
            with clock:
                found = refine(source, reference, chosen, shown, clock.left())
        except (InfeasibleError, LimitError, SolveTimeoutError):
            if best is None:
                raise
            break  # trying harder takes more than there is; what was found before stands
        _require_both_ways(found.report)
        # What does not fit is returned as it came, however often it is tried.
        if is_within(found.report) or found.report.outcome == "misaligned":
            best = found
            break
        if best is None or _farthest(found) < _farthest(best):
            best = found
    assert best is not None  # noqa: S101 - the first attempt is always made
    told = within_record(best.report, options.within, attempts)
    return replace(best, report=best.report.model_copy(update={"within": told}))


def _require_both_ways(report: Report) -> None:
    if report.deviation is not None and report.deviation.max is None:
        raise InputError(
            "option 'within': the reference is points, and nothing is proven of what lies between "
            "them; bound 'deviation.missing' with a gate instead",
            file=report.inputs.reference.name,
        )


def _plans(options: Options) -> Iterator[Options]:
    """What was asked for; and, where that is the surface program, two ways to try harder."""
    yield options
    surface = options.surface
    if options.formulation != "surface" or not surface.fairness:
        return
    longer = surface.model_copy(update={"fairness": (*surface.fairness, *_MORE_ROUNDS)[:50]})
    for harder in (longer, longer.model_copy(update=_FREER)):
        yield options.model_copy(update={"surface": harder})


def _finer(options: Options, missed: WithinRecord, report: Report) -> Options:
    """Options that add faces down to a smaller distance, where samples were within the last one."""
    told = report.detail
    if told is None or told.stopped != "tolerance":
        return options
    aim = _AIM**missed.attempts * missed.limit_model / report.frame.radius
    detail = options.detail.model_copy(update={"tolerance": aim})
    return options.model_copy(update={"detail": detail})


def _part_of(progress: ProgressCallback, number: int, attempts: int) -> ProgressCallback:
    """Tell of one attempt as a part of all there may be."""

    def tell(seen: Progress) -> None:
        progress(replace(seen, fraction=(number + seen.fraction) / attempts))

    return tell


def _farthest(found: Refinement) -> float:
    refined = found.report.quality.refined
    assert refined is not None  # noqa: S101 - the report is of a refinement
    return refined.point_to_surface.max


class _Clock:
    """The time that attempts take, of what there is for all of them."""

    def __init__(self, seconds: float | None) -> None:
        self._seconds = seconds
        self._spent = 0.0
        self._longest = 0.0
        self._began = 0.0

    def __enter__(self) -> None:
        self._began = monotonic()

    def __exit__(self, *_: object) -> None:
        took = monotonic() - self._began
        self._spent += took
        self._longest = max(self._longest, took)

    def left(self) -> float | None:
        return None if self._seconds is None else self._seconds - self._spent

    def allows_another(self) -> bool:
        left = self.left()
        return left is None or left >= _TIMES_THE_LONGEST * self._longest
