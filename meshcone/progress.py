"""How far a refinement has come."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

Stage = Literal["read", "solve", "quality", "write"]


@dataclass(frozen=True)
class Progress:
    """A moment of a running refinement.

    Attributes:
        stage: what is being done.
        round: rounds of the program solved so far.
        rounds: rounds in all.
        fraction: estimated share of the whole work that is done, 0 to 1.
    """

    stage: Stage
    round: int
    rounds: int
    fraction: float


ProgressCallback = Callable[[Progress], None]
