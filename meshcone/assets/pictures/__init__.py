"""The images of an asset: headers read here, pixels decoded at arm's length."""

from meshcone.assets.pictures.decoder import PictureDecoder
from meshcone.assets.pictures.picture import (
    MOST_TEXELS,
    Picture,
    UndecodableError,
    grouped_by_content,
    read_picture,
)

__all__ = [
    "MOST_TEXELS",
    "Picture",
    "PictureDecoder",
    "UndecodableError",
    "grouped_by_content",
    "read_picture",
]
