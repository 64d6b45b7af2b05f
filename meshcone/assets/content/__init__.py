"""All that is in a file besides its surface, in words that every format shares."""

from meshcone.assets.content.faults import Fault
from meshcone.assets.content.placing import first_uses, placed
from meshcone.assets.content.records import (
    Animation,
    Attribute,
    Channel,
    Content,
    Draw,
    Fitting,
    Image,
    Material,
    Mesh,
    Node,
    Primitive,
    Skin,
    TextureUse,
    target_called,
)

__all__ = [
    "Animation",
    "Attribute",
    "Channel",
    "Content",
    "Draw",
    "Fault",
    "Fitting",
    "Image",
    "Material",
    "Mesh",
    "Node",
    "Primitive",
    "Skin",
    "TextureUse",
    "first_uses",
    "placed",
    "target_called",
]
