"""What surfaces do to each other: keys of a group of particles, and of the contact between two groups."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from particlesim.scene.base import Fraction, Model, NotNegative, PlainFloat, Text
from particlesim.scene.messages import must_be

# What stands for the walls of the world where a contact names groups.
WALLS = "walls"

TangentialRestitution = Annotated[PlainFloat, Field(ge=-1, le=1), must_be("a number from -1 to 1")]
Two = Annotated[
    tuple[Text, Text], must_be(f"the names of two groups, or of one and an obstacle or '{WALLS}', such as ['a', 'b']")
]


class HasSurface(Model):
    """Base of the tables that have the keys of ``Surface``, whatever stands for those that are not given."""

    @model_validator(mode="after")
    def _static_is_not_below(self) -> Self:
        friction, static = (self.surface.get(name) for name in ("friction", "static_friction"))
        if friction is not None and static is not None and static < friction:
            raise ValueError(f"static_friction is {static:g}, but must not be below friction, {friction:g}")
        return self

    @property
    def surface(self) -> dict[str, float]:
        """Which of its keys have a value. Friction alone is static friction too."""
        values = {name: getattr(self, name) for name in Surface.model_fields}
        given = {name: value for name, value in values.items() if value is not None}
        return {"static_friction": given["friction"], **given} if "friction" in given else given


class Surface(HasSurface):
    """How a surface takes impacts and sliding; what is not given is as it would be without the table."""

    restitution: Fraction | None = Field(default=None, description="part of the speed that an impact gives back")
    friction: NotNegative | None = Field(default=None, description="Coulomb's coefficient while surfaces slide")
    static_friction: NotNegative | None = Field(
        default=None, description="and until they do; the friction if only that is given"
    )
    rolling_friction: NotNegative | None = Field(
        default=None, description="the torque is at most this times the normal force [m]"
    )
    tangential_restitution: TangentialRestitution | None = Field(
        default=None, description="part of the sliding that impacts which stick give back, Walton's beta_0"
    )


class Contact(Surface):
    """What groups and obstacles, or the particles of one group, do to each other in place of what they usually do."""

    between: Two = Field(description="the names of two groups, of one and an obstacle or 'walls', or one twice")
