"""Changes to JSON text touch nothing but what they are about."""

from __future__ import annotations

import json

import pytest

from meshcone.assets.gltf.splice import JsonChanges, change_json

TEXT = '{ "a" : 1.50,\n  "b": [1, {"c": "x,]"}], "d": {} ,"e":[ ],"f": null }'


def changed(**changes) -> str:
    return change_json(TEXT, JsonChanges(**changes))


def test_a_value_is_replaced_in_place():
    assert changed(replaced={("b", 1, "c"): '"y"'}) == TEXT.replace('"x,]"', '"y"')


@pytest.mark.parametrize(
    ("removed", "left"),
    [
        ({("a",)}, ["b", "d", "e", "f"]),
        ({("f",)}, ["a", "b", "d", "e"]),
        ({("a",), ("b",)}, ["d", "e", "f"]),
        ({("e",), ("f",)}, ["a", "b", "d"]),
        ({("b",), ("e",)}, ["a", "d", "f"]),
        ({("a",), ("b",), ("d",), ("e",), ("f",)}, []),
    ],
)
def test_members_leave_with_their_commas(removed, left):
    assert list(json.loads(changed(removed=removed))) == left


def test_entries_are_put_behind_the_last_one():
    added = {("b",): ["2", "3"], ("d",): ['"g": 4'], ("e",): ["5"], (): ['"h": 6']}
    assert json.loads(changed(added=added)) == {
        **json.loads(TEXT),
        "b": [1, {"c": "x,]"}, 2, 3],
        "d": {"g": 4},
        "e": [5],
        "h": 6,
    }


def test_a_member_can_leave_while_another_comes():
    after = changed(removed={("b", 1, "c")}, added={("b", 1): ['"new": 1']})
    assert json.loads(after)["b"] == [1, {"new": 1}]


def test_the_last_member_can_leave_while_another_comes():
    after = changed(removed={("f",)}, added={(): ['"new": 1']})
    assert list(json.loads(after)) == ["a", "b", "d", "e", "new"]


def test_a_path_that_is_not_there_is_an_error():
    with pytest.raises(KeyError):
        changed(removed={("z",)})


def test_a_byte_order_mark_stays_where_it_is():
    changes = JsonChanges(added={(): ['"h": 6']}, removed={("a",)})
    assert change_json("\ufeff" + TEXT, changes) == "\ufeff" + change_json(TEXT, changes)


def test_what_is_not_changed_keeps_its_characters():
    assert changed() == TEXT
