"""The refined mesh, coloured by its distance from the reference: one GLB file for any viewer.

All of it, in model units, where the preview is light and in the frame. glTF 2.0, section
3.7.2.1: ``COLOR_0`` is what viewers show, here the deviation; ``COLOR_1`` is the tension, where
there is a program; ``_DEVIATION`` (model units) and ``_TENSION`` are the numbers themselves.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.gltf.builder import GlbBuilder
from meshcone.srgb import to_linear
from meshcone.surface.arrays import Floats
from meshcone.views.scene import Scene

# sRGB at even steps of CIELAB, from L* 96 down to 37: light where nothing deviates, also for an eye
# that tells no red from green, and never so dark that it is lost on a dark ground.
RAMP = np.array(
    [
        [246, 244, 235],
        [208, 233, 208],
        [155, 220, 204],
        [101, 202, 207],
        [71, 180, 208],
        [61, 157, 206],
        [65, 132, 197],
        [73, 106, 183],
        [78, 78, 164],
    ]
)
_SHOWN = 99  # per cent of the vertices within the scale: one spike is not to pale all others


def heatmap_glb(scene: Scene) -> bytes:
    """Write the refined mesh of a scene, or its input where nothing was refined, with colours.

    ``asset.extras`` says what the scale's ends stand for. The node is moved to the frame's
    centre, so that single precision is enough wherever the model lies.
    """
    shown = scene.refined or scene.input
    used = shown.mesh.used_vertices
    number = np.full(len(shown.mesh.vertices), -1, dtype=np.int64)
    number[used] = np.arange(len(used))
    deviation = scene.frame.radius * shown.deviation[used]
    builder = GlbBuilder()
    attributes = {
        "POSITION": builder.add_vectors(
            scene.frame.radius * shown.mesh.vertices[used], bounds=True
        ),
        "COLOR_0": builder.add_colours(colours(deviation, scale_top(deviation))),
        "_DEVIATION": builder.add_vectors(deviation),
    }
    extras = {"deviation": {"from": 0.0, "to": scale_top(deviation), "unit": "model"}}
    if scene.tension is not None:
        tension = scene.tension[used]
        attributes["COLOR_1"] = builder.add_colours(colours(tension, scale_top(tension)))
        attributes["_TENSION"] = builder.add_vectors(tension)
        extras["tension"] = {"from": 0.0, "to": scale_top(tension), "unit": "frame"}
    primitive = {
        "attributes": attributes,
        "indices": builder.add_indices(number[shown.mesh.faces]),
        "material": 0,
    }
    return builder.finish(_document(scene, primitive, extras))


def scale_top(values: Floats) -> float:
    """The value that gets the last colour, for values (n,) that are not negative."""
    return float(np.percentile(values, _SHOWN)) if len(values) else 0.0


def colours(values: Floats, top: float) -> NDArray[np.uint8]:
    """Colours (n, 4), linear RGBA, of values (n,): light at 0, dark at ``top`` and above.

    All are light where ``top`` is 0.
    """
    share = np.clip(values / top, 0.0, 1.0) if top > 0 else np.zeros(len(values))
    place = share * (len(RAMP) - 1)
    srgb = np.stack(
        [np.interp(place, range(len(RAMP)), channel) for channel in RAMP.T / 255], axis=1
    )
    # glTF's colours are linear (section 3.9.2).
    opaque = np.column_stack([to_linear(srgb), np.ones(len(srgb))])
    rounded: NDArray[np.uint8] = np.rint(255 * opaque).astype(np.uint8)
    return rounded


def _document(scene: Scene, primitive: dict[str, Any], extras: dict[str, Any]) -> dict[str, Any]:
    return {
        "asset": {"version": "2.0", "generator": "MeshCone", "extras": extras},
        "extensionsUsed": ["KHR_materials_unlit"],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "translation": scene.frame.centre.tolist()}],
        "meshes": [{"name": "deviation", "primitives": [primitive]}],
        "materials": [
            {
                "name": "deviation",
                "doubleSided": True,
                "extensions": {"KHR_materials_unlit": {}},  # light must not change a colour
            }
        ],
    }
