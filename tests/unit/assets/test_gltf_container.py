from __future__ import annotations

import pytest

from meshcone.assets import read_asset
from meshcone.errors import InputError, LimitError
from tests.unit.assets.builders import cube_gltf


@pytest.mark.parametrize(
    ("text", "error", "message"),
    [
        (b"{" * 100_000, LimitError, "nested levels"),
        (b'{"asset": ', InputError, "malformed"),
        (b'{"a": "\\' + b'\\"' * 100_000, InputError, "malformed"),
        (b'{"asset": {"version": "2.0"}, "a": NaN}', InputError, "NaN"),
        (b'{"asset": "\xff"}', InputError, "not UTF-8"),
        (b'{"a": ' + b"9" * 5000 + b"}", InputError, "found 5,000"),
        (b"{}", InputError, "'asset' is missing"),
        (b'{"asset": {"version": "2.0"}}', InputError, "no faces"),
    ],
)
def test_json_that_is_no_gltf_is_refused(text, error, message):
    with pytest.raises(error, match=message):
        read_asset("mesh.gltf", text)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda glb: glb[:10], "a GLB header has 12 bytes"),
        (lambda glb: glb[:-1], "cut short"),
        (lambda glb: glb[:4] + b"\1\0\0\0" + glb[8:], "GLB version 1"),
        (lambda glb: glb[:8] + b"\x10\0\0\0" + glb[12:], "declares only 16 bytes"),
        (lambda glb: glb[:12] + b"\xff\xff\xff\x7f" + glb[16:], "a chunk declares"),
        (lambda glb: glb[:16] + b"BIN\0" + glb[20:], "first chunk is not JSON"),
    ],
)
def test_a_damaged_container_is_refused(change, message):
    with pytest.raises(InputError, match=message):
        read_asset("mesh.glb", change(cube_gltf().glb()))
