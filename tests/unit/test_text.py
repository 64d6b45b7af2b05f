"""What one line can show, and what divides it into words."""

from __future__ import annotations

import pytest

from meshcone.text import as_line, is_line, words_of

OF_A_NAME = {
    "a no-break space": "Mug\u00a0v2",
    "a narrow no-break space": "Mug\u202fv2",
    "an ideographic space": "杯\u3000二",
    "a joiner between letters": "श्\u200dर",
    "a non-joiner between letters": "\u0645\u06cc\u200c\u062e",
    "a soft hyphen": "Kaffee\u00adtasse",
    "joined emoji": "👩\u200d🚀",
    "a mark of direction": "\u05d0\u200f1",
    "a letter of private use": "\ue000",
}
OF_NO_LINE = {
    "a line feed": "a\nb",
    "a tab": "a\tb",
    "a next line": "a\x85b",
    "an escape": "a\x1bb",
    "a line separator": "a\u2028b",
    "a paragraph separator": "a\u2029b",
    "an override of direction": "a\u202eb",
    "an isolate of direction": "a\u2066b",
    "half a character": "a\ud800b",
    "no character": "a\uffffb",
}


@pytest.mark.parametrize("name", OF_A_NAME.values(), ids=OF_A_NAME)
def test_what_people_write_in_names_is_part_of_a_line(name: str) -> None:
    assert is_line(name)
    assert as_line(name) == name


@pytest.mark.parametrize("text", OF_NO_LINE.values(), ids=OF_NO_LINE)
def test_what_no_line_can_show_is_left_out_or_replaced(text: str) -> None:
    assert not is_line(text)
    assert as_line(text) == "ab"
    assert as_line(text, "?") == "a?b"


def test_blanks_and_tabs_divide_words_and_other_spaces_do_not() -> None:
    assert words_of(" a\u00a0b.mtl \t c\u3000d.mtl\t") == ["a\u00a0b.mtl", "c\u3000d.mtl"]
