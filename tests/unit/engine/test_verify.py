"""A certificate holds for what it was made for, and for nothing else.

A forger can write any hash into report and certificate. So the hashes here are forged
wherever a file is another, and a check of the mathematics has to fail.
"""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import trimesh

from meshcone.assets import read_asset
from meshcone.errors import InputError
from meshcone.files import MeshFile
from meshcone.options import parse_options
from meshcone.report.report import AlignmentRecord
from meshcone.verbs.verify import read_report
from tests.unit.engine.evidence import Evidence
from tests.unit.engine.pairs import CAPPED, RADIUS, SETTINGS, rough, smooth, with_a_seam

HASHES = {"source file", "reference file", "refined file"}
OPTIMALITY = {"feasible", "stationary", "no gap", "complementary"}


@pytest.fixture(scope="module")
def capped() -> Evidence:
    """A refinement in which caps on displacement are active."""
    return Evidence.of(rough(), smooth(), CAPPED)


@pytest.fixture(scope="module")
def relaxed() -> Evidence:
    """A refinement in which no cone is active."""
    return Evidence.of(rough(), smooth(), {"effort": "fast"})


@pytest.mark.parametrize("name", ["rough.obj", "rough.glb"])
@pytest.mark.parametrize("setting", SETTINGS)
def test_what_the_engine_makes_passes(name: str, setting: str) -> None:
    assert Evidence.of(rough(name), smooth(), SETTINGS[setting]).failed() == set()


@pytest.mark.parametrize("name", ["rough.obj", "rough.glb"])
@pytest.mark.parametrize("setting", ["fast", "centroid"])
def test_a_vertex_that_is_elsewhere_by_a_thousandth_of_the_radius_fails(
    name: str, setting: str
) -> None:
    evidence = Evidence.of(rough(name), smooth(), SETTINGS[setting])
    asset = read_asset(name, evidence.refined.data)
    vertices = asset.vertices.copy()
    vertices[5, 1] += 1e-3 * RADIUS
    moved = replace(evidence, refined=MeshFile(name, asset.patched(vertices)))

    assert "refined file" in moved.failed()
    assert "written" in moved.with_forged_hashes().failed()


def test_a_seam_that_has_been_opened_fails() -> None:
    evidence = Evidence.of(with_a_seam(rough()), smooth(), {"effort": "fast"})
    lines = evidence.refined.data.splitlines()
    assert lines[0] == lines[66]  # the two halves of the seam
    lines[0] = b" ".join(
        [b"v", b"%.9g" % (float(lines[0].split()[1]) + 2e-3), *lines[0].split()[2:]]
    )
    opened = replace(evidence, refined=MeshFile("open.obj", b"\n".join(lines) + b"\n"))

    assert evidence.failed() == set()
    assert "written" in opened.with_forged_hashes().failed()


def test_another_mesh_fails_where_the_refined_file_should_be(capped: Evidence) -> None:
    other = replace(capped, refined=smooth()).with_forged_hashes()

    assert other.failed() == {"closeness", "written"}


def test_an_option_changed_in_the_report_alone_fails(capped: Evidence) -> None:
    options = parse_options({**CAPPED, "quality": {"samples": 100}})
    changed = replace(capped, report=capped.report.model_copy(update={"options": options}))

    assert "options" in changed.failed()


@pytest.mark.parametrize(
    "change",
    [
        {"surface": {"tangential": 0.2}},
        {"surface": {"proximity": 0.1}},
        {"surface": {"faces": 4.0}},
        {"cones": {"max_displacement": {"relative": 0.0205}}},
        {"cones": {"max_displacement": {"relative": 0.0195}}},
        {"seed": 1},
    ],
)
def test_an_option_changed_everywhere_fails_the_mathematics(
    capped: Evidence, change: dict[str, Any]
) -> None:
    changed = capped.with_options(parse_options({**CAPPED, **change}))

    assert changed.failed() & OPTIMALITY
    assert not changed.failed() & {*HASHES, "options"}


@pytest.mark.parametrize("align", ["rigid", "similarity"])
def test_an_alignment_nobody_asked_for_fails(capped: Evidence, align: str) -> None:
    asked = capped.with_options(parse_options({**CAPPED, "align": align}))
    shifted = np.eye(4)
    shifted[0, 3] = 0.01
    matrix = shifted.tolist()
    stated = AlignmentRecord(matrix=matrix, method="icp", before=0.1, after=0.01, note=None)
    moved = capped.with_report(alignment=stated).with_document(alignment=matrix)

    assert "placed" in asked.failed()
    assert moved.failed() == {"placed"}


def test_another_round_fails(capped: Evidence) -> None:
    assert "stationary" in capped.with_document(round_index=2).failed()


@pytest.mark.parametrize("change", [{"round_index": 99}, {"candidate": "pulling"}])
def test_a_round_or_setting_that_does_not_exist_fails(
    capped: Evidence, change: dict[str, Any]
) -> None:
    assert "program" in capped.with_document(**change).failed()


def test_another_reference_fails_the_mathematics(capped: Evidence) -> None:
    swapped = replace(capped, reference=smooth(radius=1.001 * RADIUS))

    assert "reference file" in swapped.failed()
    assert swapped.with_forged_hashes().failed() & OPTIMALITY
    assert not swapped.with_forged_hashes().failed() & HASHES


def test_another_source_fails_the_mathematics(capped: Evidence) -> None:
    swapped = replace(capped, source=rough(seed=8))

    assert "source file" in swapped.failed()
    assert swapped.with_forged_hashes().failed() & OPTIMALITY
    assert not swapped.with_forged_hashes().failed() & HASHES


def test_a_buffer_with_other_bytes_fails() -> None:
    source = with_its_buffer_apart(rough())
    evidence = Evidence.of(source, smooth(), {"effort": "fast"})
    name, data = next(iter(source.resources.items()))
    resources = {**source.resources, name: data + bytes(4)}
    longer = replace(evidence, source=replace(source, resources=resources))

    assert evidence.failed() == set()
    assert longer.failed() == {"resource"}


def test_a_report_that_keeps_quiet_about_a_buffer_fails() -> None:
    evidence = Evidence.of(with_its_buffer_apart(rough()), smooth(), {"effort": "fast"})
    inputs = evidence.report.inputs
    quiet = inputs.model_copy(update={"source": inputs.source.model_copy(update={"resources": {}})})
    report = evidence.report.model_copy(update={"inputs": quiet})

    assert replace(evidence, report=report).failed() == {"resource"}


def test_a_texture_that_was_not_kept_is_no_fault() -> None:
    source = with_its_buffer_apart(rough())
    painted = replace(source, resources={**source.resources, "paint.png": b"\x89PNG"})
    evidence = Evidence.of(painted, smooth(), {"effort": "fast"})

    assert "paint.png" in evidence.report.inputs.source.resources
    assert replace(evidence, source=source).failed() == set()


def with_its_buffer_apart(mesh: MeshFile) -> MeshFile:
    asset = read_asset(mesh.name, mesh.data)
    plain = trimesh.Trimesh(asset.vertices, asset.faces, process=False)
    files = plain.export(file_type="gltf", include_normals=False)
    resources = {name: data for name, data in files.items() if name.endswith(".bin")}
    return MeshFile("apart.gltf", files["model.gltf"], resources)


def test_a_source_of_another_size_fails(capped: Evidence) -> None:
    assert "program" in replace(capped, source=smooth()).failed()


@pytest.mark.parametrize("factor", [0.0, 0.9, 1.001])
def test_scaled_multipliers_fail(capped: Evidence, factor: float) -> None:
    which, values = capped.certificate.multipliers["max_displacement"]
    scaled = capped.with_certificate(multipliers={"max_displacement": (which, factor * values)})

    assert "stationary" in scaled.failed()
    assert "tension" in scaled.failed()


def test_a_multiplier_where_no_cone_is_active_fails(relaxed: Evidence) -> None:
    push = np.array([[0.01, 0.01, 0.0, 0.0]])
    invented = relaxed.with_certificate(multipliers={"edge_cap": (np.array([7]), push)})

    assert relaxed.certificate.multipliers == {}
    assert {"stationary", "no gap", "complementary"} <= invented.failed()


def test_a_multiplier_outside_its_cone_fails(capped: Evidence) -> None:
    which, values = capped.certificate.multipliers["max_displacement"]
    turned = values * np.array([-1, 1, 1, 1])
    altered = capped.with_certificate(multipliers={"max_displacement": (which, turned)})

    assert "stationary" in altered.failed()


@pytest.mark.parametrize(
    "multipliers",
    [
        {"pin": (np.array([0]), np.zeros((1, 3)))},
        {"edge_cap": (np.array([10**6]), np.zeros((1, 4)))},
        {"edge_cap": (np.array([0, 0]), np.zeros((2, 4)))},
        {"edge_cap": (np.array([0]), np.zeros((1, 3)))},
    ],
)
def test_multipliers_of_no_cone_fail(relaxed: Evidence, multipliers: dict[str, Any]) -> None:
    assert "program" in relaxed.with_certificate(multipliers=multipliers).failed()


@pytest.mark.parametrize("array", ["before", "positions"])
def test_a_stored_point_that_is_elsewhere_fails(capped: Evidence, array: str) -> None:
    points = getattr(capped.certificate, array).copy()
    points[5, 1] += 1e-3

    assert "stationary" in capped.with_certificate(**{array: points}).failed()


def test_a_tolerance_that_proves_nothing_is_not_accepted(capped: Evidence) -> None:
    which, values = capped.certificate.multipliers["max_displacement"]
    options = parse_options({**CAPPED, "solver": {"tolerance": 0.1}})
    loose = capped.with_options(options).with_certificate(
        multipliers={"max_displacement": (which, 0.5 * values)}
    )

    assert "stationary" in loose.failed()


def test_a_report_that_flatters_itself_fails(capped: Evidence) -> None:
    claimed = capped.report.certificate
    assert claimed is not None
    flattering = claimed.model_copy(update={"active": {"edge_cap": 0, "max_displacement": 0}})
    report = capped.report.model_copy(update={"certificate": flattering})

    assert replace(capped, report=report).failed() == {"report"}


@pytest.mark.parametrize("data", [b"", b"{}", b"[" * 100_000, b"\xff\xfe"])
def test_what_is_no_report_is_refused(data: bytes) -> None:
    with pytest.raises(InputError, match="not a MeshCone report"):
        read_report(data, "report.json")


@pytest.mark.parametrize(
    ("document", "said"),
    [
        ({"schema": "meshcone.report/9"}, "that this program reads: it is of the schema"),
        ({"schema": "meshcone.report/2", "mode": "measure"}, "nothing was refined"),
        ({"schema": "meshcone.report/2", "mode": "refine"}, "although it says it is one"),
    ],
)
def test_a_report_of_another_kind_is_called_by_its_name(
    document: dict[str, str], said: str
) -> None:
    with pytest.raises(InputError, match=said):
        read_report(json.dumps(document).encode(), "report.json")


def test_no_solver_is_needed(capped: Evidence, tmp_path: Any) -> None:
    files = {
        "report": capped.report.model_dump_json().encode(),
        "certificate": capped.certificate.to_bytes(),
        "source.obj": capped.source.data,
        "reference.obj": capped.reference.data,
        "refined.obj": capped.refined.data,
    }
    for name, data in files.items():
        (tmp_path / name).write_bytes(data)
    program = """
import sys
sys.modules["scs"] = sys.modules["cvxpy"] = None  # importing them is an error now
from pathlib import Path
from meshcone.files import MeshFile
from meshcone.verbs.verify import read_report, verify
report, *rest = (MeshFile(name, Path(name).read_bytes()) for name in sys.argv[1:])
print(verify(read_report(report.data, report.name), *rest).ok)
"""

    answer = subprocess.run(
        [sys.executable, "-c", program, *files],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )

    assert (answer.stdout.strip(), answer.stderr) == ("True", "")
