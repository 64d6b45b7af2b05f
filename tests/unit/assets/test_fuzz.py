"""Whatever is done to a file, it is refused in words or read as a finite mesh.

Every target runs for a moment in the suite and for minutes in ``make fuzz``.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from meshcone.assets import Limits, WritePolicy, read_asset
from meshcone.errors import MeshConeError
from tests.fuzz import seeds
from tests.fuzz.damage import damaged_bytes, damaged_document, damaged_words
from tests.unit.assets.builders import cube_gltf
from tests.unit.assets.squeezing import squeezed

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")

# Small enough that what a file only declares takes no time to make.
LIMITS = Limits(vertices=5_000, faces=5_000, json_depth=32, node_depth=32)


def damaged(files: list[bytes]) -> st.SearchStrategy[bytes]:
    return st.sampled_from(files).flatmap(
        lambda seed: st.one_of(damaged_bytes(seed), damaged_words(seed))
    )


def check(name: str, data: bytes) -> None:
    """What must hold of any file at all."""
    try:
        asset = read_asset(name, data, {"a.bin": bytes(64)}, LIMITS)
        assert np.isfinite(asset.vertices).all()
        assert ((asset.faces >= 0) & (asset.faces < len(asset.vertices))).all()
        corners = asset.vertices[asset.faces]
        assert (corners != np.roll(corners, 1, axis=1)).any(axis=2).all()
        assert asset.patched(asset.vertices) == data
        policy = WritePolicy(instances="auto")
        written = asset.patched(asset.vertices * 0.5 + 1, policy)
        again = read_asset(name, written, {"a.bin": bytes(64)})
        assert len(again.positions) == len(asset.positions)
    except MeshConeError as error:
        assert error.kind in ("input", "limit")  # noqa: PT017
        assert error.file == name  # noqa: PT017
        assert 0 < len(error.message) < 500  # noqa: PT017


@given(damaged(seeds.OBJ))
def test_obj(data: bytes) -> None:
    check("damaged.obj", data)


@given(damaged(seeds.PLY))
def test_ply(data: bytes) -> None:
    check("damaged.ply", data)


@given(damaged(seeds.STL))
def test_stl(data: bytes) -> None:
    check("damaged.stl", data)


@given(damaged(seeds.OFF))
def test_off(data: bytes) -> None:
    check("damaged.off", data)


SQUEEZED = squeezed(cube_gltf())
SQUEEZED.json["buffers"][0]["byteLength"] = len(SQUEEZED.binary)
EMBEDDED = [json.loads(gltf.embedded()) for gltf in seeds.DOCUMENTS]


@given(st.sampled_from(EMBEDDED).flatmap(damaged_document))
def test_gltf(document: dict[str, Any]) -> None:
    check("damaged.gltf", json.dumps(document).encode())


@given(damaged([gltf.embedded() for gltf in seeds.DOCUMENTS]))
def test_json_text(data: bytes) -> None:
    check("damaged.gltf", data)


@given(damaged([gltf.glb() for gltf in seeds.DOCUMENTS]))
def test_glb(data: bytes) -> None:
    check("damaged.glb", data)


@given(
    st.sampled_from(seeds.DOCUMENTS).flatmap(
        lambda gltf: st.builds(
            seeds.packed, damaged_document(gltf.json), damaged_bytes(bytes(gltf.binary))
        )
    )
)
def test_glb_of_a_damaged_document_and_buffer(data: bytes) -> None:
    check("damaged.glb", data)


# Each example starts a process to decode it.
@settings(max_examples=settings.default.max_examples // 10)
@given(
    st.builds(seeds.packed, st.just(SQUEEZED.json), damaged_bytes(bytes(SQUEEZED.binary)))
    | st.builds(seeds.packed, damaged_document(SQUEEZED.json), st.just(bytes(SQUEEZED.binary)))
)
def test_meshopt(data: bytes) -> None:
    check("damaged.glb", data)
