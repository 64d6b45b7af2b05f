"""What the sections of an audit have in common."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class Section(BaseModel):
    """One family of values; each of them is a gate from the day it is a field."""

    model_config = ConfigDict(extra="forbid", frozen=True)
