"""What tells one state of a stored file from another."""

from __future__ import annotations

import threading
from collections import OrderedDict
from dataclasses import dataclass


@dataclass(frozen=True)
class Version:
    """What is under a name now.

    Attributes:
        size: bytes.
        tag: another one as soon as anything has been written there.
    """

    size: int
    tag: str


class RememberedVersions:
    """Versions of blobs of which something is known, the last ones only."""

    def __init__(self, capacity: int) -> None:
        self._capacity = capacity
        self._versions: OrderedDict[str, Version] = OrderedDict()
        self._lock = threading.Lock()

    def add(self, name: str, version: Version) -> None:
        """Remember what is under a name."""
        with self._lock:
            self._versions[name] = version
            self._versions.move_to_end(name)
            while len(self._versions) > self._capacity:
                self._versions.popitem(last=False)

    def has(self, name: str, version: Version) -> bool:
        """Whether that was remembered last of what is under the name."""
        with self._lock:
            return self._versions.get(name) == version
