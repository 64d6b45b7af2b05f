"""A file of a design program as an asset, to compare with."""

from __future__ import annotations

import json
import struct

from meshcone.assets.converted.formats import Converted
from meshcone.assets.converted.process import convert
from meshcone.assets.gltf.asset import GltfAsset
from meshcone.assets.gltf.container import split_glb
from meshcone.assets.gltf.model import Model
from meshcone.assets.limits import Limits
from meshcone.assets.policy import ReadPolicy, WritePolicy
from meshcone.errors import InputError
from meshcone.notices import Code, Notice


class ConvertedAsset(GltfAsset):
    """A mesh converted from a file that cannot be written back.

    Attributes:
        tolerance: how far the mesh may lie from the surfaces in the file, in its unit.
    """

    def __init__(
        self, name: str, kind: Converted, glb: bytes, tolerance: float, model: Model
    ) -> None:
        super().__init__(name, glb, model)
        self.format, self.media_type = kind.name, kind.media_type
        self.tolerance = tolerance
        self._called = kind.called
        if tolerance:
            words = (
                f"its surfaces were divided into triangles that lie within {tolerance:.3g} of "
                "them: every distance is uncertain by as much"
            )
            self.warnings += (Notice(Code.SURFACE_TESSELLATED, words),)

    def ensure_writable(self, policy: WritePolicy | None = None) -> None:  # noqa: ARG002
        """Refuse: what was converted cannot be written.

        Raises:
            InputError: always.
        """
        raise InputError(
            f"this is {self._called}: it can be a reference, and be measured, but not refined",
            file=self.name,
        )


def read_converted(
    name: str, kind: Converted, data: bytes, limits: Limits, policy: ReadPolicy
) -> ConvertedAsset:
    """Read a file of a design program.

    Raises:
        InputError: it is damaged, holds no surface, or its reader is not installed.
        LimitError: it takes more memory or time than ``limits`` allow, or makes more vertices
            or triangles.
    """
    glb, tolerance = convert(kind, data, policy.chord, limits)
    glb = glb if kind.metres == 1 else _scaled(glb, 1 / kind.metres)
    model = Model.read(glb, split_glb(glb, limits), {}, limits, ReadPolicy())
    return ConvertedAsset(name, kind, glb, tolerance, model)


def _scaled(glb: bytes, scale: float) -> bytes:
    """A GLB with all of its scene below a node that scales it."""
    (length,) = struct.unpack_from("<I", glb, 12)
    document = json.loads(glb[20 : 20 + length])
    nodes, scene = document["nodes"], document["scenes"][document.get("scene", 0)]
    nodes.append({"children": scene["nodes"], "scale": [scale] * 3})
    scene["nodes"] = [len(nodes) - 1]
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    rest = glb[20 + length :]
    head = struct.pack("<4sIIII", b"glTF", 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A)
    return head + text + rest
