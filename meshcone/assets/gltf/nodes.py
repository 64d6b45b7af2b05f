"""Where the node tree puts each mesh (glTF 2.0, section 3.5)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.gltf.accessors import Accessors
from meshcone.assets.gltf.choice import levels_of, replacements, roots_of
from meshcone.assets.gltf.element import Element
from meshcone.assets.gltf.extensions import (
    INSTANCING,
    RELATIVE_TO_CENTER,
    VISIBILITY,
    extension_of,
)
from meshcone.assets.gltf.instancing import instances
from meshcone.assets.limits import Limits
from meshcone.assets.policy import ReadPolicy
from meshcone.errors import InputError

_IDENTITY = np.eye(4)
_PLANE = 2

# A node and those above it. Linked, for a list at each node would grow with the tree's depth.
Lineage = tuple[int, "Lineage | None"]


@dataclass(frozen=True)
class Placement:
    """A mesh at a node.

    Attributes:
        node: index of the node.
        mesh: index of the mesh.
        matrix: (4, 4) from mesh to world, column vectors; the identity for a skinned mesh,
            whose node's transform is ignored (section 3.7.3.3).
        mirrored: whether the node's own transform turns the winding around (section 3.7.4).
        skinned: whether the node has a skin.
        lineage: the node and those above it.
        instance: which of the node's instances, if it has any (EXT_mesh_gpu_instancing).
    """

    node: int
    mesh: int
    matrix: NDArray[np.float64]
    mirrored: bool
    skinned: bool
    lineage: Lineage
    instance: int | None = None

    def path(self) -> Iterator[int]:
        """The node, its parent, and so on up to a root."""
        link: Lineage | None = self.lineage
        while link is not None:
            node, link = link
            yield node


@dataclass(frozen=True)
class Placements:
    """What a scene draws, and what in it no viewer shows.

    Attributes:
        shown: meshes, in the order of the tree.
        invisible: nodes with a mesh that are switched off, or below one that is
            (KHR_node_visibility).
        flattened: nodes that scale a mesh to a line or a point.
        levels: nodes with a mesh that is another level of detail than is read (MSFT_lod).
        gathered: nodes with a skin and instances, of which the skin says where they are.
        origin: (3,) where the scene is (CESIUM_RTC).
        worlds: (4, 4) matrix to world space of each node of the scene.
    """

    shown: list[Placement]
    invisible: list[int]
    flattened: list[int]
    levels: list[int]
    gathered: list[int]
    origin: NDArray[np.float64]
    worlds: dict[int, NDArray[np.float64]]

    def add(self, placement: Placement) -> None:
        """Take a mesh as shown, unless there is nothing of it to see."""
        if _rank(placement.matrix) < _PLANE:
            self.flattened.append(placement.node)
        else:
            self.shown.append(placement)


def place_meshes(
    root: Element, accessors: Accessors, limits: Limits, policy: ReadPolicy
) -> Placements:
    """Every mesh of the scene that is read, in the level of detail that is.

    Raises:
        InputError: a node is reached twice, a transform is not a usable affine matrix, or there
            is no such scene or level.
        LimitError: the tree is deeper than ``limits.node_depth``.
    """
    nodes = root.children("nodes")
    meshes = len(root.children("meshes"))
    levels = levels_of(nodes)
    coarser = {each for ids in levels.values() for each in ids}
    instead = replacements(levels, policy.lod)
    # The tree may have them too; they are shown where the node is that they replace.
    replacing = set(instead.values())
    families = (node.references("children", len(nodes), "node") for node in nodes)
    children = [[child for child in family if child not in replacing] for family in families]
    origin = _origin(root)
    placements = Placements([], [], [], [], [], origin[:3, 3], {})
    waiting: list[tuple[int, NDArray[np.float64], int, Lineage | None, list[int] | None]]
    roots = (each for each in roots_of(root, children, policy) if each not in replacing)
    waiting = [(node, origin, 1, None, None) for node in reversed(list(roots))]
    seen: set[int] = set()
    while waiting:
        index, parent, depth, above, hidden = waiting.pop()
        node = nodes[index]
        if index in seen:
            raise InputError(
                f"node {index} is reached twice; nodes must form a tree", place=node.pointer
            )
        seen.add(index)
        limits.check("node_depth", depth, "levels of nodes", place=node.pointer)
        world = _finite(parent, local_matrix(node), node)
        placements.worlds[index] = world
        if is_hidden(node):
            hidden = placements.invisible
        elif index in coarser and index not in replacing:
            hidden = placements.levels
        elif hidden is None and index in instead and index not in replacing:
            hidden = placements.levels
            waiting.append((instead[index], parent, depth, above, None))
        here = (index, above)
        mesh = node.reference("mesh", meshes, "mesh")
        if mesh is not None and hidden is not None:
            hidden.append(index)
        elif mesh is not None:
            if "skin" in node.value and extension_of(node, INSTANCING) is not None:
                placements.gathered.append(index)
            for copy in _copies(node, mesh, world, here, accessors):
                total = len(placements.shown) + 1
                limits.check("meshes", total, "meshes placed", place=node.pointer)
                placements.add(copy)
        below = reversed(children[index])
        waiting += [(child, world, depth + 1, here, hidden) for child in below]
    return placements


def _copies(
    node: Element, mesh: int, world: NDArray[np.float64], lineage: Lineage, accessors: Accessors
) -> Iterator[Placement]:
    """A mesh at a node, or at each of the node's instances."""
    index = lineage[0]
    if "skin" in node.value:
        yield Placement(index, mesh, _IDENTITY, _mirrors(world), True, lineage)
        return
    copies = instances(node, accessors)
    if copies is None:
        yield Placement(index, mesh, world, _mirrors(world), False, lineage)
        return
    for number, members in enumerate(copies):
        matrix = _finite(world, local_matrix(Element(members, node.place("extensions"))), node)
        yield Placement(index, mesh, matrix, _mirrors(matrix), False, lineage, number)


def _finite(
    parent: NDArray[np.float64], local: NDArray[np.float64], node: Element
) -> NDArray[np.float64]:
    """(4, 4) one transform after another.

    Raises:
        InputError: it overflows.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        world: NDArray[np.float64] = parent @ local
    if not np.isfinite(world).all():
        raise InputError("the node's transform overflows", place=node.pointer)
    return world


def _origin(root: Element) -> NDArray[np.float64]:
    """(4, 4) where CESIUM_RTC puts the scene: coordinates are relative to a centre."""
    origin = np.eye(4)
    extension = extension_of(root, RELATIVE_TO_CENTER)
    if extension is not None:
        origin[:3, 3] = extension.numbers("center", 3) or (0.0, 0.0, 0.0)
    return origin


def is_hidden(node: Element) -> bool:
    """Whether a node switches off itself and what is below it (KHR_node_visibility)."""
    extension = extension_of(node, VISIBILITY)
    return extension is not None and "visible" in extension.value and not extension.flag("visible")


def _mirrors(matrix: NDArray[np.float64]) -> bool:
    return bool(np.linalg.slogdet(matrix[:3, :3]).sign < 0)


def _rank(matrix: NDArray[np.float64]) -> int:
    """How many dimensions a (4, 4) affine matrix keeps, to working precision."""
    singular_values = np.linalg.svd(matrix[:3, :3], compute_uv=False)
    return int(np.count_nonzero(singular_values > 1e-12 * singular_values[0]))


def local_matrix(node: Element) -> NDArray[np.float64]:
    """(4, 4) from a node to its parent.

    Raises:
        InputError: it is no usable affine matrix.
    """
    matrix = node.numbers("matrix", 16)
    if matrix is not None:
        columns = np.array(matrix).reshape(4, 4).T
        if not np.allclose(columns[3], (0, 0, 0, 1)):
            raise node.error("matrix", "the last row must be 0 0 0 1")
        columns[3] = (0, 0, 0, 1)
        return columns
    local = np.eye(4)
    local[:3, :3] = _rotation(node) * np.array(node.numbers("scale", 3) or (1.0, 1.0, 1.0))
    local[:3, 3] = node.numbers("translation", 3) or (0.0, 0.0, 0.0)
    return local


def _rotation(node: Element) -> NDArray[np.float64]:
    """(3, 3) rotation by the node's unit quaternion x, y, z, w."""
    quaternion = np.array(node.numbers("rotation", 4) or (0.0, 0.0, 0.0, 1.0))
    length = np.linalg.norm(quaternion)
    if not 0.5 < length < 2.0:
        raise node.error("rotation", f"expected a unit quaternion, found length {length:.3g}")
    x, y, z, w = quaternion / length
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
