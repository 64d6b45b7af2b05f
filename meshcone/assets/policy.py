"""What of a file is read, and how it is written back."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray

from meshcone.options import Options

NormalsPolicy = Literal["recompute", "keep"]
InstancesPolicy = Literal["auto", "split", "refuse"]
DracoPolicy = Literal["plain", "encode"]
MeshoptPolicy = Literal["plain", "encode"]
PosePolicy = Literal["rest", "bind"]
ALL_SCENES = "all"


@dataclass(frozen=True)
class ReadPolicy:
    """What of a file is its surface.

    Attributes:
        pose: whether skins and morph targets show their ``rest``, as viewers do before anything
            is animated, or are passed over (``bind``).
        member: which file of an archive is the mesh; None for the obvious one.
        scene: which scene of a glTF is read, by name or index, or all of them; None for the one
            that viewers show.
        lod: which level of detail of a glTF is read, 0 for the finest.
        chord: how far the triangles of a STEP may lie from its surfaces, in millimetres; None for
            a share of its size.
        inherited: which of these were asked for of another file, so that this one need not
            have them.
    """

    pose: PosePolicy = "rest"
    member: str | None = None
    scene: str | int | None = None
    lod: int = 0
    chord: float | None = None
    inherited: frozenset[str] = frozenset()

    @classmethod
    def of_source(cls, options: Options) -> Self:
        """What options ask for of the source, or of a mesh alone."""
        return cls(options.pose, options.member, options.scene, options.lod)

    @classmethod
    def of_reference(cls, options: Options) -> Self:
        """What options ask for of the reference.

        That is what they ask for of the source, but for what they say of the reference apart,
        and for its level of detail: unless they say so it is the finest.
        """
        apart = options.of_reference
        own = {name: getattr(apart, name) for name in ("member", "scene")}
        inherited = frozenset(name for name, value in own.items() if value is None)
        chosen = {name: getattr(options, name) for name in inherited}
        return cls(
            options.pose, **{**own, **chosen}, lod=apart.lod, chord=apart.chord, inherited=inherited
        )


@dataclass(frozen=True, eq=False)
class WritePolicy:
    """What writing may do besides moving vertices.

    Attributes:
        normals: ``recompute`` also writes stored normals (see ``normals.py`` for the rule),
            ``keep`` leaves them alone.
        instances: what happens to a mesh or vertex data used more than once: ``refuse`` it,
            ``split`` it into a copy for each use that moves, or, with ``auto``, split what cannot
            be moved once because its uses ask for different shapes.
        draco: whether what was compressed with Draco is written as ``plain`` buffers or
            compressed again (``encode``).
        meshopt: the same for what was compressed with meshopt.
        selected: (m,) faces that may move, or None for all. A vertex of any other face stays,
            and so does a normal that any other face uses.
    """

    normals: NormalsPolicy = "recompute"
    instances: InstancesPolicy = "refuse"
    draco: DracoPolicy = "plain"
    meshopt: MeshoptPolicy = "plain"
    selected: NDArray[np.bool_] | None = None

    def fixed_vertices(self, faces: NDArray[np.int64], count: int) -> NDArray[np.bool_]:
        """(n,) which of ``count`` vertices stay, because a face that is not selected uses them.

        Args:
            faces: (m, 3) vertices of each face.
            count: number of vertices.
        """
        fixed = np.zeros(count, dtype=bool)
        if self.selected is not None:
            fixed[faces[~self.selected]] = True
        return fixed
