"""What somebody is told whose options cannot be used."""

from __future__ import annotations

import pytest

from meshcone.errors import InputError
from meshcone.options import parse_options_json


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (
            '{"surface.edge_cap": 3}',
            'unknown option \'surface.edge_cap\'; write it as {"surface": {"edge_cap": …}}',
        ),
        (
            '{"gates": {"emd": {"max": 1}, "emd": {"max": 2}}}',
            "options: 'emd' is there twice in one object; keep one of the two",
        ),
        (
            '{"cones": {"pin.vertices": [1]}}',
            "unknown option 'cones.pin.vertices'; write it as "
            '{"cones": {"pin": {"vertices": …}}}',
        ),
        (
            '{"surface.edgecap": 3}',
            'unknown option \'surface.edgecap\'; write it as {"surface": {"edge_cap": …}}',
        ),
        ('{"a.b": 1}', "unknown option 'a.b'"),
        ('{"edge_cap": 1}', "unknown option 'edge_cap'; did you mean 'cones.edge_cap'?"),
        (
            '{"gates": {"point_to_surface.max": 0.1}}',
            "option 'gates.point_to_surface.max': expected bounds, such as "
            '{"max": 0.01}, found the number 0.1',
        ),
        ('{"gates": {"emd": null}}', "found null"),
        ('{"gates": ["emd"]}', "option 'gates': expected an object with names and values, found"),
        (
            '{"surface": true}',
            "option 'surface': expected an object with names and values, found true",
        ),
        (
            '{"select": {"nodes": "a"}}',
            "option 'select.nodes': expected a list, found the text 'a'",
        ),
        ('{"select": {"nodes": 2}}', "expected a list, found the number 2"),
    ],
)
def test_a_value_of_the_wrong_kind_is_explained_without_our_own_names(
    options: str, said: str
) -> None:
    with pytest.raises(InputError) as refusal:
        parse_options_json(options)

    assert said in refusal.value.message
