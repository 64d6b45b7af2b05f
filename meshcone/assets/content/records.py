"""What a file holds: nodes, meshes, materials, images, skins and animations.

The words are glTF's (glTF 2.0, section 3). An OBJ's objects are its nodes and meshes, what of
an object has one material is a primitive, and its material library gives the materials.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import islice
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.content.faults import Fault

_PATH_LEVELS = 64

AlphaMode = Literal["OPAQUE", "MASK", "BLEND"]
Wrap = Literal["repeat", "mirror", "clamp"]


@dataclass(frozen=True)
class Image:
    """A picture as the file holds or names it.

    Attributes:
        name: the file's name, or the name the document gives it; empty if it has neither.
        place: how messages call it.
        data: its bytes; None where they were not sent or cannot be had.
        media_type: as declared.
        embedded: whether the bytes are within the asset's own file or buffers.
    """

    name: str
    place: str
    data: bytes | None
    media_type: str | None = None
    embedded: bool = False


@dataclass(frozen=True)
class TextureUse:
    """A texture bound to a material: an image, and how it is read.

    Attributes:
        slot: what it is for, such as ``base_color``; ``EXTENSION.member`` for those of
            extensions.
        image: index into the images; None where the texture names none that is known.
        uv_set: the set of texture coordinates it is read through.
        wrap: beyond 0 and 1, along u and v.
        nearest: whether it is magnified without interpolation.
        offset, rotation, scale: KHR_texture_transform, radians.
        strength: the scale of a normal map or the strength of occlusion; else 1.
        others: further images it names for those who can read them: extension and index.
    """

    slot: str
    image: int | None
    uv_set: int = 0
    wrap: tuple[Wrap, Wrap] = ("repeat", "repeat")
    nearest: bool = False
    offset: tuple[float, float] = (0.0, 0.0)
    rotation: float = 0.0
    scale: tuple[float, float] = (1.0, 1.0)
    strength: float = 1.0
    others: tuple[tuple[str, int], ...] = ()


@dataclass(frozen=True)
class Material:
    """A material.

    Attributes:
        name: empty if it has none.
        base_color: linear RGBA.
        emissive: linear RGB.
        textures: those bound to it, in the order of the file.
        extensions: names of the extensions it uses.
        parameters: what is said besides, of extensions ``EXTENSION member`` and value.
        defined: whether the file, or a library sent with it, says what it looks like.
    """

    name: str
    base_color: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    metallic: float = 1.0
    roughness: float = 1.0
    emissive: tuple[float, float, float] = (0.0, 0.0, 0.0)
    alpha_mode: AlphaMode = "OPAQUE"
    alpha_cutoff: float = 0.5
    double_sided: bool = False
    textures: tuple[TextureUse, ...] = ()
    extensions: tuple[str, ...] = ()
    parameters: tuple[tuple[str, str], ...] = ()
    defined: bool = True

    def texture(self, slot: str) -> TextureUse | None:
        """The texture bound to a slot."""
        return next((use for use in self.textures if use.slot == slot), None)


@dataclass(frozen=True)
class Node:
    """A node of the tree.

    Attributes:
        name: empty if it has none.
        parent: index of the node above it; None at a root and outside of all scenes.
        depth: levels down to it, 1 at a root; 0 if no scene reaches it.
        matrix: (4, 4) from the node to its parent, column vectors.
        mesh, skin, camera, light: indices of what is at it.
        hidden: whether it is switched off, by itself.
        extensions: names of the extensions that say more of it.
        extras: whether it carries data of the author's own.
    """

    name: str
    parent: int | None
    depth: int
    matrix: NDArray[np.float64]
    mesh: int | None = None
    skin: int | None = None
    camera: int | None = None
    light: int | None = None
    hidden: bool = False
    extensions: tuple[str, ...] = ()
    extras: str | None = None


@dataclass(frozen=True)
class Primitive:
    """A run of elements with one material.

    Attributes:
        material: index of it; None for the default.
        mode: what it draws, such as ``triangles``.
        vertices: how many the file stores for it.
        attributes: their names, in glTF's words (``TEXCOORD_0``).
        targets: how many morph targets it has.
        gpu_bytes: of attributes and indices as stored, without morph targets, by a number that
            those have in common which are the same for several primitives; -1 for its own.
        variants: what it has in the file's variants: the variant's name and a material's index.
        undefined: whether it names a material that the file does not have.
    """

    material: int | None
    mode: str
    vertices: int
    attributes: tuple[str, ...]
    targets: int = 0
    gpu_bytes: Mapping[int, int] = field(default_factory=dict)
    variants: tuple[tuple[str, int], ...] = ()
    undefined: bool = False


@dataclass(frozen=True)
class Mesh:
    """A mesh; ``target_names`` as far as the file has them."""

    name: str
    primitives: tuple[Primitive, ...]
    target_names: tuple[str, ...] = ()


@dataclass(frozen=True)
class Skin:
    """A skin: nodes that move vertices."""

    name: str
    joints: tuple[int, ...]


@dataclass(frozen=True)
class Channel:
    """What an animation moves.

    Attributes:
        node: index of the node; None where the target is none that is known.
        path: what of it: translation, rotation, scale, weights or pointer.
        keys: how many.
        first, last: seconds.
        finite: whether every time and value is a number.
        track: (s, c) its values, evenly from first to last; None where they are none that fit
            the keys.
    """

    node: int | None
    path: str
    interpolation: str
    keys: int
    first: float
    last: float
    finite: bool
    track: NDArray[np.float64] | None = None


@dataclass(frozen=True)
class Animation:
    """A named set of channels."""

    name: str
    channels: tuple[Channel, ...]

    @property
    def duration(self) -> float:
        """Seconds to the last key of any channel."""
        return max((channel.last for channel in self.channels), default=0.0)


@dataclass(frozen=True)
class Fitting:
    """A camera or a light: its name, empty if it has none, and what is said of it."""

    name: str
    parameters: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Attribute:
    """Values at the corners of a draw's triangles.

    Attributes:
        name: in glTF's words.
        corners: (k, 3) row of the values at each corner; -1 where there is none.
        read: gives the (r, c) values of r rows, normalised integers as the numbers they
            stand for.
        step: distance of neighbouring values, where they are stored as integers; else 0.
        stored: gives them as the file states them, where that is not what they stand for.
    """

    name: str
    corners: NDArray[np.int64]
    read: Callable[[NDArray[np.int64]], NDArray[np.float64]]
    step: float = 0.0
    stored: Callable[[NDArray[np.int64]], NDArray[np.float64]] | None = None

    def at_corners(self, *, as_stored: bool = False) -> NDArray[np.float64]:
        """(k, 3, c) values; NaN where a corner has none."""
        rows = self.corners.ravel()
        read = self.stored if as_stored and self.stored is not None else self.read
        values = read(np.maximum(rows, 0))
        values[rows < 0] = np.nan
        return values.reshape(*self.corners.shape, -1)


@dataclass(frozen=True)
class Draw:
    """Triangles that are drawn together: a primitive at a node.

    Attributes:
        node: index of the node; None in formats without any.
        mesh, primitive: which of them.
        material: index of it; None for the default.
        rows: the triangles, as rows of those the asset lists.
        attributes: what its corners have besides positions, by name.
        matrix: (4, 4) from the mesh to world, column vectors.
        others: what they have besides that no viewer knows at rest: attributes of an
            application's own by name, and what morph targets add by :func:`target_called`.
        mirrored: whether the node turns them around, so that they run the other way than stored.
    """

    node: int | None
    mesh: int
    primitive: int
    material: int | None
    rows: NDArray[np.int64]
    attributes: Mapping[str, Attribute] = field(default_factory=dict)
    matrix: NDArray[np.float64] = field(default_factory=lambda: np.eye(4))
    others: Mapping[str, Attribute] = field(default_factory=dict)
    mirrored: bool = False


def target_called(number: int, attribute: str = "POSITION") -> str:
    """What a morph target is called among others of a draw: one name for each thing it adds to."""
    return f"target {number}" + ("" if attribute == "POSITION" else f" {attribute}")


@dataclass(frozen=True)
class Content:
    """All of a file.

    Attributes:
        nodes: of all scenes and of none.
        draws: what the default scene draws with triangles; their rows make up the asset's.
        other_draws: points and lines it draws.
        textures: how many the file lists.
        cameras, lights: in the order of the file.
        scenes: their names.
        extensions_used, extensions_required: as listed.
        buffer_bytes: bytes of all buffers, images in them included.
        extras: places of data of the author's own, and the SHA-256 of each; names of groups.
        variants: names of the variants of materials (KHR_materials_variants).
        libraries: material libraries that an OBJ names, and whether each was sent.
        faults: what was malformed and read as if it were not there.
        stored: (r,) which vertex of the file each raw vertex of the asset is, where nodes may
            place one several times; None where each is one of its own.
    """

    nodes: tuple[Node, ...] = ()
    meshes: tuple[Mesh, ...] = ()
    draws: tuple[Draw, ...] = ()
    other_draws: int = 0
    materials: tuple[Material, ...] = ()
    images: tuple[Image, ...] = ()
    textures: int = 0
    skins: tuple[Skin, ...] = ()
    animations: tuple[Animation, ...] = ()
    cameras: tuple[Fitting, ...] = ()
    lights: tuple[Fitting, ...] = ()
    scenes: tuple[str, ...] = ()
    extensions_used: tuple[str, ...] = ()
    extensions_required: tuple[str, ...] = ()
    buffer_bytes: int = 0
    extras: Mapping[str, str] = field(default_factory=dict)
    variants: tuple[str, ...] = ()
    libraries: Mapping[str, bool] = field(default_factory=dict)
    faults: tuple[Fault, ...] = ()
    stored: NDArray[np.int64] | None = None

    def path(self, node: int) -> str:
        """A node's name after those of up to 63 nodes above it; a number where it has none."""
        labels = [self.label(each) for each in islice(self._upwards(node), _PATH_LEVELS)]
        # All paths of a long chain would fill memory.
        above = ["…"] if self.nodes[node].depth > _PATH_LEVELS else []
        return "/".join(reversed([*labels, *above]))

    def label(self, node: int) -> str:
        """A node's name, or its number."""
        return self.nodes[node].name or f"#{node}"

    def _upwards(self, node: int) -> Iterator[int]:
        here: int | None = node
        while here is not None:
            yield here
            here = self.nodes[here].parent
