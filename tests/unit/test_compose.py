"""What the compose file promises of the containers it starts."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml

from worker.settings import WorkerSettings

PATH = Path(__file__).parents[2] / "docker-compose.yml"
COMPOSE: dict[str, Any] = yaml.safe_load(PATH.read_text())
SERVICES: dict[str, dict[str, Any]] = COMPOSE["services"]


def is_internal(network: str) -> bool:
    return bool((COMPOSE["networks"][network] or {}).get("internal"))


def test_it_is_a_compose_file() -> None:
    checked = subprocess.run(
        [sys.executable, "-m", "check_jsonschema", "--builtin-schema", "vendor.compose-spec", PATH],
        capture_output=True,
        text=True,
        timeout=60,
    )

    assert checked.returncode == 0, checked.stdout


def test_api_workers_and_broker_are_there_and_workers_are_several() -> None:
    assert {"broker", "api", "worker", "webhooks", "transfers"} == set(SERVICES)
    assert SERVICES["worker"]["deploy"]["replicas"] >= 2


@pytest.mark.parametrize("name", SERVICES)
def test_a_container_can_do_little(name: str) -> None:
    service = SERVICES[name]

    assert service["read_only"] is True
    assert service["cap_drop"] == ["ALL"]
    assert "no-new-privileges:true" in service["security_opt"]
    assert "cap_add" not in service
    assert not service.get("privileged")
    assert service["restart"] == "unless-stopped"


def test_no_container_runs_as_root() -> None:
    image_user = [line for line in dockerfile_lines() if line.startswith("USER ")][-1]

    assert image_user.split()[1].split(":")[0] not in ("0", "root")
    assert SERVICES["broker"]["user"] not in ("0", "root")
    assert all("user" not in SERVICES[name] for name in ("api", "worker", "webhooks", "transfers"))


def test_a_worker_and_the_broker_have_no_way_out() -> None:
    for name in ("worker", "broker"):
        assert all(is_internal(network) for network in SERVICES[name]["networks"])
        assert "ports" not in SERVICES[name]


def test_only_the_api_listens_outside_and_only_on_this_machine() -> None:
    ports = {name: service["ports"] for name, service in SERVICES.items() if "ports" in service}

    assert set(ports) == {"api"}
    assert all(port.startswith("127.0.0.1:") for port in ports["api"])


def test_what_the_broker_acknowledges_is_on_its_disk() -> None:
    command = SERVICES["broker"]["command"]
    settings = dict(zip(command[1::2], command[2::2], strict=True))

    assert settings["--appendonly"] == "yes"
    assert settings["--appendfsync"] == "always"
    assert settings["--maxmemory-policy"] == "noeviction"
    assert SERVICES["broker"]["volumes"] == ["broker:/data"]


def test_what_others_wait_for_says_whether_it_is_healthy() -> None:
    assert "healthcheck" in SERVICES["broker"]
    assert "healthcheck" in SERVICES["worker"]
    assert any(line.startswith("HEALTHCHECK") for line in dockerfile_lines())  # of the API


def test_a_worker_is_not_killed_before_it_has_handed_its_job_back() -> None:
    period = SERVICES["worker"]["stop_grace_period"]

    assert int(period.removesuffix("s")) >= WorkerSettings().stop_grace + 10


def dockerfile_lines() -> list[str]:
    return (PATH.parent / "Dockerfile").read_text().splitlines()
