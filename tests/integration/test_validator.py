"""Khronos' validator as a family of audits, and programs in its place that behave badly."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from meshcone.assets import read_asset
from meshcone.auditing import validator
from meshcone.auditing.records import AssetAudit
from meshcone.errors import InputError
from meshcone.files import MeshFile
from meshcone.options import parse_options
from meshcone.verbs.audit import audit
from tests import shapes
from tests.unit.assets.bisecting import bisected
from tests.unit.assets.builders import cube_gltf
from tests.whole_asset import whole

DRIVER = Path(__file__).parents[2] / "benchmarks" / "validate_gltf.js"
INSTALLED = Path(os.environ.get("MESHCONE_GLTF_VALIDATOR", sys.prefix))
WHOLE = MeshFile("whole.gltf", whole().to_bytes())
REPORT = {
    "validatorVersion": "9",
    "issues": {
        "numErrors": 1,
        "numWarnings": 2,
        "numInfos": 3,
        "numHints": 4,
        "messages": [
            {"code": "LATE", "message": "a hint", "severity": 3},
            {"code": "BAD", "message": "an error", "severity": 0, "pointer": "/nodes/0"},
        ],
    },
}


@pytest.fixture
def installed() -> Path:
    """Where the npm package is."""
    if not (INSTALLED / "node_modules" / "gltf-validator").is_dir():
        pytest.skip("gltf-validator is not installed: make validator")
    return INSTALLED


@pytest.fixture
def program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where a program in the validator's place is to be written."""
    path = tmp_path / "gltf_validator"
    monkeypatch.setenv("MESHCONE_GLTF_VALIDATOR", str(path))
    return path


def write(program: Path, body: str) -> None:
    program.write_text(f"#!{sys.executable} -I\n{body}\n")
    program.chmod(0o755)


def test_it_counts_what_the_validator_counts(installed: Path, tmp_path: Path) -> None:
    file = tmp_path / "whole.gltf"
    file.write_bytes(WHOLE.data)
    asked = subprocess.run(
        ["node", str(DRIVER), str(installed)],
        input=json.dumps([str(file)]),
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )
    [issues] = json.loads(asked.stdout)

    found = validator.validate(WHOLE)

    by_severity = [[each["severity"] for each in issues].count(level) for level in range(4)]
    assert [found.errors, found.warnings, found.infos, found.hints] == by_severity
    assert by_severity[0] > 0
    assert {(each.code, each.pointer) for each in found.messages} == {
        (each["code"], each["pointer"]) for each in issues
    }
    assert found.messages[0].severity == "error"


@pytest.mark.usefixtures("installed")
def test_it_reads_what_was_sent_beside_the_file() -> None:
    gltf = cube_gltf()
    sent = MeshFile("a.gltf", gltf.separate("my%20cube.bin"), {"my cube.bin": gltf.binary})
    alone = MeshFile("a.gltf", gltf.separate("my%20cube.bin"))

    assert validator.validate(sent).errors == 0
    assert [each.code for each in validator.validate(alone).messages][:1] == ["IO_ERROR"]


def test_a_program_is_given_the_files(program: Path) -> None:
    gltf = cube_gltf()
    sent = MeshFile("a.gltf", gltf.separate("parts/b.bin"), {"parts/b.bin": gltf.binary})
    write(
        program,
        f"""
import json, os, pathlib, sys
path = pathlib.Path(sys.argv[-1])
report = {REPORT!r}
report["validatorVersion"] = f"{{path.name}} {{(path.parent / 'parts/b.bin').stat().st_size}}"
print(json.dumps(report))
sys.exit(1)
""",
    )

    found = validator.validate(sent)

    assert found.version == f"a.gltf {len(gltf.binary)}"
    assert (found.errors, found.warnings, found.infos, found.hints) == (1, 2, 3, 4)
    assert [each.code for each in found.messages] == ["BAD", "LATE"]


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ("while True: pass", "took longer than"),
        ("import time; time.sleep(600)", "took longer than"),
        ("print('x' * (40 << 20))", "is no report"),
        ("b = bytearray(8 << 30)", "ended without an answer"),
        ("import os; os.abort()", "ended without an answer"),
        ("print('[' * 100000)", "is no report"),
        ("print('{}')", "is no report"),
    ],
)
def test_a_program_without_an_answer_tests_nothing(
    program: Path, monkeypatch: pytest.MonkeyPatch, body: str, said: str
) -> None:
    if said.startswith("took"):
        monkeypatch.setattr(validator, "_SECONDS", 2)
    write(program, body)

    found = validator.validate(WHOLE)

    assert found.errors is None
    assert said in (found.not_tested or "")


def test_where_there_is_none_nothing_is_tested(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.delenv("MESHCONE_GLTF_VALIDATOR", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(sys, "prefix", str(tmp_path))

    assert "is not on this machine" in (validator.validate(WHOLE).not_tested or "")


def test_a_setting_that_leads_nowhere_is_an_error(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("MESHCONE_GLTF_VALIDATOR", str(tmp_path))

    with pytest.raises(InputError, match="is no program and has no node_modules/gltf-validator"):
        validator.validate(WHOLE)


def test_what_was_not_tested_passes_no_gate() -> None:
    ball = MeshFile("ball.obj", shapes.obj(*shapes.sphere(1)))
    options = parse_options({"mode": "audit", "gates": {"asset.validator.errors": {"max": 0}}})

    report = audit(ball, None, options)

    assert report.gates is not None
    assert report.gates.verdict == "not_tested"


def test_an_audit_asks_and_another_look_does_not(program: Path) -> None:
    write(program, f"import json; print(json.dumps({REPORT!r}))")
    asset = read_asset(WHOLE.name, WHOLE.data)

    from meshcone.auditing.asset import audit_asset

    asked: AssetAudit = audit_asset(WHOLE, asset, ask_validator=True)
    other = audit_asset(WHOLE, asset)

    assert asked.validator.errors == 1
    assert (other.validator.errors, other.validator.not_tested) == (
        None,
        "asked in audits, and where a gate is about it",
    )


def test_a_divided_file_has_no_new_message(installed: Path, tmp_path: Path) -> None:
    found = {}
    for name, data in (("cube.glb", cube_gltf().glb()), ("whole.gltf", WHOLE.data)):
        asset = read_asset(name, data)
        (tmp_path / f"before-{name}").write_bytes(data)
        divided = asset.divided(bisected(asset.faces, [0, 1, 2, 3]))
        (tmp_path / f"after-{name}").write_bytes(divided)
        paths = [str(tmp_path / f"{when}-{name}") for when in ("before", "after")]
        ran = subprocess.run(
            ["node", str(DRIVER), str(installed)],
            input=json.dumps(paths),
            capture_output=True,
            text=True,
            check=True,
        )
        before, after = (
            {(each["code"], each["pointer"]) for each in report}
            for report in json.loads(ran.stdout)
        )
        found[name] = after - before
    assert found == {"cube.glb": set(), "whole.gltf": set()}
