"""Gates on whole assets: values by path, ratios to the reference, lists of words."""

from __future__ import annotations

from typing import Any

import pytest

from meshcone.errors import InputError
from meshcone.files import MeshFile
from meshcone.gates.fitting import require_known
from meshcone.gates.judge import judge
from meshcone.gates.records import GateCheck
from meshcone.options import parse_options
from meshcone.report.report import AuditReport
from meshcone.verbs.audit import audit
from meshcone.verbs.measure import measure
from meshcone.verbs.refine import refine
from tests import shapes
from tests.whole_asset import whole

FEW: dict[str, Any] = {
    "effort": "fast",
    "quality": {"samples": 64, "emd_samples": 16, "curvature_samples": 16},
}


def asset(**changed: Any) -> MeshFile:
    document = whole()
    document.json |= changed
    return MeshFile("a.gltf", document.to_bytes())


def audited(gates: dict[str, Any], reference: MeshFile | None = None) -> AuditReport:
    return audit(asset(), reference, parse_options({"mode": "audit", "gates": gates}))


def check(key: str, rule: dict[str, Any], reference: MeshFile | None = None) -> GateCheck:
    verdict = audited({key: rule}, reference).gates
    assert verdict is not None
    [found] = verdict.checks
    return found


def with_animations(*names: str) -> MeshFile:
    document = whole()
    first = document.json["animations"][0]
    document.json["animations"] += [
        # Channels differ, or these would be another name for the first one.
        {**first, "name": name, "channels": [{**first["channels"][0], "target": {"path": name}}]}
        for name in names
    ]
    return MeshFile("reference.gltf", document.to_bytes())


def test_a_small_volume_is_not_rounding() -> None:
    """A cube of 0.9 mm, in metres."""
    corners = [(x, y, z) for x in (0, 9e-4) for y in (0, 9e-4) for z in (0, 9e-4)]
    faces = ["1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4"]
    lines = [f"v {x} {y} {z}" for x, y, z in corners]
    lines += [f"f {face}" for face in faces]
    options = parse_options({"mode": "audit", "gates": {"asset.geometry.volume": {"max": 0}}})

    verdict = audit(MeshFile("cube.obj", "\n".join(lines).encode()), None, options).gates

    assert verdict is not None
    assert verdict.checks[0].value == pytest.approx(7.29e-10)
    assert verdict.verdict == "fail"


@pytest.mark.parametrize(
    ("key", "rule", "status"),
    [
        ("asset.budget.triangles", {"max": 4}, "pass"),
        ("asset.budget.triangles", {"max": 3}, "fail"),
        ("asset.source.budget.triangles", {"max": 3}, "fail"),
        ("asset.size.width", {"max_model": 1e3}, "pass"),
        ("asset.size.width", {"max_model": 1e-3}, "fail"),
        ("asset.size.clean_root", {"equals": False}, "pass"),
        ("asset.materials.names", {"all_match": "*"}, "pass"),
        ("asset.materials.names", {"all_match": ["wood*", "paint"]}, "fail"),
        ("asset.materials.names", {"none_match": "*"}, "fail"),
        ("asset.materials.names", {"none_match": ["lambert*", "default*"]}, "pass"),
        ("asset.textures.formats", {"equals": ["png"]}, "pass"),
        ("asset.textures.formats", {"one_of": ["png", "webp"]}, "pass"),
        ("asset.textures.formats", {"one_of": ["webp"]}, "fail"),
        ("asset.budget.extensions_used", {"equals": []}, "fail"),
        ("asset.budget.extensions_required", {"equals": []}, "pass"),
        ("mode", {"equals": "audit"}, "pass"),
        # Nothing to compare with: that is no pass.
        ("changes.lost.uv_sets", {"max": 0}, "not_tested"),
        ("asset.budget.triangles", {"max_ratio_to_reference": 1}, "not_tested"),
    ],
)
def test_values_of_an_asset_are_bounded(key: str, rule: dict[str, Any], status: str) -> None:
    assert check(key, rule).status == status


def test_words_of_a_list_that_do_not_fit_are_named() -> None:
    names = audited({}).asset.source.materials.names

    found = check("asset.materials.names", {"none_match": names[0]})

    assert found.words == f"asset.materials.names: '{names[0]}', must not match '{names[0]}'"
    assert found.value == names


def test_equals_means_the_same_words_in_any_order() -> None:
    names = audited({}).asset.source.materials.names

    for other, status in ((names[::-1], "pass"), (names[1:], "fail"), ((*names, "x"), "fail")):
        assert check("asset.materials.names", {"equals": list(other)}).status == status


@pytest.mark.parametrize(("ratio", "status"), [(0.25, "pass"), (0.24, "fail")])
def test_a_ratio_to_the_reference_is_that_of_the_same_value(ratio: float, status: str) -> None:
    source = MeshFile("low.obj", shapes.obj(*shapes.sphere(1)))
    reference = MeshFile("high.obj", shapes.obj(*shapes.sphere(2)))
    gates = {"asset.budget.triangles": {"max_ratio_to_reference": ratio}}

    verdict = audit(source, reference, parse_options({"mode": "audit", "gates": gates})).gates

    assert verdict is not None
    assert verdict.verdict == status
    assert "32, the reference's 128, allowed" in verdict.checks[0].words


def test_what_was_lost_is_bounded_by_kind() -> None:
    document = whole()
    document.json["meshes"][0]["primitives"][0]["attributes"] |= {"TEXCOORD_1": 2}
    reference = MeshFile("reference.gltf", document.to_bytes())

    assert check("changes.lost.uv_sets", {"max": 0}, reference).status == "fail"
    assert check("changes.lost.animations", {"max": 0}, reference).status == "pass"


def test_without_a_reference_that_is_why_a_change_was_not_tested() -> None:
    words = check("changes.lost.uv_sets", {"max": 0}).words

    assert words.endswith(": not tested, because there is no reference to compare with")


def test_what_was_lost_is_named() -> None:
    words = check("changes.lost.animations", {"max": 0}, with_animations("wave")).words

    assert words == "changes.lost.animations 1, allowed 0: animation 'wave' is missing"


def test_of_much_that_was_lost_the_first_is_named_and_the_rest_is_counted() -> None:
    words = check("changes.lost.animations", {"max": 0}, with_animations(*"abcdefg")).words

    assert words.startswith("changes.lost.animations 7, allowed 0: animation 'a' is missing; ")
    assert words.endswith("; animation 'e' is missing; and 2 more")


def test_what_is_within_its_bound_is_not_named() -> None:
    words = check("changes.lost.animations", {"max": 1}, with_animations("wave")).words

    assert words == "changes.lost.animations 1, allowed 1"


def test_a_length_in_a_gltf_is_told_in_metres() -> None:
    assert check("asset.size.width", {"max_model": 1}).words == "asset.size.width 5 m, allowed 1 m"


def test_an_asset_without_a_side_is_the_refined_one_where_there_is_one() -> None:
    vertices, faces = shapes.sphere(1)
    source = MeshFile("small.obj", shapes.obj(0.9 * vertices, faces))
    reference = MeshFile("ball.obj", shapes.obj(*shapes.sphere(2)))

    refined = refine(source, reference, parse_options(FEW)).report
    measured = measure(source, reference, parse_options(FEW))

    gates = parse_options({"gates": {"asset.size.height": {"min": 3.8}}}).gates
    assert refined.asset is not None
    assert judge(refined, gates).verdict == "pass"
    assert judge(refined, gates).checks[0].path == "asset.refined.size.height"
    assert judge(measured, gates).verdict == "fail"
    assert judge(measured, gates).checks[0].path == "asset.source.size.height"


def test_a_report_without_audits_leaves_their_gates_open() -> None:
    ball = MeshFile("ball.obj", shapes.obj(*shapes.sphere(1)))
    gates = {"asset.budget.triangles": {"max": 1}}

    report = measure(ball, ball, parse_options({**FEW, "audit": False, "gates": gates}))

    assert report.gates is not None
    assert report.gates.verdict == "not_tested"


@pytest.mark.parametrize(
    ("key", "rule", "message"),
    [
        (
            "asset.materials.names",
            {"max": 3},
            "'max' is for numbers; this is a list of words: write equals, one_of, all_match",
        ),
        ("asset.budget.triangles", {"all_match": "*"}, "this is a number: write max or min"),
        ("asset.size.clean_root", {"none_match": "*"}, "write equals = true or equals = false"),
        ("asset.budget.triangles", {"max_model": 3}, "'max_model' is for distances; write max"),
        (
            "asset.budget.triangles",
            {"max_ratio_to_floor": 1},
            "is for metrics; write max_ratio_to_reference",
        ),
        (
            "asset.reference.budget.triangles",
            {"max_ratio_to_reference": 1},
            "is for values of the whole asset, such as 'asset.budget.triangles'",
        ),
        ("asset.materials.names", {"equals": "wood"}, 'a list of words: write a list: equals = ["'),
        ("asset.textures.formats", {"one_of": ["pgn"]}, 'the value is never "pgn"; did you mean'),
        ("asset.budget.triangels", {"max": 1}, "did you mean 'asset.budget.triangles'"),
        ("fscore", {"min": 1}, "only a measurement or a refinement has this value"),
        ("solver.iterations", {"max": 1}, "only a refinement has this value"),
    ],
)
def test_a_bound_that_does_not_fit_is_refused_with_what_to_write(
    key: str, rule: dict[str, Any], message: str
) -> None:
    gates = parse_options({"gates": {key: rule}}).gates

    with pytest.raises(InputError) as refusal:
        require_known(gates, "audit")

    assert message in str(refusal.value)
