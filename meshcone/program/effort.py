"""Which settings of the surface program are tried.

No single setting serves every mesh: dense noisy ones need strong smoothing first, which
melts coarse ones; thin parts need strong samples that reach far. ``best`` runs a few
and keeps the one closest to the reference; figures in ``docs/performance.md``.
"""

from __future__ import annotations

from dataclasses import dataclass

from meshcone.options import Options, SurfaceOptions

_UNFOLDING = (30.0, 10.0)
_FINISHING = (0.01, 0.003)


@dataclass(frozen=True)
class Candidate:
    """A named variation of the caller's settings."""

    name: str
    options: SurfaceOptions


def candidates(options: Options) -> list[Candidate]:
    """List the variations to try, the most often best first.

    The caller's schedule is extended, never replaced: each variation solves the
    caller's rounds among its own.
    """
    base = options.surface
    if options.effort == "fast":
        return [Candidate("as set", base)]
    finished = base.fairness + _FINISHING
    from_afar = {"reverse": base.reverse * 10 / 3, "reach": 100.0, "reverse_from": 0}
    return [
        Candidate("unfolding", _with(base, fairness=_UNFOLDING + finished)),
        Candidate(
            "smoothing",
            _with(
                base,
                fairness=_UNFOLDING + finished,
                fairness_knee=_UNFOLDING[0],
                **from_afar,
            ),
        ),
        Candidate("pulling", _with(base, fairness=finished, **from_afar)),
    ]


def _with(base: SurfaceOptions, **changes: object) -> SurfaceOptions:
    # Not validated again: the caller's schedule may already be as long as one may be.
    return base.model_copy(update=changes)
