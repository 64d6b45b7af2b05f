"""The formats of images that are told apart, for readers and reports alike."""

from __future__ import annotations

from typing import Literal

PictureFormat = Literal["png", "jpeg", "webp", "ktx2", "unknown"]
