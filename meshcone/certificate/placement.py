"""Whether a certificate's alignment is a motion the search for one could have given."""

from __future__ import annotations

import numpy as np

from meshcone.certificate.checks import Check
from meshcone.errors import InputError
from meshcone.options import Options
from meshcone.pair import Pair
from meshcone.report.report import AlignmentRecord
from meshcone.surface import Frame
from meshcone.surface.alignment import Alignment, distances_under
from meshcone.surface.similarity import is_similarity, scale_of

# A source that the motion makes this many times larger or smaller than the reference was not
# fitted to it: what is left of it is within any tolerance.
_LARGEST_RATIO = 20.0
# Samples differ a little where another machine finds other principal axes.
_AGREEMENT = 0.05
_ROUNDING = 1e-7


def place(pair: Pair, options: Options, stated: AlignmentRecord | None) -> tuple[Pair, list[Check]]:
    """Move the source as report and certificate say.

    That the motion is the best one is not checked. It has to be of the kind that was asked
    for, has to leave the source about as large as the reference, and the distances the report
    states before and after it have to be those found here.

    Raises:
        InputError: it says so without having been asked to, or by something that is not the
            motion that was asked for.
    """
    if (stated is None) != (options.align == "none"):
        raise InputError("the certificate's alignment is not the one the options ask for")
    if stated is None:
        return pair, []
    matrix = np.array(stated.matrix)
    if not is_similarity(matrix, rigid=options.align == "rigid"):
        raise InputError(f"the certificate's alignment is not {options.align}")
    placed = pair.placed(Alignment(matrix, "none", before=0.0, after=0.0))
    if stated.method == "none" and not np.array_equal(matrix, np.eye(4)):
        raise InputError("the report says that nothing was moved, and states a motion")
    return placed, [_placed(pair, placed, stated, options.seed)]


def _placed(pair: Pair, placed: Pair, stated: AlignmentRecord, seed: int) -> Check:
    ratio = Frame.of(placed.source).radius
    scale = scale_of(np.array(stated.matrix))
    if stated.method != "none" and not 1 / _LARGEST_RATIO <= ratio <= _LARGEST_RATIO:
        words = (
            f"the alignment scales the source by {scale:.2g}, which makes it {ratio:.2g} times as "
            f"large as the reference, allowed {1 / _LARGEST_RATIO:g} to {_LARGEST_RATIO:g}"
        )
        return Check("placed", False, words)
    before, after = distances_under(*pair.in_model_units(), np.array(stated.matrix), seed)
    radius = pair.frame.radius
    for found, told in ((before, stated.before), (after, stated.after)):
        if not abs(found - told) <= _AGREEMENT * found + _ROUNDING * radius:
            words = f"the source is {found:.3g} from the reference where the report says {told:.3g}"
            return Check("placed", False, f"{words}, in model units, as root mean square")
    if not after <= before:
        words = f"the alignment takes the source away from the reference: {before:.3g} to"
        return Check("placed", False, f"{words} {after:.3g} model units")
    return Check(
        "placed",
        True,
        f"the alignment scales by {scale:.3g} and brings the source from {before:.3g} to "
        f"{after:.3g} model units, as stated; that none is better: not checked",
    )
