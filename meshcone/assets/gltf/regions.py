"""Which node and material each triangle of a scene belongs to."""

from __future__ import annotations

import numpy as np

from meshcone.assets.gltf.element import Element
from meshcone.assets.gltf.scene import Scene
from meshcone.assets.regions import Regions, combine_parts


def scene_regions(root: Element, scene: Scene) -> Regions:
    """Label triangles by the node that places them and the material they are drawn with.

    Primitives of a mesh with the same material are one region: exporters split them where
    an index would not fit into 16 bits.
    """
    nodes, materials = root.children("nodes"), root.children("materials")
    node_names = [_name(nodes, index, "node") for index in range(len(nodes))]
    # A material that is not listed is drawn with the default one (section 3.9.6).
    material_names = ["", *(_name(materials, i, "material") for i in range(len(materials)))]
    pairs = np.zeros((len(scene.primitives), 2), dtype=np.int64)
    for row, placed in enumerate(scene.primitives):
        material = placed.primitive.material
        pairs[row, 0] = scene.blocks[placed.block].placement.node
        if material is not None and material < len(materials):
            pairs[row, 1] = material + 1
    counts = [len(placed.triangles) for placed in scene.primitives]
    return combine_parts([node_names, material_names], np.repeat(pairs, counts, axis=0))


def _name(elements: list[Element], index: int, kind: str) -> str:
    name = elements[index].value.get("name")
    return name if isinstance(name, str) and name else f"{kind} {index}"
