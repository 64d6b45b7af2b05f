"""A glTF or GLB file as an asset."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.base import Asset
from meshcone.assets.content import Content
from meshcone.assets.divisions import Division
from meshcone.assets.gltf.accessors import Accessors
from meshcone.assets.gltf.agreement import agreeing_meshes
from meshcone.assets.gltf.buffers import Buffers
from meshcone.assets.gltf.container import split_glb
from meshcone.assets.gltf.content import read_content
from meshcone.assets.gltf.divide import divide_primitives
from meshcone.assets.gltf.divisible import check_vertices
from meshcone.assets.gltf.divisions import scene_divisions
from meshcone.assets.gltf.document import Document
from meshcone.assets.gltf.draco.deflate import POSITION_BITS, check_encodable
from meshcone.assets.gltf.element import Element
from meshcone.assets.gltf.extensions import check_untouched
from meshcone.assets.gltf.instancing import as_nodes, not_as_nodes
from meshcone.assets.gltf.model import Model, write_file
from meshcone.assets.gltf.moving import Moving
from meshcone.assets.gltf.notices import miscounted_notices, storage_notices
from meshcone.assets.gltf.overlaps import unreadable
from meshcone.assets.gltf.ownership import check_ownership
from meshcone.assets.gltf.references import meshes_named
from meshcone.assets.gltf.regions import scene_regions
from meshcone.assets.gltf.room import make_room
from meshcone.assets.gltf.shading import write_shading
from meshcone.assets.gltf.split import split_shared
from meshcone.assets.gltf.twins import divided_alike, twins
from meshcone.assets.gltf.write import BufferEditor
from meshcone.assets.limits import Limits
from meshcone.assets.policy import DracoPolicy, MeshoptPolicy, ReadPolicy, WritePolicy
from meshcone.assets.weld import weld_surface
from meshcone.errors import InputError, InternalError, naming
from meshcone.notices import Code, Notice
from meshcone.surface.subdivision import Subdivision


def read_glb(
    name: str,
    data: bytes,
    resources: Mapping[str, bytes],
    limits: Limits,
    policy: ReadPolicy,
) -> GltfAsset:
    """Read a GLB file. Raises as ``read_gltf`` does."""
    model = Model.read(data, split_glb(data, limits), resources, limits, policy)
    return GltfAsset(name, data, model)


def read_gltf(
    name: str,
    data: bytes,
    resources: Mapping[str, bytes],
    limits: Limits,
    policy: ReadPolicy,
) -> GltfAsset:
    """Read a glTF file whose buffers are data URIs or among ``resources``.

    Raises:
        InputError: with a JSON pointer to what is malformed or not supported.
        LimitError: something is larger or deeper than ``limits`` accept.
    """
    return GltfAsset(name, data, Model.read(data, None, resources, limits, policy))


_LOST = 1e-3  # share of a vertex's skin weights; less is seen in no pose
_COPIED = {
    "nodes": ("node", "nodes"),
    "meshes": ("mesh", "meshes"),
    "accessors": ("accessor", "accessors"),
}
_DRACO_CHANGES: dict[DracoPolicy, str] = {
    "plain": "what is compressed with Draco is written as plain buffers; draco=encode compresses "
    "it again",
    "encode": "what is compressed with Draco is compressed again, positions of a mesh that moved "
    f"in {POSITION_BITS} bits",
}
_MESHOPT_CHANGES: dict[MeshoptPolicy, str] = {
    "plain": "what is compressed with meshopt is written as plain buffers; meshopt=encode "
    "compresses it again",
    "encode": "what is compressed with meshopt and has changed is compressed again, unfiltered",
}


class GltfAsset(Asset):
    """A glTF or GLB file.

    Reading takes every triangle the default scene draws, instances included. Writing moves
    vertices through the inverse of their node's transform, in the type they are stored in,
    and changes no byte besides them, their normals, tangents and declared bounds. A mesh
    that several nodes use can be read, as a reference; to be written it is split first.
    """

    format = "gltf"
    media_type = "model/gltf+json"

    def __init__(self, name: str, data: bytes, model: Model) -> None:
        scene = model.scene
        super().__init__(
            name,
            weld_surface(scene.positions, scene.triangles),
            regions=scene_regions(model.document.root, scene),
            polygons=sum(len(placed.triangles) for placed in scene.primitives),
            meshes=len({(b.placement.node, b.placement.instance) for b in scene.blocks}),
            materials=len({placed.primitive.material for placed in scene.primitives} - {None}),
            warnings=(*miscounted_notices(model.miscounted), *scene.warnings),
        )
        if model.container is not None:
            self.format = "glb"
            self.media_type = "model/gltf-binary"
        self._data = data
        self._model = model

    @cached_property
    def precision_as_listed(self) -> NDArray[np.float64]:
        """See :meth:`Asset.precision_as_listed`: that of stored numbers, as shown."""
        found = np.zeros(len(self.positions))
        for block in self._model.scene.blocks:
            steps = self._model.accessors.steps(block.accessor)
            found[block.rows] = steps * block.pose.scales()
        return found

    def ensure_writable(self, policy: WritePolicy | None = None) -> None:
        """Check that every vertex that may move has, or can get, bytes of its own.

        Raises:
            InputError: naming the mesh, accessor or node that stands in the way.
        """
        policy = policy or WritePolicy()
        with naming(self.name):
            self._writable(policy, self._undecided(policy))

    def _undecided(self, policy: WritePolicy) -> frozenset[int]:
        """Meshes that cannot be split: only those whose places do not agree need to be."""
        if policy.instances != "auto":
            return frozenset()
        placements = [block.placement for block in self._model.scene.blocks]
        placing = {each.node for each in placements if each.instance is not None}
        nodes = not_as_nodes(self._model.document, placing)
        places = {(each.mesh, each.node, each.instance) for each in placements}
        shared = {mesh for mesh, count in Counter(mesh for mesh, *_ in places).items() if count > 1}
        named = meshes_named(self._model.document.root) if shared else []
        return frozenset(
            [each.mesh for each in placements if each.node in nodes]
            + [mesh for mesh in shared if any(naming.may_be(mesh) for naming in named)]
        )

    def changes(self, policy: WritePolicy, written: Asset) -> tuple[Notice, ...]:
        """See :meth:`Asset.changes`."""
        if not isinstance(written, GltfAsset):
            raise TypeError("a glTF is written as a glTF")
        if written._data == self._data:
            return ()
        told = []
        if self._model.compressed:
            told.append(Notice(Code.WRITING_DRACO, _DRACO_CHANGES[policy.draco]))
        if self._model.expanded:
            told.append(Notice(Code.WRITING_MESHOPT, _MESHOPT_CHANGES[policy.meshopt]))
        before, after = self._model.document.root, written._model.document.root
        added = [
            _count(number, *kind)
            for key, kind in _COPIED.items()
            if (number := len(after.children(key)) - len(before.children(key)))
        ]
        if added:
            words = "vertex data that several nodes or meshes share were split; added: "
            *others, last = added
            words += ", ".join(others) + (" and " if others else "") + last
            told.append(Notice(Code.WRITING_SPLIT, words))
        elif _stored_apart(before, after):
            words = "vertex data that shared bytes with other data were stored apart from them"
            told.append(Notice(Code.WRITING_SPLIT, words))
        elif policy.instances == "auto" and self._shared(policy):
            words = "meshes that several nodes share were moved once, for every node agrees"
            told.append(Notice(Code.WRITING_TOGETHER, words))
        return (*told, *storage_notices(before, after))

    def _shared(self, policy: WritePolicy) -> bool:
        """Whether something that may move is used more than once."""
        moving = Moving.of(self._model.scene, self._surface, policy)
        used = [block.accessor.index for block in moving.blocks]
        return len(set(used)) < len(used)

    def _writable(self, policy: WritePolicy, together: frozenset[int] = frozenset()) -> Model:
        """The model to write into: what is shared is split, if the policy says so.

        Args:
            policy: what may change.
            together: meshes that are moved once for all nodes that use them.
        """
        model = self._model
        if policy.draco == "encode" and model.compressed:
            check_encodable(model.compressed.primitives)
        if policy.instances != "refuse":
            moving = Moving.of(model.scene, self._surface, policy, together)
            placements = [block.placement for block in moving.blocks]
            alone = {each.node for each in placements if each.mesh not in together}
            apart = as_nodes(model.document, model.accessors, sorted(alone), model.limits)
            model = self._rebuilt(*apart) if apart else model
            moving = Moving.of(model.scene, self._surface, policy, together)
            split = split_shared(
                model.document, model.accessors, moving, model.limits, self._unreadable
            )
            if split and model.compressed and policy.draco == "encode":
                raise InputError("copies of what is shared cannot be compressed; set draco=plain")
            model = self._rebuilt(*split) if split else model
        moving = Moving.of(model.scene, self._surface, policy, together)
        check_untouched(
            model.document.root,
            model.document.unknown,
            [placed.primitive.element for placed in moving.primitives],
        )
        check_ownership(model.document, model.accessors, moving, self._unreadable)
        return model

    @cached_property
    def _unreadable(self) -> frozenset[str]:
        return unreadable(self._model.document, self._model.accessors)

    def _rebuilt(self, document: Document, buffers: Buffers) -> Model:
        model = self._model.rebuilt(document, buffers)
        if not np.array_equal(model.scene.triangles, self._surface.triangles):
            raise InternalError("copying what is shared has changed the order of the vertices")
        return model

    def _write(self, vertices: NDArray[np.float64], policy: WritePolicy) -> bytes:
        positions, moved = self._scattered(vertices)
        if not moved.any():
            return self._data
        together: frozenset[int] = frozenset()
        if policy.instances == "auto":
            moving = Moving.of(self._model.scene, self._surface, policy)
            together = agreeing_meshes(
                self._model.document, self._model.accessors, moving, positions, moved
            )
        model = self._writable(policy, together)
        roomier = make_room(model, positions, moved)
        model = self._rebuilt(*roomier) if roomier else model
        editor = BufferEditor(model.accessors)
        model.store_positions(editor, positions, moved)
        if policy.normals == "recompute":
            write_shading(editor, model.scene, self._surface, vertices, policy.selected)
        came = model.expanded if policy.meshopt == "encode" else None
        if policy.draco == "encode" and model.compressed:
            return model.compressed.to_bytes(model, editor, came)
        return model.to_bytes(editor, came)

    def ensure_divisible(self, policy: WritePolicy | None = None) -> None:
        """See :meth:`Asset.ensure_divisible`: every glTF can be, unless one of its parts cannot.

        Without a policy nobody knows which parts: what is divided is checked when it is.
        """
        if policy is not None:
            moving = Moving.of(self._model.scene, self._surface, policy)
            with naming(self.name):
                for primitive in moving.selected:
                    check_vertices(primitive, self._model.accessors)
        policy = policy or WritePolicy()
        compressed = {
            "draco": policy.draco == "encode" and self._model.compressed,
            "meshopt": policy.meshopt == "encode" and self._model.expanded,
        }
        for option, what in compressed.items():
            if what:
                raise InputError(
                    f"a file whose faces are divided is not compressed again; set {option}=plain",
                    file=self.name,
                )

    def twins(self) -> NDArray[np.int64]:
        """See :meth:`Asset.twins`: meshes that several nodes use have some."""
        return twins(self._model.scene, self._surface)

    def divided_alike(self, subdivision: Subdivision) -> Subdivision:
        """See :meth:`Asset.divided_alike`."""
        return divided_alike(self._model.scene, self._surface, subdivision)

    def division_notices(self, subdivision: Subdivision) -> tuple[Notice, ...]:
        """See :meth:`Asset.division_notices`."""
        told = list(super().division_notices(subdivision))
        if self._model.compressed:
            words = "what is compressed with Draco is written as plain buffers"
            told.append(Notice(Code.WRITING_DRACO, words))
        if self._model.expanded:
            words = "what is compressed with meshopt is written as plain buffers"
            told.append(Notice(Code.WRITING_MESHOPT, words))
        divided = divide_primitives(self._model, self._surface, subdivision)
        told += storage_notices(self._model.document.root, divided.document.root)
        lost = divided.lost
        if lost > _LOST:
            words = f"at new vertices up to {lost:.1%} of the skin weights had no room for a joint"
            told.append(Notice(Code.WRITING_WEIGHTS, f"{words}; the others were scaled up"))
        return tuple(told)

    def _divide(self, subdivision: Subdivision) -> bytes:
        divided = divide_primitives(self._model, self._surface, subdivision)
        container, limits = self._model.container, self._model.limits
        editor = BufferEditor(Accessors(divided.document, divided.buffers, limits))
        return write_file(container, divided.document, divided.buffers, editor)

    def _read_content(self) -> Content:
        model = self._model
        document = model.compressed.document if model.compressed else model.document
        return read_content(document, model.accessors, model.scene)

    def _divisions(self) -> dict[str, Division]:
        return scene_divisions(self._model.document.root, self._model.scene, self._surface.kept)


def _stored_apart(before: Element, after: Element) -> bool:
    """Whether an accessor reads another buffer view for no other reason than what it shared."""
    return any(
        old.value.get("bufferView") != new.value.get("bufferView")
        and old.value.get("componentType") == new.value.get("componentType")
        and "sparse" not in old.value
        for old, new in zip(before.children("accessors"), after.children("accessors"), strict=False)
    )


def _count(number: int, one: str, many: str) -> str:
    return f"{number:,} {one if number == 1 else many}"
