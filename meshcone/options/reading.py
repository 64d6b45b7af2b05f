"""Options as callers write them: JSON, and ``key=value`` on a command line."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from pydantic import BaseModel, ValidationError

from meshcone.errors import InputError
from meshcone.gates.rules import GateRule
from meshcone.json_text import DuplicateNameError, parse_json
from meshcone.options.everything import Options
from meshcone.suggestions import close_to, did_you_mean, first_cause, in_words
from meshcone.text import is_text

_GATE_DEPTH = 2  # gates, and the name of one
_BOUNDS = 'bounds, such as {"max": 0.01}'


def parse_options(document: Mapping[str, Any]) -> Options:
    """Validate a nested mapping of options.

    Raises:
        InputError: naming the first option that is unknown or out of range.
    """
    _require_text(document)
    try:
        return Options.model_validate(document)
    except ValidationError as error:
        raise InputError(_explain(error)) from None


def parse_options_json(text: str | bytes) -> Options:
    """Validate a JSON object of options.

    Raises:
        InputError: the text is no JSON object, or an option in it is unknown or out of range.
    """
    return parse_options(read_options_json(text))


def read_options_json(text: str | bytes) -> dict[str, Any]:
    """The JSON object that a text is, before its options are validated.

    Raises:
        InputError: the text is no JSON object.
    """
    try:
        document = parse_json(text)
    except DuplicateNameError as error:
        raise InputError(f"options: {error}") from None
    except (ValueError, RecursionError):
        raise InputError("options are not valid JSON") from None
    if not isinstance(document, dict):
        raise InputError(f"options must be a JSON object, found {_json_type(document)}")
    return document


def parse_assignments(assignments: Iterable[str]) -> dict[str, Any]:
    """Turn ``surface.edge_cap=2.5`` assignments into the nested mapping they mean.

    Values are read as JSON where they are JSON and as plain strings otherwise.

    Raises:
        InputError: an assignment has no ``=``, sets a value and something below it, or has a
            value that is nested too deeply.
    """
    document: dict[str, Any] = {}
    for assignment in assignments:
        path, equals, text = assignment.partition("=")
        if not equals or not path:
            raise InputError(f"expected KEY=VALUE, found '{assignment}'")
        *parents, leaf = path.split(".")
        section = document
        for parent in parents:
            section = section.setdefault(parent, {})
            if not isinstance(section, dict):
                raise InputError(f"'{parent}' in '{path}' already has a value of its own")
        try:
            section[leaf] = parse_json(text)
        except DuplicateNameError as error:
            raise InputError(f"option '{path}': {error}") from None
        except RecursionError:
            raise InputError(f"option '{path}': the value is nested too deeply") from None
        except ValueError:
            section[leaf] = text
    return document


def _require_text(document: Mapping[str, Any]) -> None:
    """Refuse what JSON can escape but no file, report or answer can hold: half a character."""
    waiting: list[tuple[str, Any]] = [("", document)]  # no recursion: a sender chooses the depth
    while waiting:
        path, value = waiting.pop()
        if isinstance(value, str) and not is_text(value):
            place = f"option '{ascii(path)[1:-1]}'" if path else "options"
            raise InputError(
                f"{place}: found {value[:40]!a}, which has half of a surrogate pair in it; "
                "write the whole character"
            )
        if isinstance(value, Mapping):
            waiting.extend((path, name) for name in value)
            waiting.extend((f"{path}.{name}" if path else str(name), value[name]) for name in value)
        elif isinstance(value, list | tuple):
            waiting.extend((path, below) for below in value)


def _explain(error: ValidationError) -> str:
    first = first_cause(error)
    path = ".".join(str(part) for part in first["loc"])
    if first["type"] == "extra_forbidden":
        return f"unknown option '{path}'{_hint(path, first['loc'])}"
    is_gate = first["loc"][0] == "gates" and len(first["loc"]) == _GATE_DEPTH
    wanted = {"an_object": _BOUNDS} if is_gate else {}
    return f"option '{path}': {in_words(first, **wanted)}"


def _hint(path: str, parts: tuple[int | str, ...]) -> str:
    """What an unknown option may have been meant to be."""
    known = list(_known_beside(path, parts))
    key = str(parts[-1])
    if "." not in key:
        return did_you_mean(path, known)
    # Options are objects within objects: a name with dots in it is none, though it exists.
    meant = path if path in known else next(iter(close_to(path, known)), None)
    if meant is None:
        return ""
    *sections, leaf = meant.split(".")
    opened = "".join(f'{{"{section}": ' for section in sections)
    return f'; write it as {opened}{{"{leaf}": …}}{"}" * len(sections)}'


def _known_beside(path: str, parts: tuple[int | str, ...]) -> Iterable[str]:
    if parts[0] == "gates":  # whose names are the report's, not ours
        parent = path.rpartition(".")[0]
        return (f"{parent}.{name}" for name in GateRule.model_fields)
    return _known_paths(Options)


def _known_paths(model: type[BaseModel], prefix: str = "") -> Iterable[str]:
    for name, field in model.model_fields.items():
        yield prefix + name
        if isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel):
            yield from _known_paths(field.annotation, f"{prefix}{name}.")


def _json_type(value: object) -> str:
    names = {list: "an array", str: "a string", bool: "a boolean", type(None): "null"}
    return names.get(type(value), "a number")
