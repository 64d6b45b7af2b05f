"""Whether gates name values that a report has, with bounds that fit them."""

from __future__ import annotations

import json
from collections.abc import Mapping

from meshcone.errors import InputError
from meshcone.gates.paths import Known, is_metric, known_values, look_up, side_of
from meshcone.gates.rules import WORD_BOUNDS, Allowed, Bound, GateRule, GateTable
from meshcone.gates.units import formats_for, is_distance, is_size, unit_for
from meshcone.options import Mode
from meshcone.suggestions import did_you_mean

AREA_BEYOND = "deviation.area_beyond"
_KINDS = {
    "number": "a number",
    "interval": "a number",
    "truth": "a yes-or-no value",
    "word": "a word",
    "list": "a list of words",
}
# What to write of each kind of value instead of a bound that does not fit.
_INSTEAD = {
    "number": "write max or min, or both for one number alone",
    "interval": "write max or min",
    "truth": "write equals = true or equals = false",
    "word": "write equals, one_of, all_match or none_match",
    "list": "write equals, one_of, all_match or none_match",
}


def require_known(gates: GateTable, mode: Mode) -> None:
    """Check that the gates name values a report of this mode has, with bounds that fit them.

    Raises:
        InputError: naming the first that does not.
    """
    known = known_values(mode)
    for key, rule in gates.items():
        value = look_up(known, key)
        if value is None:
            _require_no_value(known, key, rule)
            raise InputError(_unknown(key, mode))
        _require_tolerance(key, rule)
        require_no_plain_size(key, rule, rule.unit)
        for bound, allowed in rule.bounds().items():
            wanted = _wanted(key, value, bound, mode)
            if wanted is not None:
                raise InputError(f"gate '{key}': '{bound}' is for {wanted}")
            _require_possible(key, value, bound, allowed)


def require_units(gates: GateTable, source: str, reference: str | None, *, scaled: bool) -> None:
    """Check that lengths of gates can be held against these files.

    Args:
        gates: by the name of a value.
        source: the source's format.
        reference: the reference's, if there is one.
        scaled: whether the source takes the reference's size before it is measured.

    Raises:
        InputError: as :func:`unit_for`, naming the first gate.
    """
    for key, rule in gates.items():
        try:
            unit_for(rule.unit, *formats_for(key, source, reference, scaled=scaled))
        except InputError as error:
            raise InputError(f"gate '{key}': {error.message}") from None


def _require_tolerance(key: str, rule: GateRule) -> None:
    """Check that what is about a tolerance says which, and nothing else does."""
    given = [each for each in (rule.tolerance, rule.tolerance_model) if each is not None]
    if key != AREA_BEYOND and given:
        raise InputError(f"gate '{key}': a tolerance is for '{AREA_BEYOND}'")
    if key == AREA_BEYOND and len(given) != 1:
        raise InputError(f"gate '{key}' needs one of tolerance and tolerance_model")
    if key.startswith(f"{AREA_BEYOND}."):
        raise InputError(f"gate '{key}': the gate that has a tolerance is '{AREA_BEYOND}'")


def require_no_plain_size(key: str, rule: GateRule, unit: str | None) -> None:
    """Refuse a bound on a size that a unit is named for and does not convert.

    Raises:
        InputError: there is one.
    """
    bound = plain_size_bound(key, rule)
    if bound is not None and unit is not None:
        raise InputError(
            f"gate '{key}': '{bound}' is in the unit of the file, and the unit here is '{unit}'; "
            f"write {bound}_model"
        )


def counts_unit(key: str, rule: GateRule) -> bool:
    """Whether it makes a difference what unit a gate is in."""
    bounds = rule.bounds().keys()
    if rule.tolerance_model is not None or any(each.endswith("_model") for each in bounds):
        return True
    return is_distance(key) and not bounds.isdisjoint(("max", "min"))  # told in it as well


def plain_size_bound(key: str, rule: GateRule) -> str | None:
    """The first bound on a size that is in the unit of the file, whatever the gate's is."""
    return next((each for each in rule.bounds() if is_size(key) and each in ("max", "min")), None)


def _require_no_value(known: Mapping[str, Known], key: str, rule: GateRule) -> None:
    """Recognise ``point_to_surface.max = 0.1``, whose last part was read as a bound."""
    for bound in rule.bounds():
        if look_up(known, f"{key}.{bound}"):
            raise InputError(
                f"gate '{key}.{bound}' must be a table of bounds, such as {{ max = 0.01 }}"
            )


def _unknown(key: str, mode: Mode) -> str:
    if mode != "refine" and look_up(known_values("refine"), key):
        if mode == "audit" and look_up(known_values("measure"), key):
            return f"gate '{key}': only a measurement or a refinement has this value, not an audit"
        return f"gate '{key}': only a refinement has this value, and the mode is '{mode}'"
    return f"unknown gate '{key}'{did_you_mean(key, known_values(mode))}"


def _wanted(key: str, value: Known, bound: Bound, mode: Mode) -> str | None:
    """Say what a bound is for, if not for this value."""
    kind = value.kind
    instead = f"; this is {_KINDS[kind]}: {_INSTEAD[kind]}"
    numeric = kind in ("number", "interval")
    if bound == "equals" and numeric:
        return f"words and yes-or-no values{instead}"
    if bound in ("one_of", "all_match", "none_match") and kind not in ("word", "list"):
        return f"words{instead}"
    if bound not in WORD_BOUNDS and not numeric:
        return f"numbers{instead}"
    if bound.endswith("_model") and not (is_distance(key) or is_size(key)):
        return f"distances; write {bound.partition('_')[0]}"
    if bound.endswith("_to_reference"):
        return _wanted_of_ratio(key)
    if "_ratio_" in bound and not is_metric(key):
        return "metrics" + (
            f"; write {bound.replace(bound.rpartition('_')[2], 'reference')}"
            if _wanted_of_ratio(key) is None
            else ""
        )
    if bound.endswith("_to_input") and mode != "refine":
        return "refined meshes"
    return None


def _wanted_of_ratio(key: str) -> str | None:
    if is_metric(key):
        return "values of the whole asset; a metric is held against its floor: ratio_to_floor"
    if key.startswith("asset.") and side_of(key) != "reference":
        return None
    return "values of the whole asset, such as 'asset.budget.triangles'"


def _require_possible(key: str, value: Known, bound: Bound, allowed: Allowed) -> None:
    if bound not in ("equals", "one_of"):
        return
    if bound == "equals" and isinstance(allowed, tuple) != (value.kind == "list"):
        instead = 'a list: equals = ["…"]' if value.kind == "list" else "one word, or use one_of"
        raise InputError(f"gate '{key}' is about {_KINDS[value.kind]}: write {instead}")
    for word in allowed if isinstance(allowed, tuple) else (allowed,):
        if value.kind == "truth" and not isinstance(word, bool):
            raise InputError(f"gate '{key}' is about a yes-or-no value: true or false")
        possible = word in value.choices if value.choices else isinstance(word, str)
        if value.kind != "truth" and not possible:
            hint = did_you_mean(str(word), value.choices)
            raise InputError(f"gate '{key}': the value is never {json.dumps(word)}{hint}")
