"""What a trajectory keeps of a run: by default all there is, in single precision."""

from __future__ import annotations

from typing import Annotated, Any, Literal, get_args

from pydantic import BeforeValidator, Field

from particlesim.scene.base import Model, whole
from particlesim.scene.messages import check_words, listed, must_be, one_of

_Word = Literal["position", "orientation", "velocity", "angular_momentum", "image", "impacts"]

# What there is to keep of each particle.
QUANTITIES: tuple[str, ...] = get_args(_Word)


def _fields(value: Any) -> list[str]:
    """Words without doubles, the position among them. ValueError that names a word that is none."""
    what = f"must be a list of {listed(QUANTITIES)}, 'position' among them"
    check_words(value, QUANTITIES, what, "word")
    if QUANTITIES[0] not in value:
        raise ValueError(what)
    return [name for name in QUANTITIES if name in value]


class Recording(Model):
    """What a trajectory keeps of a run. Sums over all particles are kept of every frame in it, whatever the fields."""

    every: Annotated[int, Field(ge=1, le=1_000_000), whole, must_be("a whole number from 1 to 1,000,000")] = Field(
        default=1, description="one frame in so many is kept, the first among them: the movie of it goes as much faster"
    )
    fields: Annotated[list[str], BeforeValidator(_fields, json_schema_input_type=list[_Word])] = Field(
        default_factory=lambda: list(QUANTITIES),
        description="what is kept of each particle; what is not cannot be drawn, plotted or exported",
    )
    precision: Annotated[Literal["single", "double"], one_of("single", "double")] = Field(
        default="single", description="of numbers; double keeps every bit, beside single ones for other programs"
    )

    def keeps(self, frame: int) -> bool:
        """Whether a frame of the run is kept, by its number."""
        return frame % self.every == 0

    def kept(self, frames: int) -> int:
        """How many of the first ``frames`` of a run are kept."""
        return -(-frames // self.every)
