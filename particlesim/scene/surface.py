"""What surfaces do to each other: keys of a group of particles, and of the contact between two groups."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from particlesim.scene.base import Fraction, Model, NotNegative, PlainFloat, Text
from particlesim.scene.messages import must_be

# What stands for the walls of the world where a contact names groups.
WALLS = "walls"

TangentialRestitution = Annotated[PlainFloat, Field(ge=-1, le=1), must_be("a number from -1 to 1")]
Two = Annotated[tuple[Text, Text], must_be(f"the names of two groups, or of one and '{WALLS}', such as ['a', 'b']")]


def check_static(friction: float | None, static_friction: float | None) -> None:
    """ValueError if a table gives a static friction below its friction."""
    if None not in (friction, static_friction) and float(static_friction or 0.0) < float(friction or 0.0):
        raise ValueError(f"static_friction is {static_friction:g}, but must not be below friction, {friction:g}")


class Surface(Model):
    """How a surface takes impacts and sliding; what is not given is as it would be without the table."""

    restitution: Fraction | None = None
    friction: NotNegative | None = None  # Coulomb's coefficient while the surfaces slide
    static_friction: NotNegative | None = None  # and until they do; the friction if only that is given
    rolling_friction: NotNegative | None = None  # [m]; the torque is at most this times the normal force
    tangential_restitution: TangentialRestitution | None = None  # of impacts that stick, Walton's beta_0

    @model_validator(mode="after")
    def _static_is_not_below(self) -> Surface:
        check_static(self.friction, self.static_friction)
        return self

    @property
    def surface(self) -> dict[str, float]:
        """Which of its keys are given. Friction alone is static friction too."""
        given = {name: getattr(self, name) for name in Surface.model_fields if getattr(self, name) is not None}
        return {"static_friction": given["friction"], **given} if "friction" in given else given


class Contact(Surface):
    """What two groups, or the particles of one among themselves, do to each other in place of what they usually do."""

    between: Two
