"""Gate files: bounds for every asset, and for classes of assets."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from fnmatch import fnmatchcase
from pathlib import PurePath
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from meshcone.errors import InputError
from meshcone.gates.fitting import (
    counts_unit,
    plain_size_bound,
    require_known,
    require_no_plain_size,
)
from meshcone.gates.levels import LevelRules
from meshcone.gates.paths import known_values
from meshcone.gates.profile import profile
from meshcone.gates.rules import GateRule, GateTable
from meshcone.json_text import parse_json
from meshcone.options import Mode
from meshcone.suggestions import did_you_mean, first_cause, in_words

_DEEPEST = 64  # parts of a name that a gate could have


def _joined(table: Any, depth: int = 0) -> Any:
    """Join the names of values that TOML splits at unquoted dots.

    A bound is never a table, so a table of nothing but tables is the beginning of a name.
    """
    if not isinstance(table, Mapping):
        return table
    if depth > _DEEPEST:
        raise ValueError(f"is nested too deeply: no value's name has {_DEEPEST} parts")
    joined: dict[str, Any] = {}
    for name, value in table.items():
        found = {name: value}
        if isinstance(value, Mapping) and value and all(map(_is_table, value.values())):
            found = {f"{name}.{tail}": rule for tail, rule in _joined(value, depth + 1).items()}
        for key, rule in found.items():
            if key in joined:
                twice = f"has '{key}' twice, in quotes and as tables"
                raise ValueError(f"{twice}: write it once, with all its bounds")
            joined[key] = rule
    return joined


def _is_table(value: object) -> bool:
    return isinstance(value, Mapping)


Rules = Annotated[dict[str, LevelRules], BeforeValidator(lambda table: _joined(table))]


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class AssetClass(_Section):
    """What holds for some assets besides, or instead of, what holds for all."""

    match: tuple[str, ...] = Field(
        min_length=1,
        description="globs; with a slash against the asset's whole name, else its last part",
    )
    gates: Rules = Field({}, description="further gates; they replace those of the same name")
    without: tuple[str, ...] = Field((), description="gates of all assets that do not hold here")

    def has(self, asset: str) -> bool:
        """Whether an asset belongs to this class, by its name with forward slashes."""
        last = asset.rpartition("/")[2]
        return any(fnmatchcase(asset if "/" in glob else last, glob) for glob in self.match)


class GateFile(_Section):
    """A set of gates, as a TOML or JSON document."""

    unit: str | None = Field(
        None, max_length=20, description="what lengths are in; see GateRule.unit"
    )
    gates: Rules = Field({}, description="what holds for every asset")
    classes: dict[str, AssetClass] = Field(
        {}, description="what holds for some; where several match, the later one decides"
    )

    def for_asset(self, name: str, level: int | None = None) -> GateTable:
        """The gates an asset has to pass.

        Args:
            name: of the asset, with forward slashes.
            level: of detail, where it is one.

        Raises:
            InputError: a gate has bounds for levels of detail, but none for this one.
        """
        rules = dict(self.gates)
        for each in self.classes.values():
            if each.has(name):
                rules = {key: rule for key, rule in rules.items() if key not in each.without}
                rules |= each.gates
        return {key: self._in_unit(key, rule.at(level, key, name)) for key, rule in rules.items()}

    def over(self, base: GateFile) -> GateFile:
        """These gates besides those of another file, and in place of those of the same name."""
        return GateFile(
            unit=self.unit or base.unit,
            gates={**base.gates, **self.gates},
            classes={**base.classes, **self.classes},
        )

    def _in_unit(self, key: str, rule: GateRule) -> GateRule:
        # A plain bound on a size can only be that of a base without a unit: see parse_gates.
        if rule.unit is not None or plain_size_bound(key, rule) is not None:
            return rule
        return rule.model_copy(update={"unit": self.unit})


def parse_gate_file(name: str, data: bytes, mode: Mode, base: GateFile | None = None) -> GateFile:
    """Read a gate file: JSON if its name ends in ``.json``, else TOML.

    Args:
        name: the file's name.
        data: its bytes.
        mode: what the gates are for; see :func:`meshcone.gates.fitting.require_known`.
        base: gates that hold besides, where the file does not replace them.

    Raises:
        InputError: it cannot be read, or names what does not exist.
    """
    return parse_gates(read_document(name, data), mode, name, base)


def profile_gates(name: str, mode: Mode) -> GateFile:
    """The gates of a profile.

    Args:
        name: of the profile.
        mode: what the gates are for; see :func:`meshcone.gates.fitting.require_known`.

    Raises:
        InputError: there is no such profile.
    """
    return parse_gate_file(f"{name}.toml", profile(name), mode)


def parse_gates(
    document: Any, mode: Mode, name: str | None = None, base: GateFile | None = None
) -> GateFile:
    """Validate a gate file's content.

    Args:
        document: what the file says, as mappings.
        mode: what the gates are for; see :func:`meshcone.gates.fitting.require_known`.
        name: the file's name, for messages.
        base: gates that hold besides, where these do not replace them.

    Raises:
        InputError: it names what does not exist, or asks for nothing.
    """
    try:
        file = GateFile.model_validate(document)
    except ValidationError as error:
        raise InputError(_explain(error, mode), file=name) from None
    tables = [file.gates, *(each.gates for each in file.classes.values())]
    if not any(tables):
        raise InputError("there is no gate in it; gates stand in a table [gates]", file=name)
    try:
        for key, rule in (rule for table in tables for rule in table.items()):
            for each in rule.rules:
                require_known({key: each}, mode)
                require_no_plain_size(key, each, file.unit)
                _require_counting_unit(key, each)
        whole = file if base is None else file.over(base)
        for section in file.classes.values():
            _require_held(section.without, whole.gates)
    except InputError as error:
        raise InputError(error.message, file=name) from None
    return whole


def read_document(name: str, data: bytes) -> Any:
    """What a file says: JSON if its name ends in ``.json``, else TOML.

    Raises:
        InputError: it is neither.
    """
    is_json = PurePath(name).suffix.lower() == ".json"
    try:
        text = data.decode("utf-8-sig")
        return parse_json(text) if is_json else tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        kind = "JSON" if is_json else "TOML"
        raise InputError(f"is no valid {kind}: {_first_line(error)}", file=name) from None


def _first_line(error: Exception) -> str:
    return next(iter(str(error).splitlines()), "it is nested too deeply")


def _require_counting_unit(key: str, rule: GateRule) -> None:
    if rule.unit is not None and not counts_unit(key, rule):
        raise InputError(
            f"gate '{key}': a unit is for lengths, and no bound here is one: leave "
            f"unit = '{rule.unit}' away"
        )


def _require_held(without: tuple[str, ...], gates: Mapping[str, LevelRules]) -> None:
    for key in without:
        if key not in gates:
            raise InputError(
                f"'without' names '{key}', which is no gate of all assets{did_you_mean(key, gates)}"
            )


def _explain(error: ValidationError, mode: Mode) -> str:
    first = first_cause(error)
    *parents, last = _written(first["loc"])
    where = f" in '{'.'.join(parents)}'" if parents else ""
    if first["type"] == "extra_forbidden":
        if "gates" in parents[:-1] and f"{parents[-1]}.{last}" in known_values(mode):
            return f"'{parents[-1]}.{last}': must be a table of bounds, such as {{ max = 0.01 }}"
        hint = did_you_mean(last, _known_beside(parents))
        if not parents and not hint:
            hint = "; gates stand in a table [gates]"
        return f"unknown key '{last}'{where}{hint}"
    if first["type"] == "model_type" and "gates" in parents:
        return f"'{last}'{where}: must be a table of bounds, such as {{ max = 0.01 }}"
    return f"'{last}'{where}: {in_words(first, 'a table')}"


def _written(place: tuple[int | str, ...]) -> list[str]:
    """The keys that lead to a place, without what a rule is kept in."""
    parts = list(map(str, place))
    if "rules" in parts[2:-1]:
        del parts[parts.index("rules", 2) : parts.index("rules", 2) + 2]
    return parts


def _known_beside(parents: list[str]) -> Iterator[str]:
    """Keys that a section of a gate file can have, by the names that lead to it."""
    in_class = parents[:1] == ["classes"]
    below = parents[2:] if in_class else parents
    model: type[BaseModel] = AssetClass if in_class else GateFile
    if below[:1] == ["gates"]:
        model = GateRule
    yield from model.model_fields
