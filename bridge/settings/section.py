"""What every table of the config is made of: a frozen model, and the kinds of values that stand in it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, Strict

Real = Annotated[float, Strict()]
Positive = Annotated[float, Strict(), Field(gt=0)]
NotNegative = Annotated[float, Strict(), Field(ge=0)]
Share = Annotated[float, Strict(), Field(ge=0, le=1)]
Pixels = Annotated[int, Strict(), Field(gt=0)]
Byte = Annotated[int, Strict(), Field(ge=0, le=255)]
Name = Annotated[str, Field(min_length=1)]
Triple = Annotated[tuple[Real, ...], Field(min_length=3, max_length=3)]
Range = Annotated[tuple[Real, ...], Field(min_length=2, max_length=2)]
Row = Annotated[tuple[Real, ...], Field(min_length=4, max_length=4)]


class Section(BaseModel):
    """A table of the config: frozen, and no key it does not know."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


def refuse_twins(what: str, names: Sequence[str]) -> None:
    """Raise ValueError when a name comes twice."""
    twins = [name for name, count in Counter(names).items() if count > 1]
    if twins:
        raise ValueError(f"{what} {twins[0]} comes twice; each must differ: rename or remove one")
