"""What Khronos' validator says of a glTF."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from meshcone.auditing.records.section import Section

MESSAGES_KEPT = 100


class ValidatorMessage(Section):
    """One issue."""

    severity: Literal["error", "warning", "info", "hint"]
    code: str = Field(description="the validator's own, such as ACCESSOR_INVALID_FLOAT")
    pointer: str = Field(description="where in the JSON it is, as a JSON pointer")
    words: str


class Validator(Section):
    """Counts are null where the validator was not asked or gave no answer."""

    version: str | None = Field(None, description="of the validator")
    errors: int | None = Field(None, description="what breaks the specification")
    warnings: int | None = Field(None, description="what is likely to be wrong")
    infos: int | None = Field(None, description="what a reader may want to know")
    hints: int | None = Field(None, description="what could be better")
    not_tested: str | None = Field(None, description="why there are no counts")
    messages: tuple[ValidatorMessage, ...] = Field(
        (), description=f"the first {MESSAGES_KEPT}, the worst first"
    )
