"""The things of a file by name, each as the properties that two files are compared by."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from meshcone.assets import Asset
from meshcone.assets.content import (
    Animation,
    Channel,
    Content,
    Fitting,
    Material,
    Mesh,
    TextureUse,
    target_called,
)
from meshcone.auditing.bindings import Binding, bindings
from meshcone.auditing.fields import Fields
from meshcone.auditing.hanging import reached
from meshcone.auditing.layout import Laid, layouts
from meshcone.auditing.naming import unique, unique_labels
from meshcone.auditing.parts import DEFAULT, Parts
from meshcone.auditing.tracks import Track
from meshcone.auditing.variants import variants_of

_PLACED_ALIKE = 1e-6  # of a matrix's largest entry
# Of the diagonal of what a node draws: more than quantising to 12 bits moves any corner.
_DRAWN_ALIKE = 5e-4
_ROUNDING = 5  # decimals that exporters keep of a factor


@dataclass(frozen=True)
class Fact:
    """One thing's properties: their values in words, by name."""

    properties: Mapping[str, str]

    @cached_property
    def identity(self) -> str:
        """The same for things with the same properties."""
        return json.dumps(self.properties, sort_keys=True)

    def differences(self, other: Fact) -> Iterator[tuple[str, str, str]]:
        """Properties that differ: what, here and there."""
        for name in dict.fromkeys([*self.properties, *other.properties]):
            here = self.properties.get(name, "none")
            there = other.properties.get(name, "none")
            if here != there:
                yield name, here, there


@dataclass(frozen=True)
class Placed:
    """Where a node is, relative to the one above it.

    Attributes:
        matrix: (4, 4) from the node to its parent, column vectors.
        box: (2, 3) least and largest coordinates of what it draws, in the world; None where it
            draws nothing.
    """

    matrix: NDArray[np.float64]
    box: NDArray[np.float64] | None = None

    def is_at(self, other: Placed) -> bool:
        """Whether both are at the same place, but for rounding.

        Quantised positions (KHR_mesh_quantization) are stored in units of their own, which the
        node's matrix undoes: what is drawn has to be where it was, not the matrix.
        """
        near = _PLACED_ALIKE * max(1.0, float(np.abs(self.matrix).max()))
        if bool((np.abs(self.matrix - other.matrix) <= near).all()):
            return True
        return self._is_only_in_other_units(other) and self._draws_at(other)

    def _is_only_in_other_units(self, other: Placed) -> bool:
        axes, sizes = _axes_and_sizes(self.matrix)
        other_axes, other_sizes = _axes_and_sizes(other.matrix)
        if np.allclose(sizes, other_sizes, rtol=_PLACED_ALIKE, atol=0.0):
            return False  # moved or turned, by however little
        return bool((np.abs(axes - other_axes) <= _PLACED_ALIKE).all())

    def _draws_at(self, other: Placed) -> bool:
        if self.box is None or other.box is None:
            return False
        near = _DRAWN_ALIKE * float(np.linalg.norm(self.box[1] - self.box[0]))
        return bool((np.abs(self.box - other.box) <= near).all())

    def words(self) -> str:
        """The place, and the scale along each axis."""
        x, y, z = self.matrix[:3, 3]
        scale = np.linalg.norm(self.matrix[:3, :3], axis=0)
        across = " by ".join(f"{value:.4g}" for value in scale)
        return f"at ({x:.4g}, {y:.4g}, {z:.4g}), scaled {across}"


def named(names: Iterable[str]) -> dict[str, str]:
    """Names by a key that is theirs alone: the second of a name is another thing."""
    return {key: key for key in unique(list(names))}


def nodes(asset: Asset, content: Content) -> dict[str, Placed]:
    """Nodes that a scene reaches, by their paths."""
    numbers = reached(content)
    keys = unique([content.path(number) for number in numbers])
    boxes = _boxes(asset, content)
    places = (Placed(content.nodes[number].matrix, boxes.get(number)) for number in numbers)
    return dict(zip(keys, places, strict=True))


def _boxes(asset: Asset, content: Content) -> dict[int, NDArray[np.float64]]:
    """The (2, 3) box of what each node draws, in the world, by the node's index."""
    nodes_of_rows = np.full(len(asset.triangles), -1)
    for draw in content.draws:
        if draw.node is not None:
            nodes_of_rows[draw.rows] = draw.node
    of_faces = nodes_of_rows[asset.kept]
    order = np.argsort(of_faces, kind="stable")
    order = order[of_faces[order] >= 0]
    if not len(order):
        return {}
    numbers, starts = np.unique(of_faces[order], return_index=True)
    corners = asset.vertices[asset.faces[order]]
    least = np.minimum.reduceat(corners.min(axis=1), starts)
    largest = np.maximum.reduceat(corners.max(axis=1), starts)
    return dict(zip(numbers.tolist(), np.stack([least, largest], axis=1), strict=True))


def _axes_and_sizes(
    matrix: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The (3, 3) directions of a (4, 4) matrix's axes, as columns, and their (3,) lengths."""
    sizes = np.linalg.norm(matrix[:3, :3], axis=0)
    return matrix[:3, :3] / np.where(sizes > 0, sizes, 1.0), sizes


def meshes(content: Content) -> dict[str, Fact]:
    """Meshes, with the materials they are drawn with."""
    facts = []
    called = unique([each.name for each in content.materials])
    for mesh in content.meshes:
        numbers = {primitive.material for primitive in mesh.primitives}
        used = {DEFAULT if number is None else called[number] for number in numbers}
        varied = variants_of(mesh, called, DEFAULT)
        facts.append(Fact({"materials": ", ".join(sorted(used)), **_undrawn(mesh), **varied}))
    return dict(zip(unique([mesh.name for mesh in content.meshes]), facts, strict=True))


def _undrawn(mesh: Mesh) -> dict[str, str]:
    """What of a mesh is not of its surface."""
    modes = sorted({each.mode.split()[0].rstrip("s") for each in mesh.primitives})
    return {f"{mode}s": "some" for mode in modes if mode in ("point", "line")}


def materials(content: Content) -> dict[str, Fact]:
    """Materials, with their factors and the content of the images bound to them."""
    digests = [_digest(image.data) for image in content.images]
    facts = [_material(material, digests) for material in content.materials]
    return dict(zip(unique([each.name for each in content.materials]), facts, strict=True))


def images(content: Content) -> dict[str, str]:
    """Images by their content, or by name where that is not known."""
    found = {}
    for image in content.images:
        key = f"content {_digest(image.data)}" if image.data is not None else image.name
        found[key] = image.name or image.place
    return found


def attributes(content: Content, prefix: str | None) -> dict[str, tuple[str, str]]:
    """Attributes that some primitive of a mesh has: ``mesh: NAME``, each as mesh and name.

    Args:
        content: of a file.
        prefix: of the attributes; None for all but coordinates and colours.
    """
    keys = unique([mesh.name for mesh in content.meshes])
    others = ("POSITION", "TEXCOORD_", "COLOR_")
    return {
        f"{key}: {name}": (key, name)
        for key, mesh in zip(keys, content.meshes, strict=True)
        for primitive in mesh.primitives
        for name in primitive.attributes
        if (name.startswith(prefix) if prefix else not name.startswith(others))
    }


def parts(asset: Asset, content: Content, moved: NDArray[np.float64] | None = None) -> Parts:
    """Where each mesh has its materials and attributes; see :class:`Parts`."""
    called = unique([each.name for each in content.materials])
    return Parts(asset, content, unique([mesh.name for mesh in content.meshes]), called, moved)


def fields(asset: Asset, content: Content, moved: NDArray[np.float64] | None = None) -> Fields:
    """What each mesh has at its vertices; see :class:`Fields`."""
    return Fields(asset, content, unique([mesh.name for mesh in content.meshes]), moved)


def uv_layouts(content: Content) -> dict[str, Laid]:
    """Where the sets of texture coordinates lie: ``mesh: NAME``."""
    return layouts(content, unique([mesh.name for mesh in content.meshes]))


def targets(content: Content) -> dict[str, tuple[str, str]]:
    """Morph targets: ``mesh: NAME``, or the target's number; each as mesh and number."""
    found = {}
    for key, mesh in zip(unique([m.name for m in content.meshes]), content.meshes, strict=True):
        count = max((primitive.targets for primitive in mesh.primitives), default=0)
        for number in range(count):
            known = number < len(mesh.target_names)
            name = mesh.target_names[number] if known else target_called(number)
            found[f"{key}: {name}"] = (key, target_called(number))
    return found


def skins(content: Content) -> dict[str, Fact]:
    """Skins, with the names of their joints."""
    labels = unique_labels(content)
    facts = [
        Fact({"joints": ", ".join(labels[joint] for joint in skin.joints)})
        for skin in content.skins
    ]
    return dict(zip(unique([skin.name for skin in content.skins]), facts, strict=True))


def animations(content: Content) -> dict[str, Fact]:
    """Animations, with their channels."""
    labels = unique_labels(content)
    facts = [_animation(each, labels) for each in content.animations]
    return dict(zip(unique([each.name for each in content.animations]), facts, strict=True))


def fittings(found: Sequence[Fitting]) -> dict[str, Fact]:
    """Cameras or lights, with their properties."""
    facts = [Fact(each.parameters) for each in found]
    return dict(zip(unique([each.name for each in found]), facts, strict=True))


def tracks(content: Content) -> dict[str, Track]:
    """What each channel of each animation does: ``animation: node path``.

    Channels that are no numbers are counted in :func:`animations`.
    """
    labels = unique_labels(content)
    found = {}
    animated = unique([each.name for each in content.animations])
    for key, animation in zip(animated, content.animations, strict=True):
        called = unique([_target(channel, labels) for channel in animation.channels])
        for name, channel in zip(called, animation.channels, strict=True):
            if channel.finite:
                found[f"{key}: {name}"] = Track.of(channel)
    return found


def followers(asset: Asset, content: Content) -> dict[str, Binding]:
    """Which part of each mesh follows each joint: ``mesh: joint``."""
    return bindings(asset, content, unique([mesh.name for mesh in content.meshes]))


def _target(channel: Channel, labels: Sequence[str]) -> str:
    return f"{labels[channel.node] if channel.node is not None else '-'} {channel.path}"


def _material(material: Material, digests: Sequence[str]) -> Fact:
    properties = {
        "base colour": _numbers(material.base_color),
        "metallic factor": _numbers([material.metallic]),
        "roughness": _numbers([material.roughness]),
        "emission": _numbers(material.emissive),
        "alpha mode": material.alpha_mode,
        "double-sidedness": "yes" if material.double_sided else "no",
        "extensions": ", ".join(material.extensions) or "none",
        **dict(material.parameters),
        "definition": "yes" if material.defined else "no",
    }
    if material.alpha_mode == "MASK":
        properties["alpha mode"] += f" at {_numbers([material.alpha_cutoff])}"
    for use in material.textures:
        properties[f"{use.slot.replace('_', ' ')} texture"] = _use(use, digests)
    return Fact(properties)


def _use(use: TextureUse, digests: Sequence[str]) -> str:
    image = "no image" if use.image is None else f"image {digests[use.image]}"
    others = [f"{name} image {digests[number]}" for name, number in use.others]
    told = [image, *others, f"set {use.uv_set}", f"wrap {'/'.join(use.wrap)}"]
    if (use.offset, use.rotation, use.scale) != ((0.0, 0.0), 0.0, (1.0, 1.0)):
        told.append(f"transform {_numbers([*use.offset, use.rotation, *use.scale])}")
    if use.nearest:
        told.append("not interpolated")
    if use.strength != 1.0:
        told.append(f"strength {_numbers([use.strength])}")
    return ", ".join(told)


def _animation(animation: Animation, labels: Sequence[str]) -> Fact:
    channels = sorted(_target(each, labels) for each in animation.channels)
    broken = sum(not each.finite for each in animation.channels)
    return Fact(
        {
            "duration": f"{animation.duration:.4g} s",
            "set of channels": ", ".join(channels),
            "number of keys": str(sum(each.keys for each in animation.channels)),
            **({"channels that are no numbers": str(broken)} if broken else {}),
        }
    )


def _numbers(values: Iterable[float]) -> str:
    return " ".join(f"{round(value, _ROUNDING) + 0.0:g}" for value in values)


def _digest(data: bytes | None) -> str:
    return "not sent" if data is None else hashlib.sha256(data).hexdigest()[:12]
