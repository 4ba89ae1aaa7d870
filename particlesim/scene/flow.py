"""Where particles come from while a scene goes on, and where they leave it."""

from __future__ import annotations

from pydantic import Field, model_validator

from particlesim.scene.base import Model, Positive, Text, Timed
from particlesim.scene.groups import Group, RadialVelocity
from particlesim.scene.placements import RandomPlacement, Region


class Emitter(Group, Timed):
    """A group of particles that come one by one, ``rate`` a second, anywhere in a region.

    None is put into another body: what finds no room waits for it.
    """

    rate: Positive = Field(description="how many come in a second [1/s]")
    region: Region = Field(description="where they come")

    @model_validator(mode="after")
    def _is_no_start(self) -> Emitter:
        if not isinstance(self.placement, RandomPlacement) or self.placement.region is not None:
            raise ValueError("an emitter has a region in place of a placement")
        if isinstance(self.velocity, RadialVelocity):
            raise ValueError("velocity must be another than outward and inward, which are those of a start")
        return self


class Sink(Model):
    """A region whose particles are taken out: those whose centroid is in it when a time step ends."""

    name: Text | None = Field(default=None, description="for messages")
    region: Region = Field(description="where they are taken out")
