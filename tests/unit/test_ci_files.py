"""The files that other people's CI reads, and the examples in docs/ci.md and docs/gates.md."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tomllib
from importlib.resources import files
from pathlib import Path
from typing import Any, get_args

import jsonschema
import pytest
from ruamel.yaml import YAML

from meshcone.gates.files import parse_gate_file
from meshcone.options import parse_options_json
from meshcone.picture_formats import PictureFormat
from service.gating.matching import REFERENCES
from service.gating.pairs import read_manifest
from tests import shapes

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
SCHEMAS = files("check_jsonschema") / "builtin_schemas" / "vendor"


def validate(document: Any, schema: str) -> None:
    definition = json.loads((SCHEMAS / f"{schema}.json").read_text())
    jsonschema.validators.validator_for(definition)(definition).validate(document)


def loaded(text: str) -> Any:
    return YAML(typ="safe", pure=True).load(text)


def examples(document: str, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", (DOCS / document).read_text(), re.M | re.S)


@pytest.mark.parametrize("name", ["fault", "wish"])
def test_the_forms_for_issues_are_forms(name: str) -> None:
    form = ROOT / f".github/ISSUE_TEMPLATE/{name}.yml"

    validate(loaded(form.read_text()), "github-issue-forms")


def test_the_choice_of_forms_is_one() -> None:
    choice = ROOT / ".github/ISSUE_TEMPLATE/config.yml"

    validate(loaded(choice.read_text()), "github-issue-config")


def test_hooks_before_a_commit_run_what_the_checks_run() -> None:
    [local] = loaded((ROOT / ".pre-commit-config.yaml").read_text())["repos"]
    makefile = (ROOT / "Makefile").read_text()

    for hook in local["hooks"]:
        program, *arguments = hook["entry"].removeprefix(".venv/bin/").split()
        assert f"$(BIN)/{program}" in makefile
        assert (Path(sys.executable).parent / program).exists()
        assert "--fix" not in arguments


def test_the_development_container_runs_targets_that_there_are() -> None:
    container = json.loads((ROOT / ".devcontainer/devcontainer.json").read_text())
    program, *targets = container["postCreateCommand"].split()

    assert program == "make"
    for target in targets:
        assert re.search(rf"^{target}:", (ROOT / "Makefile").read_text(), re.M)


def test_ci_runs_what_contributors_are_told_it_runs() -> None:
    script = (ROOT / ".ci/run").read_text()
    targets = re.findall(r"^make (\w+)$", script, re.M)

    assert f"`make {' '.join(targets)}` with `CI=true`" in (ROOT / "CONTRIBUTING.md").read_text()
    for target in targets:
        assert re.search(rf"^{target}:", (ROOT / "Makefile").read_text(), re.M)


def test_the_wheel_is_tried_with_every_python_it_is_said_to_work_with() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    claimed = re.findall(r"Python :: (3\.\d+)", " ".join(project["classifiers"]))
    [tried] = re.findall(
        r"\.ci/wheel ((?:python3\.\d+ ?)+)$", (ROOT / "Makefile").read_text(), re.M
    )

    assert tried.split() == [f"python{version}" for version in claimed]
    assert project["requires-python"] == f">={claimed[0]}"


@pytest.fixture(scope="module")
def action() -> Any:
    return loaded((ROOT / "action.yml").read_text())


def test_the_action_is_one(action: Any) -> None:
    validate(action, "github-actions")


def test_the_actions_inputs_are_those_it_uses_and_those_that_are_documented(action: Any) -> None:
    used = set(re.findall(r"inputs\.([\w-]+)", (ROOT / "action.yml").read_text()))
    text = (DOCS / "ci.md").read_text()

    assert used == set(action["inputs"])
    assert all(f"`{name}`" in text for name in action["inputs"])


@pytest.mark.parametrize(
    "inputs",
    [
        {"source": "-ball.obj", "reference": "b.obj"},
        {"manifest": "m"},
        {"manifest": "-ball.*", "reference-pattern": "b.obj", "label": "-x"},
        {"source": ".", "reference-pattern": "b.obj"},
    ],
)
def test_the_action_gates_what_its_inputs_name(
    action: Any, tmp_path: Path, inputs: dict[str, str]
) -> None:
    ball = shapes.obj(*shapes.sphere(1))
    for name in ("-ball.obj", "b.obj"):
        (tmp_path / name).write_bytes(ball)
    (tmp_path / "g.toml").write_text("gates.'validity.watertight'.equals = true")
    (tmp_path / "m").write_text('[[pairs]]\nsource = "-ball.obj"\nreference = "b.obj"')
    install_this_checkout(tmp_path)

    finished = run_step(action, tmp_path, {"gates": "g.toml", "jobs": "1", **inputs})

    assert (finished.returncode, finished.stderr) == (0, "")
    written = {path.name for path in tmp_path.glob("meshcone-gate.*")}
    assert written == {f"meshcone-gate.{form}" for form in ("json", "xml", "sarif", "html", "md")}
    assert (tmp_path / "summary").read_text() == (tmp_path / "meshcone-gate.md").read_text()


def test_the_action_shows_its_summary_where_an_asset_fails(action: Any, tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_bytes(shapes.obj(*shapes.sphere(1)))
    (tmp_path / "g.toml").write_text("gates.'validity.watertight'.equals = false")
    install_this_checkout(tmp_path)

    pair = {"source": "a.obj", "reference": "a.obj"}
    finished = run_step(action, tmp_path, {"gates": "g.toml", "jobs": "1", **pair})

    assert finished.returncode == 1
    assert "FAILED" in (tmp_path / "summary").read_text()


def test_the_action_shows_no_summary_of_an_earlier_run(action: Any, tmp_path: Path) -> None:
    (tmp_path / "meshcone-gate.md").write_text("all is well")
    install_this_checkout(tmp_path)

    finished = run_step(action, tmp_path, {"gates": "nowhere.toml", "source": "a.obj"})

    assert finished.returncode == 2
    assert not (tmp_path / "summary").exists()


def install_this_checkout(directory: Path) -> None:
    """Put a program where the step before the last installs it."""
    program = directory / "meshcone" / "bin" / "meshcone"
    program.parent.mkdir(parents=True)
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m service.cli "$@"\n')
    program.chmod(0o755)


def run_step(
    action: Any, directory: Path, given: dict[str, str]
) -> subprocess.CompletedProcess[str]:
    """Run the action's last step as the runner does, with defaults for what is not given."""
    step = action["runs"]["steps"][-1]
    values = {name: str(each.get("default", "")) for name, each in action["inputs"].items()}
    values |= given
    variables = {
        variable: values[re.fullmatch(r"\$\{\{ inputs\.([\w-]+) \}\}", text)[1]]
        for variable, text in step["env"].items()
    }
    return subprocess.run(
        ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", step["run"]],
        cwd=directory,
        env={
            **os.environ,
            **variables,
            "RUNNER_TEMP": str(directory),
            "GITHUB_STEP_SUMMARY": str(directory / "summary"),
        },
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )


def test_the_hook_has_what_pre_commit_asks_for() -> None:
    [hook] = loaded((ROOT / ".pre-commit-hooks.yaml").read_text())
    example = next(text for text in examples("ci.md", "yaml") if "repos:" in text)

    assert {"id", "name", "entry", "language"} <= set(hook)
    assert hook["id"] == loaded(example)["repos"][0]["hooks"][0]["id"]
    assert not re.search(hook["files"], "props/barrel.glb.import")
    assert not re.search(hook["files"], "props/glb")


@pytest.mark.parametrize(
    "ending",
    [
        *sorted(REFERENCES),
        *(f".{name}" for name in get_args(PictureFormat) if name != "unknown"),
        *(".jpg", ".tga", ".mtl", ".bin"),
        *(".csv", ".toml", ".json"),
    ],
)
def test_the_hook_runs_for_every_file_that_a_gate_depends_on(ending: str) -> None:
    [hook] = loaded((ROOT / ".pre-commit-hooks.yaml").read_text())

    assert re.search(hook["files"], f"props/barrel{ending}")
    assert re.search(hook["files"], f"props/BARREL{ending.upper()}")


@pytest.mark.parametrize(
    ("marker", "schema"), [("runs-on", "github-workflows"), ("artifacts:", "gitlab-ci")]
)
def test_the_example_workflows_are_valid(marker: str, schema: str) -> None:
    [example] = [text for text in examples("ci.md", "yaml") if marker in text]

    validate(loaded(example), schema)


@pytest.mark.parametrize("language", ["csv", "toml"])
def test_the_example_manifests_are_read(tmp_path: Path, language: str) -> None:
    example = examples("ci.md", language)[0]
    (tmp_path / f"pairs.{language}").write_text(example)

    assert read_manifest(tmp_path / f"pairs.{language}")[0].name == "props/barrel.glb"


def test_the_example_chain_is_read(tmp_path: Path) -> None:
    [example] = [text for text in examples("ci.md", "toml") if "lod" in text]
    (tmp_path / "pairs.toml").write_text(example)

    levels = {pair.name: pair.level for pair in read_manifest(tmp_path / "pairs.toml")}

    assert levels == {"props/rock_LOD1.glb": 1, "props/rock_LOD2.glb": 2}


def test_the_example_gates_are_read() -> None:
    whole, levels = examples("gates.md", "toml")

    file = parse_gate_file("gates.toml", whole.encode(), "measure")
    by_level = parse_gate_file("gates.toml", levels.encode(), "measure")

    assert "deviation.max" in file.for_asset("hero_knight.glb")
    ratio = by_level.for_asset("rock_LOD2.glb", 2)["asset.budget.triangles"]
    assert ratio.max_ratio_to_reference == 0.25


def test_the_example_options_of_a_job_are_valid() -> None:
    [options] = re.findall(r"options='(.*?)'", (DOCS / "ci.md").read_text())

    assert parse_options_json(options).mode == "measure"
