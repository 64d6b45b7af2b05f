"""The JSON document of a batch, read a pair at a time.

Of a document with ten thousand pairs, one is in memory at a time; the rest is in a temporary file.
"""

from __future__ import annotations

import codecs
import hashlib
import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import IO, Any

from pydantic import ValidationError

from meshcone.errors import InputError, LimitError, MeshConeError
from meshcone.json_text import DuplicateNameError, NotFiniteError, part_decoder
from meshcone.options import Options, parse_options
from meshcone.suggestions import first_cause, in_words
from meshcone.text import is_line
from service.api.batch_schemas import NAME_LENGTH, BatchHeader
from service.api.submission.document import DOCUMENT_BYTES, submission_in
from service.api.submission.parts import SubmittedForm
from service.settings import ServiceSettings

_READ_AT_ONCE = 64 * 1024  # bytes
_PAIRS = "pairs"
_SPACE = " \t\n\r"
_LONGEST_WORD = len("-Infinity")  # of the words, escapes and signs that can be cut


class BatchDocument:
    """A batch as it was sent.

    Attributes:
        header: what its pairs have in common.
        count: how many pairs it has.
        fingerprint: the same for the same content, and for no other.

    Args:
        file: the document, read from its beginning, time and again.
        settings: how many pairs it may have, and where files may be.

    Raises:
        InputError: it is no batch.
        LimitError: it has too many pairs, or one is too long.
    """

    def __init__(self, file: IO[bytes], settings: ServiceSettings) -> None:
        self._file = file
        self._settings = settings
        self._parsed: tuple[str, Options] | None = None
        fields: dict[str, Any] = {}
        digest, self.count = hashlib.sha256(), 0
        for name, value in _members(file):
            if name == _PAIRS:
                digest.update(_canonical(value))
                self.count += 1
            else:
                fields[name] = value
            if self.count > settings.batch_pairs:
                raise LimitError(
                    f"the batch has more than the {settings.batch_pairs} pairs accepted here "
                    "(MESHCONE_BATCH_PAIRS)"
                )
        if not self.count:
            raise InputError("field 'pairs': send a list with a pair at least")
        self.header = _header(fields)
        digest.update(_canonical(fields))
        self.fingerprint = digest.hexdigest()

    def pairs(self) -> Iterator[tuple[str | None, SubmittedForm]]:
        """Each pair: what it is called, and the job that it describes.

        Raises:
            InputError: one cannot be used; it says which.
            LimitError: one has too much of something.
        """
        values = (value for name, value in _members(self._file) if name == _PAIRS)
        for index, value in enumerate(values):
            with naming_pair(index):
                pair = self._pair(value)
            yield pair

    def _pair(self, value: Any) -> tuple[str | None, SubmittedForm]:
        if not isinstance(value, dict):
            raise InputError("a pair is a JSON object")
        own, header = dict(value), self.header
        name = own.pop("name", None)
        _require_line(name)
        options, labels = own.get("options", {}), own.get("labels", [])
        if isinstance(options, dict):  # else what is wrong with it is said below
            common = header.options
            if header.gates is not None:
                common = {**common, "gates": header.gates}
            own["options"] = _merged(common, options)
        if isinstance(labels, list):
            own["labels"] = [*header.labels, *labels]
        return name, submission_in(own, self._settings, self._options)

    def _options(self, sent: dict[str, Any]) -> Options:
        """Options parsed; most pairs have those of the one before, of which a long list is slow."""
        text = json.dumps(sent)  # to which 1, 1.0 and true are not equal
        if self._parsed is None or self._parsed[0] != text:
            self._parsed = text, parse_options(sent)
        return self._parsed[1]


@contextmanager
def naming_pair(index: int) -> Iterator[None]:
    """Have an error about a pair of a batch say which one it is about."""
    try:
        yield
    except MeshConeError as error:
        raise type(error)(f"pairs[{index}]: {error.message}", file=error.file) from None


def _header(fields: Mapping[str, Any]) -> BatchHeader:
    try:
        header = BatchHeader.model_validate(fields)
    except ValidationError as error:
        cause = first_cause(error)
        path = ".".join(str(part) for part in cause["loc"])
        if cause["type"] == "extra_forbidden":
            known = ", ".join((*BatchHeader.model_fields, _PAIRS))
            raise InputError(f"unknown field '{path}'; the fields are {known}") from None
        raise InputError(
            f"field '{path}': {in_words(cause)}" if path else in_words(cause)
        ) from None
    _require_line(header.name)
    if header.gates is not None and "gates" in header.options:
        raise InputError("the batch has 'gates' and options with 'gates': leave one of them out")
    return header


def _require_line(name: Any) -> None:
    """Refuse a name that lists and reports could not show; half a character is in no answer."""
    if name is None or (isinstance(name, str) and is_line(name) and 0 < len(name) <= NAME_LENGTH):
        return
    raise InputError(f"field 'name': must be one line of up to {NAME_LENGTH} characters")


def _merged(common: Mapping[str, Any], own: Mapping[str, Any]) -> dict[str, Any]:
    """Options of a pair over those of all; sections are merged, gates are replaced as a whole."""
    merged = {**common, **own}
    for name in common.keys() & own.keys() - {"gates"}:
        if isinstance(common[name], dict) and isinstance(own[name], dict):
            merged[name] = _merged(common[name], own[name])
    return merged


def _canonical(value: Any) -> bytes:
    try:
        return json.dumps(value, sort_keys=True).encode() + b"\n"
    except RecursionError:
        raise InputError("the request is nested too deeply") from None


def _members(file: IO[bytes]) -> Iterator[tuple[str, Any]]:
    """The members of the object in a file; of `pairs` each element, as a member of that name."""
    file.seek(0)
    text = _Text(file)
    text.expect("{")
    seen = set()
    closes = text.skip("}")
    while not closes:
        name = text.value("the name of a field")
        if not isinstance(name, str):
            raise _no_json()
        if name in seen:
            raise InputError(f"field '{name}' is there twice")
        seen.add(name)
        text.expect(":", after=f"the name of field '{name}'")
        if name == _PAIRS and text.skip("["):
            ends, index = text.skip("]"), 0
            while not ends:
                yield name, text.value(f"pairs[{index}]")
                ends = text.skip("]")
                if not ends:
                    text.expect(",", after=f"pairs[{index}]", other="]")
                index += 1
        elif name == _PAIRS:
            raise InputError("field 'pairs': send a list with a pair at least")
        else:
            yield name, text.value(f"field '{name}'")
        closes = text.skip("}")
        if not closes:
            text.expect(",", after=f"field '{name}'", other="}")
    text.expect_end()


class _Text:
    """A JSON text, of which a part is in memory at a time."""

    def __init__(self, file: IO[bytes]) -> None:
        self._file = file
        self._decoder = codecs.getincrementaldecoder("utf-8")()
        self._json = part_decoder()
        self._text, self._at, self._ended = "", 0, False

    def skip(self, character: str) -> bool:
        """Whether this character is next; it is passed then."""
        if self._next() != character:
            return False
        self._at += 1
        return True

    def expect(self, character: str, *, after: str = "", other: str = "") -> None:
        """Pass a character that has to be next, or else another would have had to be.

        Raises:
            InputError: it is not; it says what it should have followed.
        """
        if self.skip(character):
            return
        if not after:
            raise _no_json()
        wanted = f"'{character}' or '{other}'" if other else f"'{character}'"
        found = self._next()
        there_is = f"found {found!a}" if found else "found the end of the request"
        raise InputError(f"{after}: {wanted} has to follow it, {there_is}")

    def expect_end(self) -> None:
        """Refuse whatever follows."""
        if self._next():
            raise _no_json()

    def value(self, place: str) -> Any:
        """The value that is next.

        Raises:
            InputError: it is no JSON, has a number that is not finite, or an object in it has a
                name twice; it says at what place.
            LimitError: it is too long.
        """
        self._next()
        while True:
            try:
                value, end = self._json.raw_decode(self._text, self._at)
            except (DuplicateNameError, NotFiniteError) as error:
                raise InputError(f"{place}: {error}") from None
            except RecursionError:
                raise InputError(f"{place}: is nested too deeply") from None
            except json.JSONDecodeError as error:
                if self._ended or not self._may_go_on(error):
                    raise self._not_valid(place, error) from None
            except ValueError:  # of an integer with more digits than Python reads
                raise InputError(f"{place}: a number in it has too many digits") from None
            else:
                # What ends with the part that is here could go on, as a number does.
                if self._ended or end < len(self._text):
                    self._at = end
                    return value
            if len(self._text) - self._at > DOCUMENT_BYTES:
                raise LimitError(f"a pair is longer than the {DOCUMENT_BYTES} bytes accepted here")
            self._read(len(self._text) - self._at)

    def _may_go_on(self, error: json.JSONDecodeError) -> bool:
        """Whether a value is no JSON yet for all that is known: what is wrong is at its end."""
        is_string = error.msg.startswith("Unterminated string")  # told with where it begins
        return is_string or error.pos >= len(self._text) - _LONGEST_WORD

    def _not_valid(self, place: str, error: json.JSONDecodeError) -> InputError:
        at = error.pos - self._at + 1
        return InputError(f"{place}: is not valid JSON: {error.msg.lower()} at its character {at}")

    def _next(self) -> str:
        while True:
            while self._at < len(self._text) and self._text[self._at] in _SPACE:
                self._at += 1
            if self._at < len(self._text):
                return self._text[self._at]
            if self._ended:
                return ""
            self._read(0)

    def _read(self, least: int) -> None:
        """Have more of the text; as much again as is here, so that a long value is soon whole."""
        data = self._file.read(max(_READ_AT_ONCE, least))
        self._ended = not data
        try:
            more = self._decoder.decode(data, final=self._ended)
        except UnicodeDecodeError:
            raise InputError("the request is not UTF-8") from None
        self._text, self._at = self._text[self._at :] + more, 0


def _no_json() -> InputError:
    return InputError("the request is not a JSON object of a batch")
