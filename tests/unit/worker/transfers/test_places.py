"""To whom a secret of the installation is shown."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

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


@pytest.mark.parametrize("value", ["Bearer x ", " Bearer x", "Bearer x\t", "Bearer x\n", "é", ""])
def test_one_that_is_no_value_of_a_header_is_refused_unsaid(value: str) -> None:
    with pytest.raises(ValidationError) as caught:
        Authorization(host="assets.example.org", value=value)

    assert "Bearer x" not in str(caught.value)


@pytest.mark.parametrize("value", ["x", "Bearer  x", "~"])
def test_one_that_is_a_value_of_a_header_is_taken(value: str) -> None:
    assert Authorization(host="assets.example.org", value=value).value == value


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
