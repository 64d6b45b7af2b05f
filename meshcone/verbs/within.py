"""Refining to a tolerance: refine, prove, and where the proof fails try harder."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import PurePosixPath

from meshcone.errors import InfeasibleError, InputError, LimitError, SolveTimeoutError
from meshcone.files import MeshFile
from meshcone.gates.rules import GateRule
from meshcone.options import Options
from meshcone.progress import ProgressCallback
from meshcone.verbs.refine import Refinement, refine

_GATE = "deviation.max"
_TOLERANCE = re.compile(r"(?P<number>\d*\.?\d+(?:[eE][+-]?\d+)?) ?(?P<unit>%|[A-Za-z]{0,20})")
# Of a glTF, whose distances are metres (glTF 2.0, section 3.4).
_METRES = {"m": 1.0, "mm": 0.001, "cm": 0.01, "um": 1e-6, "km": 1000.0, "in": 0.0254, "ft": 0.3048}
# Rounds with ever less fairness, after those that were asked for: they trade a smooth surface
# for a close one. The second time each vertex moves more freely besides.
_MORE_ROUNDS = (0.01, 0.003, 0.001)
_FREER = {"proximity": 0.001, "tangential": 0.03}


@dataclass(frozen=True)
class Tolerance:
    """How far the refined surface and the reference may go from each other.

    Attributes:
        value: in the unit of the files, or relative to the reference's radius.
        relative: which of both.
        unit: what the unit of the files is called, if it was named.
    """

    value: float
    relative: bool = False
    unit: str | None = None

    @staticmethod
    def parse(text: str) -> Tolerance:
        """Read ``0.5``, ``0.5mm`` (named as the files' unit) or ``0.2%`` (of the radius).

        Raises:
            InputError: it is none of these, or not positive.
        """
        found = _TOLERANCE.fullmatch(text.strip())
        value = float(found["number"]) if found else 0.0
        if found is None or not 1e-12 <= value <= 1e12:
            raise InputError(
                f"'{text}' is no tolerance: expected a length in the unit of the files, such as "
                "0.5 or 0.5mm, or a share of the radius, such as 0.2%"
            )
        if found["unit"] == "%":
            return Tolerance(value / 100, relative=True)
        return Tolerance(value, unit=found["unit"] or None)

    def in_metres(self) -> Tolerance:
        """The same where the unit of the files is the metre.

        Raises:
            InputError: the unit is named, and is none of those known.
        """
        if self.relative or self.unit is None:
            return self
        if self.unit not in _METRES:
            known = ", ".join(_METRES)
            raise InputError(
                f"a glTF is in metres, and '{self.unit}' is no unit known here: expected a length "
                f"in one of {known}"
            )
        return Tolerance(self.value * _METRES[self.unit], unit="m")

    def gated(self, options: Options) -> Options:
        """Options with a gate on the proven deviation.

        Raises:
            InputError: nothing would be proven, or there is such a gate already.
        """
        if _GATE in options.gates:
            raise InputError(f"a tolerance is a gate on '{_GATE}', and there is one already")
        if not options.deviation.prove:
            raise InputError("a tolerance needs the proof that `deviation.prove` turns off")
        bound = {"max": self.value} if self.relative else {"max_model": self.value}
        rule = GateRule.model_validate({**bound, "unit": self.unit})
        return options.model_copy(update={"gates": {**options.gates, _GATE: rule}})


@dataclass(frozen=True)
class Promise:
    """What came of it.

    Attributes:
        refinement: the first that is proven to be within the tolerance, or else the one
            whose farthest sample or vertex is nearest.
        kept: whether it is proven to be within.
        attempts: refinements made.
    """

    refinement: Refinement
    kept: bool
    attempts: int


def refine_within(
    source: MeshFile,
    reference: MeshFile,
    options: Options,
    tolerance: Tolerance,
    progress: ProgressCallback | None = None,
) -> Promise:
    """Refine until no point of either surface is proven to be farther than a tolerance.

    Each attempt is a refinement of its own, from the source; its report states the options it
    was made with, so that it can be verified and replayed like any other.

    Args:
        source: the mesh to refine.
        reference: the mesh it should have been.
        options: of the first attempt.
        tolerance: what to reach; converted into metres where the unit of the files is the metre.
        progress: called between stages and rounds of each attempt.

    Raises:
        InputError, LimitError, InfeasibleError, SolveTimeoutError: as a refinement, by the
            first attempt.
    """
    # Distances are those of the reference, which no other alignment scales the source to.
    sized = (reference,) if options.align == "similarity" else (reference, source)
    if any(PurePosixPath(each.name.lower()).suffix in (".glb", ".gltf") for each in sized):
        tolerance = tolerance.in_metres()
    best: Refinement | None = None
    attempts = 0
    for chosen in _attempts(tolerance.gated(options)):
        attempts += 1
        try:
            found = refine(source, reference, chosen, progress)
        except (InfeasibleError, LimitError, SolveTimeoutError):
            if best is None:
                raise
            break  # trying harder takes more than there is; what was found before stands
        if _is_within(found):
            return Promise(found, kept=True, attempts=attempts)
        if best is None or _farthest(found) < _farthest(best):
            best = found
    assert best is not None  # noqa: S101 - the first attempt is always made
    return Promise(best, kept=False, attempts=attempts)


def _attempts(options: Options) -> Iterator[Options]:
    """What was asked for; and, where that is the surface program, two ways to try harder."""
    yield options
    surface = options.surface
    if options.formulation != "surface" or not surface.fairness:
        return
    longer = surface.model_copy(update={"fairness": (*surface.fairness, *_MORE_ROUNDS)[:50]})
    for harder in (longer, longer.model_copy(update=_FREER)):
        yield options.model_copy(update={"surface": harder})


def _is_within(found: Refinement) -> bool:
    verdict = found.report.gates
    return verdict is not None and all(
        check.status == "pass" for check in verdict.checks if check.key == _GATE
    )


def _farthest(found: Refinement) -> float:
    refined = found.report.quality.refined
    assert refined is not None  # noqa: S101 - the report is of a refinement
    return refined.point_to_surface.max
