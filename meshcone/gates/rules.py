"""What a gate asks of one value of a report."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal, get_args

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    StrictBool,
    StrictStr,
    model_validator,
)

Severity = Literal["error", "warning"]
NumericBound = Literal[
    "max",
    "min",
    "max_model",
    "min_model",
    "max_ratio_to_input",
    "min_ratio_to_input",
    "max_ratio_to_floor",
    "min_ratio_to_floor",
    "max_ratio_to_reference",
    "min_ratio_to_reference",
]
WordBound = Literal["equals", "one_of", "all_match", "none_match"]
Bound = Literal[NumericBound, WordBound]
Allowed = float | bool | str | tuple[str, ...]

BOUNDS: tuple[Bound, ...] = get_args(Bound)
NUMERIC_BOUNDS: tuple[NumericBound, ...] = get_args(NumericBound)
WORD_BOUNDS: tuple[WordBound, ...] = get_args(WordBound)

_LENGTHS = ("max_model", "min_model", "tolerance_model")

# Strict: "0.1" or true where a number belongs is a slip of the writer's, not a bound.
Number = Annotated[float, Field(strict=True, ge=-1e12, le=1e12, allow_inf_nan=False)]
Words = tuple[StrictStr, ...]
Globs = Annotated[
    Words, BeforeValidator(lambda given: [given] if isinstance(given, str) else given)
]


class GateRule(BaseModel):
    """The bounds on one value; at least one of them, and each a check of its own."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    max: Number | None = Field(None, description="largest value allowed, as the report states it")
    min: Number | None = Field(None, description="smallest value allowed, as the report states it")
    max_model: Number | None = Field(
        None,
        description="largest distance allowed, in the unit of the files or, of a glTF or STEP, in "
        "`unit`",
    )
    min_model: Number | None = Field(
        None,
        description="smallest distance allowed, in the unit of the files or, of a glTF or STEP, in "
        "`unit`",
    )
    max_ratio_to_input: Number | None = Field(
        None, description="largest multiple allowed of what the input scored"
    )
    min_ratio_to_input: Number | None = Field(
        None, description="smallest multiple allowed of what the input scored"
    )
    max_ratio_to_floor: Number | None = Field(
        None, description="largest multiple allowed of what the reference scores against itself"
    )
    min_ratio_to_floor: Number | None = Field(
        None, description="smallest multiple allowed of what the reference scores against itself"
    )
    max_ratio_to_reference: Number | None = Field(
        None, description="largest multiple allowed of what the reference has"
    )
    min_ratio_to_reference: Number | None = Field(
        None, description="smallest multiple allowed of what the reference has"
    )
    equals: StrictBool | StrictStr | Words | None = Field(
        None, description="what a yes-or-no value, a word or a list must be, in any order"
    )
    one_of: Words | None = Field(None, description="the words allowed, also in a list")
    all_match: Globs | None = Field(
        None, description="globs, one of which every word must match: `M_*`"
    )
    none_match: Globs | None = Field(None, description="globs that no word may match")
    tolerance: Number | None = Field(
        None,
        gt=0,
        description="for `deviation.area_beyond`: how far away counts, relative to the radius",
    )
    tolerance_model: Number | None = Field(
        None, gt=0, description="the same in the unit of the files"
    )
    severity: Severity = Field(
        "error", description="whether a value out of bounds fails the asset or is only told"
    )
    unit: str | None = Field(
        None,
        max_length=20,
        description="what lengths are in: of a glTF, which is in metres, and a STEP, in "
        "millimetres, they are converted; of other files it is what messages call their unit",
    )

    @model_validator(mode="after")
    def _asks_something(self) -> GateRule:
        if not self.bounds():
            raise ValueError(f"needs a bound: one of {', '.join(BOUNDS)}")
        return self

    def bounds(self) -> Mapping[Bound, Allowed]:
        """The bounds that are set, in the order of the fields."""
        values = ((name, getattr(self, name)) for name in BOUNDS)
        return {name: value for name, value in values if value is not None}

    def in_model_units(self, length: float) -> GateRule:
        """The rule with its bounds on distances in the unit of the files.

        Args:
            length: of the unit that the rule is in, in the unit of the files.
        """
        if length == 1:
            return self
        lengths = {name: getattr(self, name) for name in _LENGTHS}
        converted = {name: each * length for name, each in lengths.items() if each is not None}
        return self.model_copy(update={"unit": None, **converted})


GateTable = Mapping[str, GateRule]
