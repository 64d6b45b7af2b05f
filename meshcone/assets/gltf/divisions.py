"""How a scene is divided into nodes, meshes and materials."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.divisions import Division
from meshcone.assets.gltf.element import Element
from meshcone.assets.gltf.scene import Scene


def scene_divisions(root: Element, scene: Scene, kept: NDArray[np.int64]) -> dict[str, Division]:
    """The divisions of a scene's faces.

    Args:
        root: the document.
        scene: its default scene.
        kept: (m,) the triangle of the scene each face is.
    """
    placements = [scene.blocks[placed.block].placement for placed in scene.primitives]
    counts = [len(placed.triangles) for placed in scene.primitives]
    nodes = [tuple(placement.path()) for placement in placements]
    meshes: list[tuple[int, ...]] = [(placement.mesh,) for placement in placements]
    materials: list[tuple[int, ...]] = [
        () if placed.primitive.material is None else (placed.primitive.material,)
        for placed in scene.primitives
    ]
    return {
        "nodes": _division(root.children("nodes"), nodes, counts, kept),
        "meshes": _division(root.children("meshes"), meshes, counts, kept),
        "materials": _division(root.children("materials"), materials, counts, kept),
    }


def _division(
    elements: list[Element],
    of_primitive: list[tuple[int, ...]],
    counts: list[int],
    kept: NDArray[np.int64],
) -> Division:
    numbers: dict[tuple[int, ...], int] = {}
    labels = [numbers.setdefault(part, len(numbers)) for part in of_primitive]
    used = sorted({element for part in numbers for element in part})
    names = {index: _name(elements, index) for index in used}
    return Division(
        names, tuple(numbers), np.repeat(np.array(labels, dtype=np.int64), counts)[kept]
    )


def _name(elements: list[Element], index: int) -> str:
    # Of a material that is not listed, the index is all there is.
    name = elements[index].value.get("name") if index < len(elements) else None
    return name if isinstance(name, str) else ""
