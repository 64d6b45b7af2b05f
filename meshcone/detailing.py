"""Solving a pair whose source may get faces where it has too few."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from meshcone.assets.limits import Limits
from meshcone.assets.policy import WritePolicy
from meshcone.conflict_words import in_words
from meshcone.detail.levels import Detail, find_detail
from meshcone.detail.records import DetailRecord, Stopped
from meshcone.detail.tangles import are_many, new_tangles
from meshcone.errors import InputError
from meshcone.formulation import CentroidFormulation, SurfaceFormulation, formulate
from meshcone.options import WITHIN_GATE, Options
from meshcone.options.cones import ConeOptions
from meshcone.pair import Pair
from meshcone.program.answer import RefinedPositions
from meshcone.program.attempt import RoundCallback
from meshcone.program.infeasibility import ContradictionError
from meshcone.program.seams import Seams
from meshcone.settings import load_settings
from meshcone.solving import solve
from meshcone.surface import Subdivision
from meshcone.surface.arrays import Floats

# Samples find the farthest point only nearly, and the rounds after the levels move it.
_AIM = 0.8


@dataclass(frozen=True)
class Solution:
    """A pair and the answer to its program.

    Attributes:
        pair: with the faces of the source divided, if they are.
        problem: its program.
        answer: where its source's vertices go.
        subdivision: how the faces of the source that was sent are divided; None if they are not.
        detail: what came of faces that could be added; None if none could.
    """

    pair: Pair
    problem: SurfaceFormulation | CentroidFormulation
    answer: RefinedPositions
    subdivision: Subdivision | None = None
    detail: DetailRecord | None = None


def require_divisible(pair: Pair, options: Options) -> None:
    """Check, before anything is solved, that faces can be added where the options ask for it.

    Raises:
        InputError: the formulation, a constraint or the source's format knows no added faces.
        LimitError: more faces are allowed than this installation accepts.
    """
    if not options.detail.wanted:
        return
    if options.formulation != "surface":
        raise InputError("option 'detail' needs the surface formulation")
    pin = options.cones.pin
    if pin.vertices or pin.vertices_file is not None:
        raise InputError(
            "option 'detail': vertices are pinned by their numbers, and added ones change the "
            "numbers; pin borders or select parts instead"
        )
    pair.source_asset.ensure_divisible(pair.policy or WritePolicy())
    allowed = options.detail.faces_allowed(len(pair.source.faces))
    load_settings(Limits).check("faces", allowed, "faces are what the option 'detail' allows")


def solve_in_detail(
    pair: Pair,
    options: Options,
    on_level: Callable[[int, int], None],
    on_round: RoundCallback,
) -> Solution:
    """Add faces where the options ask for it, and solve the program of what results.

    Where the answer with more faces is worse than the input somewhere, none are added.

    Args:
        pair: the files.
        options: the caller's.
        on_level: called with the faces so far and the faces allowed.
        on_round: called with the rounds done and the rounds in all.

    Raises:
        InputError: the file cannot be written with the faces that were found.
        InfeasibleError: the constraints contradict each other.
        SolveTimeoutError: the time that is allowed is over.
    """
    if not (options.detail.wanted and options.surface.fairness):
        return _solved(pair, formulate(pair, options), on_round)
    found = _found(pair, options, on_level)
    if not found.subdivision.divided.any():
        plain = _solved(pair, formulate(pair, options), on_round)
        record = _record(Subdivision.none(len(pair.source.faces)), found, found.stopped, options)
        return Solution(pair, plain.problem, plain.answer, None, record)
    divided = pair.divided(found.subdivision, options)
    solution = _less_tangled(divided, _start(divided, found, options), options, on_round)
    if not solution.answer.kept_input:
        record = _record(found.subdivision, found, found.stopped, options)
        return replace(solution, subdivision=found.subdivision, detail=record)
    plain = _solved(pair, formulate(pair, options), on_round)
    record = _record(Subdivision.none(len(pair.source.faces)), found, "harm", options)
    return Solution(pair, plain.problem, plain.answer, None, record)


def _less_tangled(
    divided: Pair, start: Floats | None, options: Options, on_round: RoundCallback
) -> Solution:
    """Solve from where the levels ended, or from the source where that tangles fewer faces."""
    first = _solved(divided, SurfaceFormulation(divided, options, start), on_round)
    if start is None or first.answer.kept_input:
        return first
    pairs = options.quality.intersection_pairs
    tangles = new_tangles(divided.source, first.answer.positions, pairs)
    if not are_many(tangles, len(divided.source.faces)):
        return first
    other = _solved(divided, SurfaceFormulation(divided, options, None), on_round)
    fewer = new_tangles(divided.source, other.answer.positions, pairs) < tangles
    return other if fewer and not other.answer.kept_input else first


def _found(pair: Pair, options: Options, on_level: Callable[[int, int], None]) -> Detail:
    """Find how to divide the source, every triangle of the file in one way wherever it is drawn.

    Where that leaves gaps, because a mesh that is drawn twice meets others in different ways,
    what is drawn more than once is not divided.
    """
    joined = Seams.of(pair.source).joined
    aimed = options.model_copy(
        update={"detail": options.detail.model_copy(update={"tolerance": _aim(pair, options)})}
    )
    twins = pair.source_asset.twins()
    counts = np.bincount(twins, minlength=len(twins))
    divisible = np.ones(len(twins), dtype=bool)
    np.logical_and.at(divisible, twins, pair.divisible)
    charts = pair.source_asset.charts() if options.detail.flips == "chart" else None
    single = divisible & (counts == 1)
    charts = charts and charts.keeping(~single)
    found = find_detail(
        joined, pair.reference, divisible & (counts > 0), aimed, on_level, counts, charts
    )
    if (counts == 1).all():
        return found
    alike = pair.source_asset.divided_alike(found.subdivision)
    if alike.is_conforming(joined.faces):
        return replace(found, subdivision=alike)
    return find_detail(joined, pair.reference, single, aimed, on_level, charts=charts)


def _solved(
    pair: Pair, problem: SurfaceFormulation | CentroidFormulation, on_round: RoundCallback
) -> Solution:
    try:
        return Solution(pair, problem, solve(problem, on_round))
    except ContradictionError as error:
        raise in_words(error, pair, problem) from None


def _aim(pair: Pair, options: Options) -> float:
    """The distance to divide down to, in the frame: the tightest that is asked for."""
    asked = [options.detail.tolerance]
    gate = pair.gates(options).get(WITHIN_GATE)
    if gate is not None and gate.max is not None:
        asked.append(_AIM * gate.max)
    if gate is not None and gate.max_model is not None:
        asked.append(_AIM * gate.max_model / pair.frame.radius)
    return min([each for each in asked if each > 0], default=0.0)


def _start(pair: Pair, found: Detail, options: Options) -> Floats | None:
    """Where the rounds start, (n, 3): where the levels ended, unless that may break a constraint.

    A single round starts at the source, because a certificate proves no more of its start.
    """
    faces = pair.source.faces
    known = len(found.corners) == len(faces)  # those of twins are not
    if not known or options.cones != ConeOptions() or len(options.surface.fairness) == 1:
        return None
    start = pair.source.vertices.copy()
    start[faces.ravel()] = found.corners.reshape(-1, 3)
    return np.where(pair.fixed[:, None], pair.source.vertices, start)


def _record(
    subdivision: Subdivision, found: Detail, stopped: Stopped, options: Options
) -> DetailRecord:
    return DetailRecord(
        faces_before=subdivision.sources,
        faces_after=len(subdivision.parents),
        faces_allowed=options.detail.faces_allowed(subdivision.sources),
        divided=int(np.count_nonzero(subdivision.divided)),
        swapped=int(np.count_nonzero(subdivision.swapped)),
        levels=found.levels,
        stopped=stopped,
    )
