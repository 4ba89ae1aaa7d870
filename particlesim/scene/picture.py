"""The movie: its camera, its format, and what is drawn besides the particles."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from particlesim.scene.base import Colour, Finite, Model, Positive, Vector, shorthand


class FixedCamera(Model):
    """Stands still in the given direction, as near as shows the whole world."""

    kind: Literal["fixed"]
    azimuth: Finite = 30.0  # [degrees] about z, from +x
    elevation: Annotated[float, Field(ge=-89, le=89)] = 20.0  # [degrees] above the horizon
    field_of_view: Annotated[float, Field(gt=1, lt=150)] = 40.0  # [degrees], vertical


class LookAtCamera(Model):
    """Stands at ``position`` and looks at ``target`` [m]."""

    kind: Literal["look-at"]
    position: Vector
    target: Vector = (0.0, 0.0, 0.0)
    field_of_view: Annotated[float, Field(gt=1, lt=150)] = 40.0

    @model_validator(mode="after")
    def _apart(self) -> LookAtCamera:
        if self.position == self.target:
            raise ValueError("position and target must differ")
        return self


class OrbitCamera(Model):
    """Circles the target once in ``period`` seconds; the distance is chosen to fit the world if not given."""

    kind: Literal["orbit"]
    period: Annotated[float, Field(allow_inf_nan=False)] = 20.0  # [s]; negative turns the other way
    azimuth: Finite = 30.0  # [degrees] at the start
    elevation: Annotated[float, Field(ge=-89, le=89)] = 20.0
    distance: Positive | None = None  # [m]
    target: Vector = (0.0, 0.0, 0.0)
    field_of_view: Annotated[float, Field(gt=1, lt=150)] = 40.0

    @model_validator(mode="after")
    def _turns(self) -> OrbitCamera:
        if self.period == 0:
            raise ValueError("period must not be zero")
        return self


Camera = Annotated[FixedCamera | LookAtCamera | OrbitCamera, Field(discriminator="kind"), shorthand("", None, str)]


def _even(value: int) -> int:
    if value % 2:
        raise ValueError("an even number of pixels, as H.264 with yuv420p needs")
    return value


Pixels = Annotated[int, Field(ge=64, le=7680), AfterValidator(_even)]


class Movie(Model):
    """The file that comes out."""

    fps: Annotated[float, Field(ge=1, le=240)] = 30.0
    resolution: tuple[Pixels, Pixels] = (1280, 720)
    background: Colour = "#f4f2ee"


class Show(Model):
    """What is drawn besides the particles."""

    box: bool = True  # edges of the world
    cells: bool = False  # leaves of the octree
    readout: bool = True  # time, particles, impacts, energy
