"""Which of several media types a client likes best (RFC 9110, section 12.5.1)."""

from __future__ import annotations

import re
from collections.abc import Sequence

_QUALITY = re.compile(r";\s*q\s*=\s*([01](?:\.\d{0,3})?)\s*(?:;|$)", re.IGNORECASE)


def preferred(accept: str | None, offered: Sequence[str]) -> str:
    """The best of the media types that are offered.

    Of two that are as good to the client, the one that it names, and of two that it names the
    first of them. A client that takes none of them is sent the first that is offered.
    """
    ranges: dict[str, tuple[float, int]] = {}
    for place, each in enumerate((accept or "*/*").split(",")):
        quality = _QUALITY.search(each)
        name = each.partition(";")[0].strip().lower()
        ranges[name] = (1.0 if quality is None else float(quality[1])), place

    def rank(media_type: str) -> tuple[float, bool, int]:
        kind = media_type.partition("/")[0]
        for name in (media_type, f"{kind}/*", "*/*"):
            if name in ranges:
                quality, place = ranges[name]
                is_named = name == media_type and quality > 0
                return quality, is_named, -place if is_named else 0
        return 0.0, False, 0

    return max(offered, key=rank)
