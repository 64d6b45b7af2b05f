"""Skins and animations of a glTF (glTF 2.0, sections 3.7.3 and 3.11)."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.content import Animation, Channel, Skin
from meshcone.assets.gltf.accessors import Accessors, decode
from meshcone.assets.gltf.element import Element
from meshcone.assets.gltf.lenient import Lenient

_VALUES_READ = 16_000_000  # of all animations of a file; any number of channels may name them

# What a channel moves; a pointer with KHR_animation_pointer.
_PATHS = ("translation", "rotation", "scale", "weights", "pointer")
_INTERPOLATIONS = ("LINEAR", "STEP", "CUBICSPLINE")

_SAMPLES = 33  # of a channel's course


class MotionReader:
    """Reads what moves in one document."""

    def __init__(self, root: Lenient, accessors: Accessors) -> None:
        self._root = root
        self._accessors = accessors
        self._nodes = len(root.children("nodes"))
        self._left = _VALUES_READ

    def skins(self) -> tuple[Skin, ...]:
        """All skins."""
        return tuple(
            Skin(skin.name, tuple(skin.references("joints", self._nodes, "node")))
            for skin in self._root.children("skins")
        )

    def animations(self) -> tuple[Animation, ...]:
        """All animations, each with the channels that are sound."""
        return tuple(map(self._animation, self._root.children("animations")))

    def _animation(self, animation: Lenient) -> Animation:
        samplers = [sampler.element for sampler in animation.children("samplers")]
        found = (
            channel.attempt(partial(self._channel, channel, samplers))
            for channel in animation.children("channels")
        )
        return Animation(animation.name, tuple(each for each in found if each is not None))

    def _channel(self, channel: Lenient, samplers: list[Element], element: Element) -> Channel:
        number = element.reference("sampler", len(samplers), "sampler")
        target = channel.child("target")
        if number is None or target is None:
            missing = "sampler" if number is None else "target"
            raise element.error(missing, f"'{missing}' is missing")
        sampler = samplers[number]
        times, values = self._values(sampler, "input"), self._values(sampler, "output")
        interpolation = (sampler.text("interpolation") or "LINEAR")[:40]
        finite = bool(np.isfinite(times).all() and np.isfinite(values).all())
        path = (target.text("path") or "")[:40]
        if path not in _PATHS:
            raise element.error("target", f"'{path}' is nothing of a node that moves")
        if interpolation not in _INTERPOLATIONS:
            raise sampler.error("interpolation", f"'{interpolation}' is no way to interpolate")
        if finite and (times.min() < 0 or (np.diff(times.ravel()) <= 0).any()):
            raise sampler.error(
                "input", "its times are not from 0 on, each later than the one before"
            )
        return Channel(
            node=target.reference("node", self._nodes, "node"),
            path=path,
            interpolation=interpolation,
            keys=len(times),
            first=float(times.min()) if finite else 0.0,
            last=float(times.max()) if finite else 0.0,
            finite=finite,
            track=_track(times.ravel(), values, interpolation) if finite else None,
        )

    def _values(self, sampler: Element, key: str) -> NDArray[np.float64]:
        index = sampler.reference(key, len(self._accessors.elements), "accessor")
        if index is None:
            raise sampler.error(key, f"'{key}' is missing")
        accessor = self._accessors.describe(index)
        if accessor.count == 0:
            raise sampler.error(key, f"accessor {index} has no values; expected one at least")
        self._left -= accessor.count * accessor.columns
        if self._left < 0:
            raise sampler.error(key, f"the animations have more than {_VALUES_READ:,} values")
        return decode(self._accessors.read(accessor), accessor.normalized)


def _track(
    times: NDArray[np.float64], values: NDArray[np.float64], interpolation: str
) -> NDArray[np.float64] | None:
    """Values at even steps from the first key to the last; a spline's without its tangents."""
    keys = len(times)
    if keys == 0 or values.size % keys:
        return None
    rows = values.reshape(keys, -1)
    if interpolation == "CUBICSPLINE":  # in-tangent, value and out-tangent of each key
        if rows.shape[1] % 3:
            return None
        rows = rows.reshape(keys, 3, -1)[:, 1]
    at = np.linspace(times[0], times[-1], _SAMPLES)
    before = np.clip(np.searchsorted(times, at, side="right") - 1, 0, keys - 1)
    if interpolation == "STEP":
        return rows[before]
    after = np.minimum(before + 1, keys - 1)
    length = times[after] - times[before]
    share = np.divide(at - times[before], length, out=np.zeros_like(at), where=length > 0)[:, None]
    sampled: NDArray[np.float64] = (1 - share) * rows[before] + share * rows[after]
    return sampled
