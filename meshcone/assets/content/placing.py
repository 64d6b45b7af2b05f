"""Where texture coordinates lie in the texture that is read through them."""

from __future__ import annotations

import numpy as np

from meshcone.assets.content.records import Material, TextureUse
from meshcone.surface.arrays import Floats


def placed(use: TextureUse, coordinates: Floats) -> Floats:
    """Texture coordinates (..., 2) after the use's own transform (KHR_texture_transform).

    Scaled, then turned counter-clockwise as one sees the image, then moved. v runs downwards.
    """
    cosine, sine = np.cos(use.rotation), np.sin(use.rotation)
    turn = np.array([[cosine, sine], [-sine, cosine]])
    with np.errstate(over="ignore", invalid="ignore"):
        return np.asarray(coordinates * use.scale @ turn.T + use.offset)


def first_uses(material: Material) -> dict[int, TextureUse]:
    """The first texture that a material reads through each set of coordinates."""
    return {use.uv_set: use for use in reversed(material.textures)}
