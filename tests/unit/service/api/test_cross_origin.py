"""Pages of other sites: shut out by default, let in by name."""

from __future__ import annotations

from pathlib import Path

import pytest
from pydantic import ValidationError
from starlette.testclient import TestClient

from service.api.app import create_app
from service.settings import ServiceSettings
from tests.unit.service.conftest import LOCAL

SITE = "https://assets.example.org"
ASKED = {"Access-Control-Request-Method": "POST", "Access-Control-Request-Headers": "authorization"}


def client_of(directory: Path, origins: str | None, *, keys_required: bool = True) -> TestClient:
    settings = ServiceSettings(
        redis_url=f"unix://{directory}/nobody.sock", data_dir=directory, cors_origins=origins
    )
    app = create_app(settings, keys_required=keys_required)
    return TestClient(app, LOCAL, raise_server_exceptions=False)


def test_no_page_of_another_site_is_let_in_by_default(tmp_path: Path) -> None:
    http = client_of(tmp_path, None)

    asked = http.options("/v1/jobs", headers={"Origin": SITE, **ASKED})
    answer = http.get("/livez", headers={"Origin": SITE})

    assert asked.status_code >= 400
    for headers in (asked.headers, answer.headers):
        assert "access-control-allow-origin" not in headers


@pytest.mark.parametrize(
    ("origins", "said"), [(SITE, SITE), (f"http://a.test,{SITE}", SITE), ("*", "*")]
)
def test_a_page_of_a_site_that_is_named_may_ask_and_read(
    tmp_path: Path, origins: str, said: str
) -> None:
    http = client_of(tmp_path, origins)

    asked = http.options("/v1/jobs", headers={"Origin": SITE, **ASKED})
    refused = http.get("/v1/jobs", headers={"Origin": SITE})  # it has sent no key

    assert asked.status_code == 200
    assert "DELETE" in asked.headers["access-control-allow-methods"]
    assert "Idempotency-Key" in asked.headers["access-control-allow-headers"]
    assert refused.status_code == 401
    assert "ETag" in refused.headers["access-control-expose-headers"]
    for headers in (asked.headers, refused.headers):
        assert headers["access-control-allow-origin"] == said
        assert "access-control-allow-credentials" not in headers


def test_a_page_of_a_site_that_is_not_named_is_told_so_as_a_problem(tmp_path: Path) -> None:
    http = client_of(tmp_path, SITE)

    asked = http.options("/v1/jobs", headers={"Origin": "https://evil.example", **ASKED})

    assert asked.status_code == 403
    assert asked.json()["type"] == "urn:meshcone:problem:forbidden"
    assert "access-control-allow-origin" not in asked.headers


@pytest.mark.parametrize(("origins", "status"), [(SITE, 415), ("*", 403), ("http://a.test", 403)])
def test_without_keys_only_a_site_that_is_named_is_let_in(
    tmp_path: Path, origins: str, status: int
) -> None:
    with client_of(tmp_path, origins, keys_required=False) as http:
        answer = http.post("/v1/jobs", headers={"Origin": SITE})

    assert answer.status_code == status  # who is let in is asked for a form


@pytest.mark.parametrize(
    "text", ["assets.example.org", f"{SITE}/", f"{SITE}, {SITE}", "ftp://a", "https://"]
)
def test_what_is_no_origin_is_refused_when_the_server_starts(text: str) -> None:
    with pytest.raises(ValidationError, match="is not an origin"):
        ServiceSettings(cors_origins=text)
