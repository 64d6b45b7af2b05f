"""Levels of detail: what names say, and gates with a bound for each level."""

from __future__ import annotations

import pytest

from meshcone.errors import InputError
from meshcone.gates.files import parse_gates
from meshcone.gates.levels import level_of, split_level

GATES = {
    "gates": {
        "inputs.source.faces": {"max": [500, 250, 100], "min": 1},
        "point_to_surface.max": {"max": 0.1},
    }
}


@pytest.mark.parametrize(
    ("name", "split"),
    [
        ("rock_LOD2", ("rock", 2)),
        ("rock-lod12", ("rock", 12)),
        ("old rock Lod_1", ("old rock", 1)),
        ("rock.LOD0", ("rock", 0)),
        ("LOD3", ("", 3)),
        ("rock", ("rock", None)),
        ("explod2", ("explod2", None)),
        ("rock_LOD2_final", ("rock_LOD2_final", None)),
        ("rock_LOD", ("rock_LOD", None)),
    ],
)
def test_a_level_stands_at_the_end_of_a_name(name: str, split: tuple[str, int | None]) -> None:
    assert split_level(name) == split


def test_the_level_of_a_file_is_that_of_its_name_without_folder_and_extension() -> None:
    assert level_of("props_LOD1/rock_LOD2.glb") == 2
    assert level_of("props_LOD1/rock.glb") is None


@pytest.mark.parametrize(("level", "most"), [(1, 500), (2, 250), (3, 100)])
def test_each_level_has_the_bound_of_its_place_in_the_list(level: int, most: float) -> None:
    rules = parse_gates(GATES, "measure").for_asset("rock.glb", level)

    assert rules["inputs.source.faces"].bounds() == {"max": most, "min": 1}
    assert rules["point_to_surface.max"].bounds() == {"max": 0.1}


def test_a_list_for_one_level_is_for_no_other() -> None:
    file = parse_gates({"gates": {"emd": {"max": [0.1]}}}, "measure")

    assert file.for_asset("a.glb", 1)["emd"].max == 0.1
    with pytest.raises(InputError):
        file.for_asset("a.glb", 2)


@pytest.mark.parametrize(
    ("level", "said"),
    [
        (None, "'rock.glb' has no level: end its name in _LOD1"),
        (0, "levels of detail 1 to 3, but 'rock.glb' is level 0"),
        (4, "levels of detail 1 to 3, but 'rock.glb' is level 4"),
    ],
)
def test_a_level_without_a_bound_is_refused(level: int | None, said: str) -> None:
    with pytest.raises(InputError) as refusal:
        parse_gates(GATES, "measure").for_asset("rock.glb", level)

    assert said in refusal.value.message


@pytest.mark.parametrize(
    ("rule", "said"),
    [
        ({"max": [1, 2], "min": [0]}, "one number for each level of detail"),
        ({"max": []}, "one number for each level of detail"),
        ({"max": [1, "2"]}, "'max' in 'gates.emd': input should be a valid number"),
        ({"max": [[1]]}, "'max' in 'gates.emd': input should be a valid number"),
        ({"max": [1], "maxx": 2}, "unknown key 'maxx' in 'gates.emd'; did you mean 'max'?"),
    ],
)
def test_lists_that_mean_nothing_are_refused(rule: dict[str, object], said: str) -> None:
    with pytest.raises(InputError) as refusal:
        parse_gates({"gates": {"emd": rule}}, "measure")

    assert said in refusal.value.message


def test_a_bound_of_any_level_has_to_fit_its_value() -> None:
    rule = {"max_model": [1, 2]}

    with pytest.raises(InputError, match="'max_model' is for distances"):
        parse_gates({"gates": {"fscore": rule}}, "measure")
