"""Gate files: what they may say, and which gates an asset has to pass."""

from __future__ import annotations

import json

import pytest

from meshcone.errors import InputError
from meshcone.gates.files import GateFile, parse_gate_file

EXAMPLE = """
unit = "mm"

[gates]
"point_to_surface.p95" = { max = 0.002 }
"validity.non_manifold_edges" = { max = 0 }
"normal_consistency" = { min_ratio_to_floor = 0.98, severity = "warning" }

[classes.heroes]
match = ["hero_*", "characters/*"]
without = ["normal_consistency"]

[classes.heroes.gates]
"point_to_surface.p95" = { max = 0.001 }
"point_to_surface.max" = { max_model = 2.0 }
"""


def parsed(text: str) -> GateFile:
    return parse_gate_file("gates.toml", text.encode(), "measure")


def test_a_gate_holds_for_every_asset() -> None:
    rules = parsed(EXAMPLE).for_asset("props/barrel.glb")

    assert set(rules) == {
        "point_to_surface.p95",
        "validity.non_manifold_edges",
        "normal_consistency",
    }
    assert rules["point_to_surface.p95"].bounds() == {"max": 0.002}
    assert rules["normal_consistency"].severity == "warning"


@pytest.mark.parametrize("asset", ["hero_knight.glb", "props/hero_cup.glb", "characters/elf.obj"])
def test_a_class_adds_replaces_and_takes_back(asset: str) -> None:
    rules = parsed(EXAMPLE).for_asset(asset)

    assert rules["point_to_surface.p95"].bounds() == {"max": 0.001}
    assert rules["point_to_surface.max"].bounds() == {"max_model": 2.0}
    assert "normal_consistency" not in rules


def test_a_glob_without_a_slash_is_held_against_the_last_part_of_a_name() -> None:
    assert "point_to_surface.max" not in parsed(EXAMPLE).for_asset("hero_set/barrel.glb")


def test_of_two_classes_the_later_decides() -> None:
    file = parsed(
        """
        [classes.a]
        match = ["*"]
        gates.fscore = { min = 0.1 }
        [classes.b]
        match = ["*.obj"]
        gates.fscore = { min = 0.2 }
        """
    )

    assert file.for_asset("x.obj")["fscore"].min == 0.2
    assert file.for_asset("x.glb")["fscore"].min == 0.1


def test_the_unit_of_the_file_is_that_of_its_gates() -> None:
    assert {rule.unit for rule in parsed(EXAMPLE).for_asset("a.obj").values()} == {"mm"}


def test_the_unit_of_a_file_is_not_that_of_sizes_in_its_base() -> None:
    base = parsed("gates.'asset.size.height'.max = 2")
    own = b"unit = 'mm'\ngates.'deviation.max'.max_model = 2"

    rules = parse_gate_file("own.toml", own, "measure", base).for_asset("a.glb")

    assert rules["deviation.max"].unit == "mm"
    assert rules["asset.size.height"].unit is None


def test_dots_need_no_quotes() -> None:
    file = parsed("[gates]\npoint_to_surface.p95 = { max = 1 }\nvalidity.watertight.equals = true")

    assert list(file.gates) == ["point_to_surface.p95", "validity.watertight"]


def test_json_says_the_same() -> None:
    text = json.dumps({"gates": {"point_to_surface.p95": {"max": 0.002}}})

    file = parse_gate_file("gates.json", text.encode(), "measure")

    assert file.for_asset("a.obj")["point_to_surface.p95"].max == 0.002


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('"emd" = { max = 1 }', "unknown key 'emd'; gates stand in a table [gates]"),
        ("[gate]", "unknown key 'gate'; did you mean 'gates'?"),
        ("gates.fscore.maxx = 1", "unknown key 'maxx' in 'gates.fscore'; did you mean 'max'?"),
        ("gates.fscor.max = 1", "unknown gate 'fscor'; did you mean 'fscore'?"),
        ('gates."validity.watertigt".equals = true', "did you mean 'validity.watertight'?"),
        ('gates.fscore.max = "1"', "'max' in 'gates.fscore': input should be a valid number"),
        ("gates.fscore.max = nan", "should be a finite number"),
        ("gates.fscore.max = true", "should be a valid number"),
        ("gates.fscore = 1", "'fscore' in 'gates'"),
        ("gates.fscore = {}", "needs a bound"),
        ("gates = 3", "'gates': expected a table, found the number 3"),
        ("classes.a = 3", "'a' in 'classes': expected a table, found the number 3"),
        ("[classes.a]\nmatch = 'x'", "'match' in 'classes.a': expected a list, found the text 'x'"),
        (
            "gates.point_to_surface.max = 0.1",
            "gate 'point_to_surface.max' must be a table of bounds",
        ),
        (
            "gates.'point_to_surface.max' = 0.1",
            "'point_to_surface.max' in 'gates': must be a table of bounds",
        ),
        ("gates.validity.watertight = true", "'validity.watertight': must be a table of bounds"),
        ('gates.fscore.severity = "error"', "needs a bound"),
        ('gates.fscore = { max = 1, severity = "eror" }', "'error' or 'warning'"),
        ("gates.fscore.max_model = 1", "'max_model' is for distances"),
        ("gates.fscore = { max = 1, unit = 'mm' }", "leave unit = 'mm' away"),
        (
            "gates.'deviation.area_beyond' = { tolerance = 0.1, max = 1, unit = 'mm' }",
            "a unit is for lengths",
        ),
        (
            "unit = 'mm'\ngates.'asset.size.height'.max = 800",
            "gate 'asset.size.height': 'max' is in the unit of the file, and the unit here is 'mm'",
        ),
        (
            "unit = 'mm'\n[classes.a]\nmatch = ['*']\ngates.'asset.size.height'.min = 800",
            "write min_model",
        ),
        (f"gates.{'a.' * 5000}max = 1", "'gates': is nested too deeply"),
        (
            '[gates]\n"asset.uv.missing" = {max = 0}\n[gates.asset.uv.missing]\nmin = 1',
            "'gates': has 'asset.uv.missing' twice, in quotes and as tables: write it once",
        ),
        ("gates.'options.surface.regions'.equals = 'auto'", "unknown gate"),
        ("gates.'options.scene'.max = 1", "unknown gate"),
        ("gates.fscore.equals = true", "'equals' is for words and yes-or-no values"),
        ('gates."validity.watertight".max = 1', "'max' is for numbers"),
        ('gates."inputs.source.bytes".max_ratio_to_floor = 1', "is for metrics"),
        ("gates.emd.max_ratio_to_input = 1", "'max_ratio_to_input' is for refined meshes"),
        ("gates.outcome.equals = 'diferent'", "never \"diferent\"; did you mean 'different'?"),
        ("gates.outcome.one_of = ['improved']", 'the value is never "improved"'),
        ("gates.outcome.equals = true", "the value is never true"),
        ('gates."validity.watertight".equals = "yes"', "a yes-or-no value: true or false"),
        ("gates.'solver.iterations'.max = 9", "only a refinement has this value"),
        ("[classes.a]\nmach = ['*']", "unknown key 'mach' in 'classes.a'; did you mean 'match'?"),
        ("[classes.a.gates]\nemd.max = 1", "'match' in 'classes.a'"),
        (
            "gates.emd.max = 1\n[classes.a]\nmatch = ['*']\nwithout = ['end']",
            "'end', which is no gate of all assets; did you mean 'emd'?",
        ),
        ("gates.warnings.normals.oposed.max = 0", "did you mean 'warnings.normals.opposed'?"),
        ("gates.warnings.equals = true", "'equals' is for words and yes-or-no values"),
        ("", "there is no gate in it"),
        ("[gates", "is no valid TOML"),
    ],
)
def test_what_it_cannot_mean_is_refused_by_name(text: str, said: str) -> None:
    with pytest.raises(InputError) as refusal:
        parsed(text)

    assert said in refusal.value.message
    assert refusal.value.file == "gates.toml"


def test_a_gate_that_is_there_twice_loses_neither_of_its_bounds() -> None:
    text = b'{"gates": {"emd": {"max": 1}, "emd": {"max": 2}}}'

    with pytest.raises(InputError, match="'emd' is there twice in one object"):
        parse_gate_file("gates.json", text, "measure")


def test_broken_json_is_refused_with_its_place() -> None:
    with pytest.raises(InputError, match=r"is no valid JSON: .*line 1"):
        parse_gate_file("gates.json", b"{", "measure")


def test_a_refinement_has_gates_a_measurement_has_not() -> None:
    text = b"gates.outcome.one_of = ['improved']\ngates.emd.max_ratio_to_input = 0.5"

    file = parse_gate_file("gates.toml", text, "refine")

    assert set(file.gates) == {"outcome", "emd"}
