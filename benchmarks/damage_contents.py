"""Ways to damage what an asset has besides its surface."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from damage_model import Model, pixels_of, png
from damage_register import GLTF, Damage, damage
from damage_surface import append


@damage("textures lost")
def _no_textures(model: Model) -> None:
    model.images = []
    for surface in model.surfaces:
        surface.base = surface.normal = None


@damage("texture not sent")
def _missing(model: Model) -> None:
    model.images[0] = None


@damage("texture cut short")
def _cut(model: Model) -> None:
    model.images[0] = (model.images[0] or b"")[:200]


def _repainted(number: int, change: Callable[[np.ndarray], np.ndarray]) -> Damage:
    def function(model: Model) -> None:
        pixels = np.clip(change(pixels_of(model.images[number]).astype(float)), 0, 255)
        model.images[number] = png(pixels.astype(np.uint8))

    return function


damage("texture two magenta pixels")(_repainted(0, lambda _: np.full((1, 2, 3), (255.0, 0, 255.0))))
damage("texture a sixteenth as large")(_repainted(0, lambda pixels: pixels[::16, ::16]))
damage("red and blue swapped")(_repainted(0, lambda pixels: pixels[..., ::-1]))
damage("texture black")(_repainted(0, np.zeros_like))
damage("sRGB stored as linear")(_repainted(0, lambda pixels: 255 * (pixels / 255) ** 2.2))
damage("texture of odd size")(_repainted(0, lambda pixels: pixels[:250, :251]))


@damage("normal map lost")
def _no_normal_map(model: Model) -> None:
    model.surfaces[0].normal = None


@damage("normal map upside down")
def _green(model: Model) -> None:
    _repainted(1, lambda pixels: pixels * (1, -1, 1) + (0, 255, 0))(model)


@damage("images exchanged")
def _exchanged(model: Model) -> None:
    model.images.reverse()


@damage("materials renamed")
def _renamed(model: Model) -> None:
    for number, surface in enumerate(model.surfaces):
        surface.name = f"Material.{number:03}"


@damage("materials merged")
def _merged(model: Model) -> None:
    for part in model.parts:
        part.material = 0
    del model.surfaces[1]


@damage("materials exchanged")
def _exchanged_materials(model: Model) -> None:
    for part in model.parts:
        part.material = 1 - part.material


@damage("recoloured")
def _recoloured(model: Model) -> None:
    model.surfaces[1].color = [0.2, 0.3, 0.8, 1.0]


@damage("roughness changed")
def _rough(model: Model) -> None:
    model.surfaces[0].roughness = 0.9


@damage("transparent")
def _transparent(model: Model) -> None:
    model.surfaces[1].color = [0.8, 0.6, 0.2, 0.3]
    model.surfaces[1].alpha = "BLEND"


@damage("alpha mode changed", GLTF)
def _masked(model: Model) -> None:
    model.surfaces[0].alpha = "MASK"


@damage("double-sided", GLTF)
def _double_sided(model: Model) -> None:
    model.surfaces[0].double_sided = True


@damage("extension of a material lost", GLTF)
def _no_ior(model: Model) -> None:
    model.surfaces[1].ior = None


@damage("extension of a material altered", GLTF)
def _other_ior(model: Model) -> None:
    model.surfaces[1].ior = 1.1


@damage("library lost", ("obj",))
def _no_library(model: Model) -> None:
    model.library = False


@damage("vertex colours lost", GLTF)
def _no_colors(model: Model) -> None:
    model.parts[1].colors = None


@damage("animation dropped", GLTF)
def _no_animation(model: Model) -> None:
    model.animation = None


@damage("animation half as long", GLTF)
def _short(model: Model) -> None:
    model.times = model.times / 2


@damage("animation without one channel", GLTF)
def _no_channel(model: Model) -> None:
    model.turns = None


@damage("animation not finite", GLTF)
def _nan_animation(model: Model) -> None:
    assert model.turns is not None
    model.turns = np.full_like(model.turns, np.nan)


@damage("animation turns the other way", GLTF)
def _turned_animation(model: Model) -> None:
    assert model.turns is not None
    model.turns = model.turns * [1, -1, 1, 1]


@damage("animation renamed", GLTF)
def _other_animation(model: Model) -> None:
    model.animation = "Take 001"


@damage("skin dropped", GLTF)
def _no_skin(model: Model) -> None:
    model.bound = False


@damage("weights not normalised", GLTF)
def _heavy(model: Model) -> None:
    flag = model.parts[2]
    assert flag.weights is not None
    flag.weights = 1.5 * flag.weights


@damage("joints out of range", GLTF)
def _far_joints(model: Model) -> None:
    flag = model.parts[2]
    assert flag.joints is not None
    flag.joints = flag.joints + 9


@damage("joints exchanged", GLTF)
def _other_binding(model: Model) -> None:
    flag = model.parts[2]
    assert flag.joints is not None
    flag.joints = flag.joints[:, [1, 0, 2, 3]]


@damage("a joint lost", GLTF)
def _one_joint(model: Model) -> None:
    flag = model.parts[2]
    model.joints = ["pole"]
    assert flag.joints is not None
    flag.joints = np.zeros_like(flag.joints)


@damage("joints renamed", GLTF)
def _other_joints(model: Model) -> None:
    model.joints = ["bone.001", "bone.002"]


@damage("morph target dropped", GLTF)
def _no_target(model: Model) -> None:
    model.parts[1].target = None


@damage("hierarchy flattened", GLTF)
def _flattened(model: Model) -> None:
    for part in model.parts:
        part.parent = None


@damage("parts renamed")
def _other_parts(model: Model) -> None:
    for number, part in enumerate(model.parts):
        part.name = f"Mesh.{number:03}"


@damage("parts merged into one")
def _one_part(model: Model) -> None:
    pot, lid = model.parts[:2]
    append(pot, lid.positions + lid.place, lid.faces)
    assert pot.uvs is not None
    assert lid.uvs is not None
    pot.uvs[-len(lid.uvs) :] = lid.uvs
    assert pot.normals is not None
    assert lid.normals is not None
    pot.normals[-len(lid.normals) :] = lid.normals
    del model.parts[1]


@damage("whole asset moved by its root", GLTF)
def _moved_root(model: Model) -> None:
    model.root = [0.0, 0.5, 0.0]


@damage("extra data lost", GLTF)
def _no_extras(model: Model) -> None:
    model.extras = {}


@damage("camera lost", GLTF)
def _no_camera(model: Model) -> None:
    model.camera = False


@damage("light lost", GLTF)
def _no_light(model: Model) -> None:
    model.light = False
