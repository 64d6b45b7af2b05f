"""How the faces of an OBJ file are divided into objects, groups and materials.

Source: "Object Files (.obj)", appendix B1: a ``g`` statement may name several groups, and
its elements are in all of them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.divisions import Division
from meshcone.assets.obj.scan import ObjLines
from meshcone.text import words_of


def face_divisions(lines: ObjLines, rows: NDArray[np.int64]) -> dict[str, Division]:
    """The divisions of triangles, by the name of their option.

    Indices count the distinct names of a kind, in the order in which they first appear.

    Args:
        lines: the file.
        rows: (m,) statement of the polygon each triangle is of.
    """
    return {
        "meshes": _division([[name] for name in lines.names(lines.objects)], lines.objects, rows),
        "groups": _division(list(map(words_of, lines.names(lines.groups))), lines.groups, rows),
        "materials": _division(
            [[name] for name in lines.names(lines.materials)], lines.materials, rows
        ),
    }


def _division(
    named: list[list[str]], markers: NDArray[np.int64], rows: NDArray[np.int64]
) -> Division:
    numbers: dict[str, int] = {}
    # Before the first statement of its kind, a face is in no part.
    elements = [(), *(tuple(numbers.setdefault(n, len(numbers)) for n in names) for names in named)]
    parts: dict[tuple[int, ...], int] = {}
    in_force = np.array([parts.setdefault(part, len(parts)) for part in elements])
    names = {index: name for name, index in numbers.items()}
    return Division(names, tuple(parts), in_force[np.searchsorted(markers, rows)])
