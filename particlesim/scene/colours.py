"""What particles are coloured by: a colour, their shape or group, or a quantity on a scale of colours."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag

from particlesim.scene.base import Model, Number, Text, colour_or
from particlesim.scene.messages import hint, listed, must_be, one_of

# Quantities that particles can be coloured by.
FIELDS = "speed", "height", "size", "impacts"

# Maps of colours, all of matplotlib's whose lightness grows, evenly, from the one end to the other.
MAPS = "viridis", "plasma", "inferno", "magma", "cividis"

# A word for each quantity, which stands for its table.
FIELD_WORDS = {f"by_{field}": field for field in FIELDS}
_COLOURED = "by_shape", "by_group", *FIELD_WORDS


def _rising(value: tuple[float, float]) -> tuple[float, float]:
    if value[0] >= value[1]:
        raise ValueError("does not rise")
    return value


Range = Annotated[tuple[Number, Number], AfterValidator(_rising), must_be("[low, high], two numbers, low below high")]


def _even_map(value: Any) -> Any:
    """Refuse what is no map, and say why not where matplotlib has one of this name."""
    if value in MAPS:
        return value
    what = f"must be {listed(MAPS)}"
    if isinstance(value, str):
        from matplotlib import colormaps  # noqa: PLC0415  (slow to import)

        uneven = value in colormaps and not value.endswith("_r")
        what += "; the lightness of this one does not grow evenly, which shows what is not there" if uneven else ""
        what += hint(value, MAPS)
    raise ValueError(what)


class FieldColour(Model):
    """By a quantity, on a scale of colours; groups that show the same quantity share the scale."""

    field: Annotated[Literal["speed", "height", "size", "impacts"], one_of(*FIELDS)] = Field(
        description="what is shown"
    )
    map: Annotated[str, BeforeValidator(_even_map, json_schema_input_type=Literal.__getitem__(MAPS))] = Field(
        default="viridis", description="colours from the low end to the high one, as matplotlib calls them"
    )
    range: Range | None = Field(default=None, description="ends of the scale; settled by the run if not given")


def _expanded(value: Any) -> Any:
    """A word for a quantity as the table that it stands for."""
    return {"field": FIELD_WORDS[value]} if isinstance(value, str) and value in FIELD_WORDS else value


def _form(value: Any) -> str:
    return "table" if isinstance(value, dict | FieldColour) else "word"


_Word = Annotated[Text, colour_or(*_COLOURED)]
GroupColour = Annotated[
    Annotated[FieldColour, Tag("table")] | Annotated[_Word, Tag("word")],
    Discriminator(_form),
    BeforeValidator(_expanded, json_schema_input_type=FieldColour | _Word),
]
COLOUR_WORDS = f"a colour name, '#rrggbb', {listed(_COLOURED)}, or a table"
