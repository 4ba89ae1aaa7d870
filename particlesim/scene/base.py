"""What all tables of a scene share: the base model, numbers with their bounds, shorthands, colours."""

from __future__ import annotations

from typing import Annotated, Any

from PIL import ImageColor
from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Fraction = Annotated[float, Field(ge=0, le=1)]
Vector = tuple[Finite, Finite, Finite]
PositiveVector = tuple[Positive, Positive, Positive]
Quaternion = tuple[Finite, Finite, Finite, Finite]


class Model(BaseModel):
    """Base of every table of a scene: unknown keys are refused, assignments are checked."""

    model_config = ConfigDict(extra="forbid", validate_assignment=True)


def shorthand(kind: str, key: str | None, *types: type) -> BeforeValidator:
    """Read a bare value of one of ``types`` as ``{kind = kind, key = value}`` (key None: as the kind itself)."""

    def expand(value: Any) -> Any:
        if isinstance(value, types) and not isinstance(value, bool):
            return {"kind": value} if key is None else {"kind": kind, key: value}
        return value

    return BeforeValidator(expand)


def _known_colour(value: str) -> str:
    try:
        ImageColor.getrgb(value)
    except ValueError:
        raise ValueError("a colour name such as 'steelblue' or '#rrggbb'") from None
    return value


Colour = Annotated[str, AfterValidator(_known_colour)]
