"""How different two colours look: CIEDE2000.

Source: Sharma, Wu and Dalal, "The CIEDE2000 color-difference formula: implementation notes,
supplementary test data, and mathematical observations", Color Research and Application 30(1),
2005; its equations are numbered in the comments. A difference of 1 is what a trained eye just
sees between patches that touch.
"""

from __future__ import annotations

import numpy as np

from meshcone.surface.arrays import Floats

# IEC 61966-2-1: linear sRGB to CIE XYZ. White is what it makes of (1, 1, 1), so that white has
# L* = 100 and no chroma, to the last digit.
_XYZ = np.array(
    [
        [0.4124564, 0.3575761, 0.1804375],
        [0.2126729, 0.7151522, 0.0721750],
        [0.0193339, 0.1191920, 0.9503041],
    ]
)
_WHITE = _XYZ.sum(axis=1)
_KNEE = 6 / 29
_CHROMA_OF_KNEE = 25.0**7


def to_lab(linear: Floats) -> Floats:
    """CIE L*a*b* (k, 3), D65, of linear sRGB (k, 3); channels beyond 0 to 1 are cut off."""
    shares = (np.clip(linear, 0, 1) @ _XYZ.T) / _WHITE
    straight = shares / (3 * _KNEE**2) + 4 / 29
    x, y, z = np.where(shares > _KNEE**3, np.cbrt(shares), straight).T
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=1)


def differences(first: Floats, second: Floats) -> Floats:
    """CIEDE2000 (k,) of the rows of two arrays of L*a*b* (k, 3), with weights of 1."""
    (l1, a1, b1), (l2, a2, b2) = first.T, second.T
    half = (1 - _saturation((np.hypot(a1, b1) + np.hypot(a2, b2)) / 2)) / 2  # (4)
    c1, h1 = _chroma_and_hue((1 + half) * a1, b1)
    c2, h2 = _chroma_and_hue((1 + half) * a2, b2)
    grey = c1 * c2 == 0  # a grey has no hue: the other's counts
    turn = h2 - h1
    turn = np.where(grey, 0, turn - 2 * np.pi * np.sign(turn) * (np.abs(turn) > np.pi))  # (10)
    # (14) The mean hue lies on the shorter way between the two.
    middle = np.where(grey, h1 + h2, (h1 + turn / 2) % (2 * np.pi))
    lightness, chroma = (l1 + l2) / 2, (c1 + c2) / 2  # (12), (13)
    hue_weight = (
        1
        - 0.17 * np.cos(middle - np.radians(30))
        + 0.24 * np.cos(2 * middle)
        + 0.32 * np.cos(3 * middle + np.radians(6))
        - 0.20 * np.cos(4 * middle - np.radians(63))
    )  # (15)
    off_grey = (lightness - 50) ** 2
    light = (l2 - l1) / (1 + 0.015 * off_grey / np.sqrt(20 + off_grey))  # (18)
    colourful = (c2 - c1) / (1 + 0.045 * chroma)  # (19)
    hue = 2 * np.sqrt(c1 * c2) * np.sin(turn / 2) / (1 + 0.015 * chroma * hue_weight)  # (11), (20)
    blue = np.exp(-(((np.degrees(middle) - 275) / 25) ** 2))
    rotation = -2 * _saturation(chroma) * np.sin(np.radians(60) * blue)  # (16), (17), (21)
    squared = light**2 + colourful**2 + hue**2 + rotation * colourful * hue  # (22)
    return np.asarray(np.sqrt(np.maximum(squared, 0)))


def _saturation(chroma: Floats) -> Floats:
    seventh = chroma**7
    return np.asarray(np.sqrt(seventh / (seventh + _CHROMA_OF_KNEE)))


def _chroma_and_hue(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    return np.hypot(a, b), np.arctan2(b, a) % (2 * np.pi)  # (6), (7)
