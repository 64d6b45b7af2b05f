"""One mesh in every form that the library takes."""

from __future__ import annotations

from typing import Any

import trimesh

import meshcone
from tests import shapes

VERTICES, FACES = shapes.sphere(2)
ROUGH = shapes.noisy(VERTICES)


def rough() -> trimesh.Trimesh:
    return trimesh.Trimesh(ROUGH.copy(), FACES.copy(), process=False)


def smooth() -> trimesh.Trimesh:
    return trimesh.Trimesh(VERTICES.copy(), FACES.copy(), process=False)


def refined(**options: Any) -> meshcone.Refined:
    """A result of little work."""
    return meshcone.refine((ROUGH, FACES), (VERTICES, FACES), effort="fast", **options)
