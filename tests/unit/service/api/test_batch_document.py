"""A batch's document, read a pair at a time."""

from __future__ import annotations

import io
import json
from typing import IO, Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from meshcone.errors import InputError, LimitError
from meshcone.options import Options
from meshcone.text import is_line
from service.api.submission.batch_document import BatchDocument
from service.settings import ServiceSettings

SETTINGS = ServiceSettings()
PAIR = {
    "source": {"url": "https://assets.example.org/mug.glb"},
    "reference": {"url": "https://assets.example.org/scan.glb"},
}
LINE = st.characters(codec="utf-8").filter(is_line)
SPACE = st.text(" \n\t\r", max_size=3)


def options_of(common: Any, *own: Any) -> list[Options]:
    pairs = [{**PAIR, "options": each} for each in own]
    found = document(json.dumps({"options": common, "pairs": pairs}))
    return [form.options for _, form in found.pairs()]


class Trickle(io.BytesIO):
    """A file that gives a few bytes at a time, however many are asked for."""

    def read(self, size: int | None = -1, /) -> bytes:  # noqa: ARG002
        return super().read(3)


def document(text: str | bytes, kind: type[io.BytesIO] = io.BytesIO) -> BatchDocument:
    file: IO[bytes] = kind(text.encode() if isinstance(text, str) else text)
    return BatchDocument(file, SETTINGS)


def names(found: BatchDocument) -> list[str | None]:
    return [name for name, _ in found.pairs()]


@given(
    st.lists(st.text(LINE, min_size=1, max_size=20), min_size=1, max_size=5),
    st.booleans(),
    SPACE,
    st.booleans(),
)
def test_every_pair_is_read_whatever_the_spelling(
    given_names: list[str], pairs_first: bool, space: str, ascii_only: bool
) -> None:
    pairs = [{**PAIR, "name": name} for name in given_names]
    parts: list[tuple[str, Any]] = [("labels", ["a"]), ("pairs", pairs)]
    content = dict(reversed(parts) if pairs_first else parts)
    text = json.dumps(content, ensure_ascii=ascii_only, separators=(f",{space}", f"{space}:"))

    found = document(f"{space}{text}{space}".encode("utf-8", "surrogatepass"), Trickle)

    assert names(found) == given_names
    assert found.count == len(given_names)
    assert found.header.labels == ("a",)


@given(st.integers(0, 200))
def test_a_text_that_is_cut_short_is_refused(length: int) -> None:
    text = json.dumps({"name": "night", "pairs": [{**PAIR, "name": "mug"}]})

    with pytest.raises(InputError):
        document(text[: min(length, len(text) - 1)])


@pytest.mark.parametrize(
    "text",
    [
        '{"pairs": [1,]}',
        '{"pairs": [1] "name": "a"}',
        '{"pairs": [1]} x',
        "{1: 2}",
        '{"pairs": [1], "pairs": [2]}',
        '{"pairs": [' + "[" * 100_000,
        b'{"name": "\xff", "pairs": [1]}',
        "",
    ],
)
def test_what_is_no_such_json_is_refused(text: str | bytes) -> None:
    with pytest.raises(InputError):
        document(text)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            '{"gates": {"deviation.max": {"max": 1}, "deviation.max": {"max": 9}}, "pairs": [1]}',
            "field 'gates': 'deviation.max' is there twice in one object",
        ),
        ('{"pairs": [1, {"name": "a", "name": "b"}]}', r"pairs\[1\]: 'name' is there twice"),
    ],
)
def test_what_a_reader_would_drop_in_silence_is_refused(text: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        document(text.encode(), Trickle)


@pytest.mark.parametrize(
    "name", ["", "x" * 201, "a\nb", "\x00", "\ud800", 7], ids=lambda name: ascii(name)[:10]
)
def test_a_name_is_one_short_line_that_can_be_written(name: Any) -> None:
    with pytest.raises(InputError, match=r"^field 'name': "):
        document(json.dumps({"name": name, "pairs": [PAIR]}))

    with pytest.raises(InputError, match=r"^pairs\[1\]: field 'name': must be one line"):
        names(document(json.dumps({"pairs": [PAIR, {**PAIR, "name": name}]})))


def test_a_pair_that_is_too_long_is_refused_before_it_is_read_whole() -> None:
    class Endless(io.BytesIO):
        given = 0

        def read(self, size: int | None = -1, /) -> bytes:
            if self.given == 0:
                self.given = 1
                return b'{"pairs": ["'
            self.given += size or 0
            return b"a" * (size or 0)

    file = Endless()
    with pytest.raises(LimitError, match="a pair is longer"):
        BatchDocument(file, SETTINGS)

    assert file.given < 4 * 1024 * 1024


LONG = json.dumps([PAIR] * 9_999)[1:]  # more than a pair may have


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('{"pairs": [{"name": "a" "source": 1}, ' + LONG, "pairs[0]: is not valid JSON: expecting"),
        ('{"pairs": [' + LONG[:-1] + ", {'name': 1}]}", "pairs[9999]: is not valid JSON"),
        ('{"pairs": [{"name": "a\nb"}, ' + LONG, "pairs[0]: is not valid JSON: invalid control"),
        ('{"pairs": [{"name": "\\x"}, ' + LONG, "pairs[0]: is not valid JSON: invalid \\escape"),
        ('{"pairs": [' + "[" * 20_000 + LONG, "pairs[0]: is nested too deeply"),
        ('{"pairs": [' + "1" * 5000 + ", " + LONG, "pairs[0]: a number in it has too many digits"),
        ('{"pairs": [1 2, ' + LONG, "pairs[0]: ',' or ']' has to follow it, found '2'"),
        ('{"pairs": [1', "pairs[0]: ',' or ']' has to follow it, found the end of the request"),
        ('{"pairs": [tru', "pairs[0]: is not valid JSON: expecting value at its character 1"),
        ('{"options": {"a": 1,}, "pairs": [1]}', "field 'options': is not valid JSON"),
        ('{"name" 1}', "the name of field 'name': ':' has to follow it, found '1'"),
        ('{"name": "a" "pairs": [1]}', """field 'name': ',' or '}' has to follow it, found '"'"""),
    ],
    ids=range(12),
)
def test_what_is_wrong_with_a_long_batch_is_said_with_its_place(text: str, said: str) -> None:
    with pytest.raises(InputError) as caught:
        document(text)

    assert caught.value.message.startswith(said)


@pytest.mark.parametrize("number", ["NaN", "-Infinity", "1e999"])
def test_a_number_that_is_not_finite_is_refused_as_in_a_job(number: str) -> None:
    with pytest.raises(InputError, match=rf"^pairs\[0\]: {number} is "):
        document('{"pairs": [{"options": {"seed": ' + number + "}}]}", Trickle)


def test_the_fingerprint_is_of_the_content_and_not_of_its_spelling() -> None:
    first = document(json.dumps({"name": "a", "pairs": [PAIR, {**PAIR, "name": "b"}]}))
    respelled = document(
        json.dumps({"pairs": [PAIR, {"name": "b", **PAIR}], "name": "a"}, indent=1)
    )
    turned = document(json.dumps({"name": "a", "pairs": [{**PAIR, "name": "b"}, PAIR]}))

    assert first.fingerprint == respelled.fingerprint != turned.fingerprint


def test_equal_options_of_pairs_are_parsed_once() -> None:
    first, second, other = options_of({"mode": "measure"}, {}, {}, {"align": "rigid"})

    assert first is second
    assert (other.mode, first.align, other.align) == ("measure", "none", "rigid")
