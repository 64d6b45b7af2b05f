from __future__ import annotations

import pytest
import trimesh

from meshcone.assets import read_asset
from service.api.routes.inputs import MEDIA_TYPES


@pytest.mark.parametrize("suffix", MEDIA_TYPES)
def test_a_mesh_is_sent_as_what_its_reader_takes_it_for(suffix: str) -> None:
    exported = trimesh.creation.box().export(file_type=suffix[1:])
    files = exported if isinstance(exported, dict) else {f"box{suffix}": exported}
    [name] = [name for name in files if name.endswith(suffix)]
    data = files[name].encode() if isinstance(files[name], str) else files[name]

    asset = read_asset(name, data, {other: files[other] for other in files if other != name})

    assert MEDIA_TYPES[suffix] == asset.media_type
