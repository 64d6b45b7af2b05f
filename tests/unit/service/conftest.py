"""The application in this process, with a broker that is not there."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from fastapi import FastAPI
from starlette.testclient import TestClient

from service.api.app import create_app
from service.dashboard.routes import router
from service.settings import ServiceSettings

LOCAL = "http://127.0.0.1:8000"  # without keys, the service answers to names of this machine only


@pytest.fixture
def app(tmp_path: Path) -> FastAPI:
    settings = ServiceSettings(
        redis_url=f"unix://{tmp_path}/nobody.sock",
        data_dir=tmp_path,
        max_upload_bytes=100_000,
        max_resources=2,
    )
    return create_app(settings, keys_required=False, pages=router)


@pytest.fixture
def http(app: FastAPI) -> Iterator[TestClient]:
    with TestClient(app, LOCAL, raise_server_exceptions=False) as client:
        yield client
