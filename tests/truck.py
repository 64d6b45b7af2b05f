"""A truck of five bodies: what an artist would call its parts."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
import trimesh

from meshcone.surface import Mesh

WHEELS = {
    "wheel_front_left": (1.2, 0.9),
    "wheel_front_right": (1.2, -0.9),
    "wheel_back_left": (-1.2, 0.9),
    "wheel_back_right": (-1.2, -0.9),
}


def truck_mesh(name: str) -> Mesh:
    """One of its bodies: ``body``, or a wheel, in model units."""
    if name == "body":
        made = trimesh.creation.box((4, 1.4, 1))
    else:
        made = trimesh.creation.cylinder(0.4, 0.3, sections=24)
        made.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0]))
        made.apply_translation([*WHEELS[name], -0.5])
    return Mesh(np.asarray(made.vertices, dtype=float), np.asarray(made.faces, dtype=np.int64))


def truck_obj(
    without: Iterable[str] = (), instead: Mapping[str, np.ndarray] | None = None
) -> bytes:
    """All of it as an OBJ, an object for each body.

    Args:
        without: names of those to leave out.
        instead: other vertices of some.
    """
    lines, count = [], 0
    for name in ("body", *WHEELS):
        if name in without:
            continue
        mesh = truck_mesh(name)
        vertices = (instead or {}).get(name, mesh.vertices)
        lines += [f"o {name}", *("v {:.9g} {:.9g} {:.9g}".format(*each) for each in vertices)]
        lines += ["f {} {} {}".format(*each) for each in mesh.faces + count + 1]
        count += len(vertices)
    return "\n".join([*lines, ""]).encode()
