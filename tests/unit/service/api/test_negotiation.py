"""Which media type is sent to a client that names several, or none."""

from __future__ import annotations

import pytest

from service.api.negotiation import preferred

JSON, CSV = "application/json", "text/csv"


@pytest.mark.parametrize(
    ("accept", "sent"),
    [
        (None, JSON),
        ("", JSON),
        ("*/*", JSON),
        ("image/png", JSON),  # it takes neither, and is told all the same
        ("text/csv", CSV),
        ("TEXT/CSV", CSV),
        ("text/*", CSV),
        ("text/csv; header=present", CSV),
        ("text/csv, */*", CSV),
        ("text/csv, application/json", CSV),
        ("application/json, text/csv", JSON),
        ("application/json;q=0.5, text/csv;q=0.6", CSV),
        ("application/json, text/csv;q=0.9", JSON),
        ("text/csv;q=0", JSON),
        ("text/csv; Q=0.000, */*;q=0.1", JSON),
        ("text/html, application/xhtml+xml, */*;q=0.8", JSON),
    ],
)
def test_a_client_is_sent_what_it_likes_best(accept: str | None, sent: str) -> None:
    assert preferred(accept, (JSON, CSV)) == sent
