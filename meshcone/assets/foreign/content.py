"""What a PLY, STL or OFF file holds besides its surface: one mesh, and what its corners carry."""

from __future__ import annotations

import numpy as np

from meshcone.assets.content import Content, Draw, Mesh, Node, Primitive
from meshcone.assets.foreign.carried import Carried
from meshcone.surface.arrays import Ints

_FLOAT = 4  # bytes
_SHORT_INDICES = 65_535  # vertices that 16 bits can number (glTF 2.0, section 3.7.2.1)


def one_mesh(triangles: Ints, carried: Carried) -> Content:
    """Describe a file that is one mesh without a name.

    Args:
        triangles: (k, 3) its vertices at the corners of triangles.
        carried: what else the corners have.
    """
    vertices = len(np.unique(triangles))
    index_bytes = 2 if vertices <= _SHORT_INDICES else 4
    primitive = Primitive(
        None,
        "triangles",
        vertices,
        ("POSITION", *carried.names),
        gpu_bytes={-1: vertices * _FLOAT * (3 + carried.width) + triangles.size * index_bytes},
    )
    rows = np.arange(len(triangles))
    draw = Draw(0, 0, 0, None, rows, carried.attributes, others=carried.others)
    return Content(
        nodes=(Node("", None, 1, np.eye(4), mesh=0),),
        meshes=(Mesh("", (primitive,)),),
        draws=(draw,),
    )
