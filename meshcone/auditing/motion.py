"""The skins and animations of an asset."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from meshcone.assets.content import Draw, Node
from meshcone.auditing.records.motion import AnimationRecord, Motion
from meshcone.auditing.subject import Subject

_SUM = 0.01  # off 1; glTF's own validator allows .005 for floats, 8 bits add up to .008
_INFLUENCES = 4


def motion_of(subject: Subject) -> Motion:
    """Count what would make a pose wrong."""
    content = subject.content
    counts = dict.fromkeys(_CORNER_COUNTS, 0)
    for draw in content.draws:
        node = content.nodes[draw.node] if draw.node is not None else None
        for name, found in _weights(subject, draw, node):
            counts[name] += found
    channels = [channel for each in content.animations for channel in each.channels]
    return Motion(
        **counts,
        names=tuple(each.name for each in content.animations),
        animations=tuple(
            AnimationRecord(
                name=each.name,
                duration=each.duration,
                channels=len(each.channels),
                keys=sum(channel.keys for channel in each.channels),
            )
            for each in content.animations
        ),
        longest=max((each.duration for each in content.animations), default=0.0),
        empty_animations=sum(not each.channels for each in content.animations),
        channels_not_finite=sum(not channel.finite for channel in channels),
        channels_without_target=sum(
            channel.node is None and channel.path != "pointer" for channel in channels
        ),
    )


_CORNER_COUNTS = (
    "skinned_corners",
    "weights_not_normalised",
    "weights_not_finite",
    "weights_negative",
    "over_four_influences",
    "joints_out_of_range",
    "without_skin",
    "unweighted",
)


def _weights(subject: Subject, draw: Draw, node: Node | None) -> Iterator[tuple[str, int]]:
    sets = [
        (weights.reshape(-1, weights.shape[2]), joints.reshape(-1, joints.shape[2]))
        for number in range(2)
        if (weights := subject.corners(draw, f"WEIGHTS_{number}")) is not None
        and (joints := subject.corners(draw, f"JOINTS_{number}")) is not None
    ]
    skin = subject.content.skins[node.skin] if node and node.skin is not None else None
    corners = 3 * len(draw.rows)
    if not sets:
        yield "unweighted", corners if skin is not None else 0
        return
    weights = np.concatenate([weights for weights, _ in sets], axis=1)
    joints = np.concatenate([joints for _, joints in sets], axis=1)
    finite = np.isfinite(weights).all(axis=1)
    moved = weights > 0
    total = np.where(finite, weights.sum(axis=1, where=np.isfinite(weights)), 1.0)
    yield "skinned_corners", corners
    yield "weights_not_finite", int(np.count_nonzero(~finite))
    yield "weights_negative", int(np.count_nonzero((weights < 0).any(axis=1)))
    yield "weights_not_normalised", int(np.count_nonzero(np.abs(total - 1) > _SUM))
    yield "over_four_influences", int(np.count_nonzero(moved.sum(axis=1) > _INFLUENCES))
    yield "unweighted", int(np.count_nonzero(~moved.any(axis=1)))
    if skin is None:
        yield "without_skin", corners
    else:
        unknown = (joints >= len(skin.joints)) & moved
        yield "joints_out_of_range", int(np.count_nonzero(unknown.any(axis=1)))
