"""Which of a file's scenes is read, and which of its levels of detail."""

from __future__ import annotations

from meshcone.assets.gltf.element import Element
from meshcone.assets.gltf.extensions import LEVELS, extension_of
from meshcone.assets.policy import ALL_SCENES, ReadPolicy
from meshcone.errors import InputError

_LISTED = 8


def roots_of(root: Element, children: list[list[int]], policy: ReadPolicy) -> list[int]:
    """The root nodes of the scene that is read, or of all.

    Without a default scene the first is taken, and without any scene all root nodes.

    Args:
        root: the document.
        children: of each node.
        policy: which scene is asked for.

    Raises:
        InputError: there is no such scene, or the nodes form a cycle.
    """
    scenes = root.children("scenes")
    chosen = _chosen(root, scenes, policy)
    if chosen:
        found = (scenes[each].references("nodes", len(children), "node") for each in chosen)
        return list(dict.fromkeys(node for nodes in found for node in nodes))
    has_parent = {child for family in children for child in family}
    roots = [node for node in range(len(children)) if node not in has_parent]
    if children and not roots:
        raise InputError("every node has a parent: the nodes form a cycle", place="/nodes")
    return roots


def scenes_left(root: Element, policy: ReadPolicy) -> list[int]:
    """Scenes that are not read, and have nodes that are in none that is, if none was asked for."""
    scenes = root.children("scenes")
    if policy.scene is not None or len(scenes) < 2:
        return []
    count = len(root.children("nodes"))
    nodes = [set(scene.references("nodes", count, "node")) for scene in scenes]
    shown = set().union(*(nodes[each] for each in _chosen(root, scenes, policy)))
    return [index for index, own in enumerate(nodes) if own - shown]


def _chosen(root: Element, scenes: list[Element], policy: ReadPolicy) -> list[int]:
    wanted = policy.scene
    if wanted == ALL_SCENES:
        return list(range(len(scenes)))
    if wanted is not None:
        names = [scene.value.get("name") for scene in scenes]
        found = [i for i, name in enumerate(names) if wanted in (i, name)]
        if len(found) == 1:
            return found
        if "scene" not in policy.inherited:
            raise _not_one(wanted, len(found), names)
    if not scenes:
        return []
    return [root.reference("scene", len(scenes), "scene") or 0]


def _not_one(wanted: int | str, found: int, names: list[object]) -> InputError:
    called = f"number {wanted}" if isinstance(wanted, int) else f"'{wanted[:60]}'"
    if found:
        return InputError(f"option 'scene': {found} scenes are {called}; choose by number, from 0")
    shown = [f"{number}: {str(name or '')[:60]!r}" for number, name in enumerate(names[:_LISTED])]
    more = len(names) - len(shown)
    have = f"it has {', '.join(shown)}{f' and {more:,} more' if more else ''}"
    return InputError(
        f"option 'scene': the file has no scene {called}; {have if names else 'it has none'}"
    )


def levels_of(nodes: list[Element]) -> dict[int, list[int]]:
    """Nodes that take another's place where it is far away (MSFT_lod), the nearest first."""
    found: dict[int, list[int]] = {}
    for index, node in enumerate(nodes):
        extension = extension_of(node, LEVELS)
        if extension is not None:
            ids = extension.references("ids", len(nodes), "node")
            found[index] = [each for each in ids if each != index]
    return found


def replacements(levels: dict[int, list[int]], level: int) -> dict[int, int]:
    """The node that stands for each that has levels; the coarsest where it has fewer.

    Raises:
        InputError: no node has as many levels.
    """
    if level == 0:
        return {}
    most = max(map(len, levels.values()), default=0)
    if level > most:
        have = f"levels 0 to {most}" if most else "one level alone"
        raise InputError(f"option 'lod': no node has a level {level}; the file has {have}")
    return {node: ids[min(level, len(ids)) - 1] for node, ids in levels.items() if ids}
