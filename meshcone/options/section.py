"""What every section of the options is, and the numbers they are made of."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

# Both ends of every number are stated: what it costs, in memory and time, is bounded by them.
Index = Annotated[int, Field(ge=0, le=2**31 - 1)]
Share = Annotated[float, Field(ge=1e-9, le=1e6, allow_inf_nan=False)]
ModelLength = Annotated[float, Field(ge=1e-12, le=1e12, allow_inf_nan=False)]
# Shares and weights relative to one another: beyond these no digits of the others are left.
Weight = Annotated[float, Field(ge=1e-6, le=1e6, allow_inf_nan=False)]
WeightOrNone = Annotated[float, Field(ge=0, le=1e6, allow_inf_nan=False)]


class Section(BaseModel):
    """Options of one concern; an unknown name is an error."""

    model_config = ConfigDict(extra="forbid", frozen=True)
