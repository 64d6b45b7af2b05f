"""To whom a secret of the installation is shown."""

from __future__ import annotations

import pytest

from meshcone.errors import InputError
from worker.transfers.places import secret_for
from worker.transfers.settings import Authorization, TransferSettings

SETTINGS = TransferSettings(
    transfer_authorizations={
        "cdn": Authorization(host="assets.example.org", value="Bearer 3f9a"),
        "closed": Authorization(host="http://store.internal:9000", value="Bearer 77c1"),
    }
)


@pytest.mark.parametrize(
    ("url", "name", "secret"),
    [
        ("https://assets.example.org/mug.glb", "cdn", "Bearer 3f9a"),
        ("https://Assets.Example.org/mug.glb", "cdn", "Bearer 3f9a"),
        ("http://store.internal:9000/mug.glb", "closed", "Bearer 77c1"),
    ],
)
def test_it_is_shown_to_its_own_host(url: str, name: str, secret: str) -> None:
    assert secret_for(url, name, SETTINGS) == secret


@pytest.mark.parametrize(
    ("url", "name"),
    [
        ("http://assets.example.org/mug.glb", "cdn"),
        ("https://assets.example.org:8443/mug.glb", "cdn"),
        ("https://other.example.org/mug.glb", "cdn"),
        ("https://store.internal:9000/mug.glb", "closed"),
        ("http://store.internal/mug.glb", "closed"),
    ],
)
def test_it_is_shown_nowhere_else(url: str, name: str) -> None:
    with pytest.raises(InputError, match="is not for http"):
        secret_for(url, name, SETTINGS)
