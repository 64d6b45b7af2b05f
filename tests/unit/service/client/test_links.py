"""URLs where a path could stand."""

from __future__ import annotations

import pytest

from meshcone.errors import InputError
from service.client.links import is_link, link_to, shown_link


@pytest.mark.parametrize(
    "text", ["https://example.org/mug.glb", "HTTP://10.0.0.1/mug.obj", "s3://incoming/mug.ply"]
)
def test_a_url_is_a_link(text: str) -> None:
    assert is_link(text)


@pytest.mark.parametrize("text", ["mug.glb", "https/mug.glb", "./s3:/mug.glb", "C:\\mug.glb", ""])
def test_a_path_is_none(text: str) -> None:
    assert not is_link(text)


def test_a_gltf_comes_with_what_it_names_as_one_of_this_machine_does() -> None:
    assert link_to("https://example.org/a/mug.gltf?token=x").resources == "relative"
    assert link_to("s3://incoming/mug.glb").resources == "relative"
    assert link_to("https://example.org/mug.obj").resources is None


def test_what_no_service_could_fetch_is_refused_without_its_query() -> None:
    with pytest.raises(InputError) as caught:
        link_to("https://example.org/" + "x" * 2048 + "?token=3f9a")

    assert "3f9a" not in str(caught.value)


def test_a_query_is_not_shown() -> None:
    assert shown_link("https://example.org/mug.glb?token=3f9a") == "https://example.org/mug.glb"
