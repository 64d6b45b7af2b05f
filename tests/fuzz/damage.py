"""Ways to damage a file: bytes, words, and the values of a JSON document."""

from __future__ import annotations

import json
import re
from typing import Any

from hypothesis import strategies as st

# What has tripped readers before, of every format.
_WORDS = st.sampled_from(
    [
        *b"0 -0 1 -1 2 3 4 -4 255 65535 4294967295 99999999999999999999 0x1 1_0 1.5".split(),
        *b".5 1e5 1e308 1e400 nan -inf 1/2/3 1//2 1/ // # v vn f o g usemtl l".split(),
        *b"ply element property list vertex face end_header float uchar ascii OFF solid".split(),
        *b"facet endloop endsolid binary_big_endian".split(),
        *[b"", b"\\", b"\\\n", b"\r", b"\n", b"\0", b"\xff", b"9" * 400],
    ]
)
_NUMBERS = [0, 1, -1, 2, 3, 5121, 5123, 5126, 2**31, 2**53, 10**30, 0.5, 1e300, -1e-300]
_TEXTS = ["", "x", "VEC3", "SCALAR", "data:,", "data:;base64,AAAA", "../a", "a.bin"]
_HOLDERS = [[], {}, [0], [[]], [{}], [0, 0, 0], [1e200] * 3, [0, 0, 0, 1], {"count": 1}]
_VALUES: st.SearchStrategy[Any] = st.sampled_from(
    [None, True, False, *_NUMBERS, *_TEXTS, *_HOLDERS, {"bufferView": 0}]
)
_PLACES = st.floats(0, 1, exclude_max=True)


@st.composite
def damaged_bytes(draw: st.DrawFn, seed: bytes) -> bytes:
    """A few runs of bytes replaced, cut out, repeated or put in; or the end cut off."""
    data = bytearray(seed)
    for _ in range(draw(st.integers(1, 4))):
        start = int(draw(_PLACES) * len(data))
        length = draw(st.sampled_from([0, 1, 1, 2, 4, 20]))
        new = draw(
            st.binary(max_size=4) | _WORDS | st.just(bytes(data[start : start + length]) * 2)
        )
        data[start : start + length] = new
    if draw(st.integers(0, 9)) == 0:
        del data[int(draw(_PLACES) * len(data)) :]
    return bytes(data)


@st.composite
def damaged_words(draw: st.DrawFn, seed: bytes) -> bytes:
    """A few words replaced, left out, repeated or swapped with others of the file."""
    words = re.split(rb"(\s+)", seed)
    for _ in range(draw(st.integers(1, 4))):
        place = int(draw(_PLACES) * len(words))
        other = int(draw(_PLACES) * len(words))
        words[place] = draw(st.one_of(_WORDS, st.just(words[other]), st.just(words[place] * 2)))
    return b"".join(words)


@st.composite
def damaged_document(draw: st.DrawFn, document: dict[str, Any]) -> dict[str, Any]:
    """A few values of a document replaced, taken out or exchanged with others of it."""
    document = json.loads(json.dumps(document))
    for _ in range(draw(st.integers(1, 4))):
        places = list(_places(document))
        if not places:
            break
        holder, key = places[int(draw(_PLACES) * len(places))]
        other, other_key = places[int(draw(_PLACES) * len(places))]
        action = draw(st.integers(0, 5))
        if action == 0:
            del holder[key]
        elif action == 1:
            holder[key] = json.loads(json.dumps(other[other_key]))
        elif action == 2 and isinstance(holder[key], int):
            holder[key] += draw(st.integers(-5, 5))
        else:
            holder[key] = json.loads(json.dumps(draw(_VALUES)))  # which the next change may reach
    return document


def _places(value: Any) -> Any:
    """Every place of a document, as what holds it and its key or index there."""
    keys = list(value) if isinstance(value, dict) else range(len(value))
    for key in keys:
        yield value, key
        if isinstance(value[key], (dict, list)):
            yield from _places(value[key])
