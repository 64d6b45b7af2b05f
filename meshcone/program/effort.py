"""Which settings of the surface program are tried.

No single setting serves every mesh: dense noisy ones need strong smoothing first, which
melts coarse ones; thin parts need strong samples that reach far. ``best`` lets two race and
has the one that comes closer finish. Far from the reference a third starts stretched over it;
where most vertices are on the reference already, a third moves the others only.
Figures are in ``docs/performance.md``.
"""

from __future__ import annotations

from dataclasses import dataclass

from meshcone.options import Options, SurfaceOptions

_SMOOTHING = (30.0, 10.0)
# Stiff rounds first: they take the folds out of a start stretched over the reference, and lead
# a vertex whose neighbours are held to between them, wherever it comes from.
_UNFOLDING = (300.0, 100.0)
_FINISHING = (0.003, 0.001)


@dataclass(frozen=True)
class Candidate:
    """A named variation of the caller's settings.

    Attributes:
        name: what reports call it.
        options: the settings.
        stretched: whether its first round starts with the source stretched over the reference.
        holding: whether vertices that lie on the reference stay where they are.
    """

    name: str
    options: SurfaceOptions
    stretched: bool = False
    holding: bool = False

    @property
    def is_always_tried(self) -> bool:
        """Whether it is tried on every pair, and not only where the source asks for it."""
        return not (self.stretched or self.holding)

    @property
    def heat(self) -> int:
        """Rounds of the race: those without face pulls, or all."""
        rounds = len(self.options.fairness)
        return min(self.options.faces_from, rounds) or rounds


def candidates(options: Options) -> list[Candidate]:
    """List the variations there are, the most often best first.

    The caller's schedule is extended, never replaced: each variation solves the
    caller's rounds among its own.
    """
    base = options.surface
    if options.effort == "fast":
        return [Candidate("as set", _with(base, guards=0))]
    finished = base.fairness + _FINISHING
    from_afar = {"reverse": base.reverse * 10 / 3, "reach": 100.0, "reverse_from": 0}
    smoothing = _SMOOTHING + finished
    unfolding = _UNFOLDING + smoothing
    stiff = _after(base, len(_UNFOLDING + _SMOOTHING), unfolding, **from_afar)
    return [
        Candidate("smoothing", _after(base, len(_SMOOTHING), smoothing, **from_afar)),
        Candidate("pulling", _with(base, fairness=finished, **from_afar)),
        Candidate("mending", stiff, holding=True),
        Candidate("stretching", stiff, stretched=True),
    ]


def _after(
    base: SurfaceOptions, rounds: int, fairness: tuple[float, ...], **changes: object
) -> SurfaceOptions:
    """Begin with rounds of stronger smoothing."""
    return _with(
        base,
        fairness=fairness,
        fairness_knee=fairness[0],
        faces_from=base.faces_from + rounds,
        **changes,
    )


def _with(base: SurfaceOptions, **changes: object) -> SurfaceOptions:
    # Not validated again: the caller's schedule may already be as long as one may be.
    return base.model_copy(update=changes)
