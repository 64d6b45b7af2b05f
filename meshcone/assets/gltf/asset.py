"""A glTF or GLB file as an asset."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.base import Asset, NormalsPolicy, naming
from meshcone.assets.gltf.accessors import Accessors
from meshcone.assets.gltf.affine import restore_points
from meshcone.assets.gltf.buffers import Buffers
from meshcone.assets.gltf.container import Container, join_glb, split_glb
from meshcone.assets.gltf.document import Document, parse_document
from meshcone.assets.gltf.ownership import check_ownership
from meshcone.assets.gltf.regions import scene_regions
from meshcone.assets.gltf.scene import Scene, read_scene
from meshcone.assets.gltf.shading import write_shading
from meshcone.assets.gltf.write import BufferEditor
from meshcone.assets.limits import Limits
from meshcone.assets.weld import weld_surface


def read_glb(name: str, data: bytes, resources: Mapping[str, bytes], limits: Limits) -> GltfAsset:
    """Read a GLB file. Raises as ``read_gltf`` does."""
    return _read(name, data, split_glb(data, limits), resources, limits)


def read_gltf(name: str, data: bytes, resources: Mapping[str, bytes], limits: Limits) -> GltfAsset:
    """Read a glTF file whose buffers are data URIs or among ``resources``.

    Raises:
        InputError: with a JSON pointer to what is malformed or not supported.
        LimitError: something is larger or deeper than ``limits`` accept.
    """
    return _read(name, data, None, resources, limits)


class GltfAsset(Asset):
    """A glTF or GLB file.

    Reading takes every triangle the default scene draws, instances included. Writing moves
    vertices through the inverse of their node's transform, in the type they are stored in,
    and changes no byte besides them, their normals, tangents and declared bounds. A mesh
    that several nodes use can be read, as a reference, but not written.
    """

    format = "gltf"
    media_type = "model/gltf+json"

    def __init__(
        self,
        name: str,
        data: bytes,
        container: Container | None,
        document: Document,
        accessors: Accessors,
        scene: Scene,
    ) -> None:
        super().__init__(
            name,
            weld_surface(scene.positions, scene.triangles),
            regions=scene_regions(document.root, scene),
            polygons=sum(len(placed.triangles) for placed in scene.primitives),
            meshes=len({block.placement.node for block in scene.blocks}),
            materials=len({placed.primitive.material for placed in scene.primitives} - {None}),
            warnings=scene.warnings,
        )
        if container is not None:
            self.format = "glb"
            self.media_type = "model/gltf-binary"
        self._data = data
        self._container = container
        self._document = document
        self._accessors = accessors
        self._scene = scene

    def ensure_writable(self, normals: NormalsPolicy = "recompute") -> None:
        """Check that every vertex has bytes of its own to move.

        Raises:
            InputError: naming the mesh, accessor or node that stands in the way.
        """
        with naming(self.name):
            check_ownership(self._document, self._accessors, self._scene, self._surface, normals)

    def _write(self, vertices: NDArray[np.float64], normals: NormalsPolicy) -> bytes:
        positions, moved = self._scattered(vertices)
        editor = BufferEditor(self._accessors)
        for block in self._scene.blocks:
            rows = np.flatnonzero(moved[block.rows])
            world = positions[block.rows][rows]
            editor.store(block.accessor, rows, restore_points(block.placement.matrix, world))
        if normals == "recompute" and moved.any():
            write_shading(editor, self._scene, self._surface, vertices)
        changed = editor.changed_buffers()
        if not changed:
            return self._data
        text = editor.new_json(self._document, changed)
        if self._container is None:
            return text.encode()
        binary = next(
            (
                data
                for index, data in changed.items()
                if self._accessors.buffers[index].source == "binary"
            ),
            None,
        )
        return join_glb(self._container, text, binary)


def _read(
    name: str,
    data: bytes,
    container: Container | None,
    resources: Mapping[str, bytes],
    limits: Limits,
) -> GltfAsset:
    document = parse_document(data if container is None else container.json, limits)
    buffers = Buffers(document, container.binary if container else None, resources)
    accessors = Accessors(document, buffers, limits)
    scene = read_scene(document, accessors, limits)
    return GltfAsset(name, data, container, document, accessors, scene)
