"""The transfer function of sRGB (IEC 61966-2-1)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def to_linear(encoded: Floats) -> Floats:
    """Linear light of channels as encoded, both 0 to 1; what lies beyond is cut off."""
    values = np.clip(encoded, 0, 1)
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def to_encoded(linear: Floats) -> Floats:
    """Channels as encoded, of linear light, both 0 to 1; what lies beyond is cut off."""
    values = np.clip(linear, 0, 1)
    return np.where(values <= 0.0031308, 12.92 * values, 1.055 * values ** (1 / 2.4) - 0.055)
