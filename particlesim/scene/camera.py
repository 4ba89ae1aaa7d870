"""The movie: its camera, its format, and what is drawn besides the particles."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, Literal, Self, get_args

from pydantic import AfterValidator, BeforeValidator, Field, ValidationError, WrapValidator, model_validator

from particlesim.scene.base import (
    Finite,
    Flag,
    Fraction,
    Model,
    NotNegative,
    Number,
    PlainFloat,
    Positive,
    PositiveNumber,
    Text,
    Vector,
    colour_or,
    in_time,
    shorthand,
    whole,
)
from particlesim.scene.messages import check_words, listed, must_be, one_of

Elevation = Annotated[PlainFloat, Field(ge=-89, le=89), must_be("an angle from -89 to 89 degrees")]
FieldOfView = Annotated[PlainFloat, Field(ge=2, le=149), must_be("an angle from 2 to 149 degrees")]


# What a camera fits into the picture: along axes with walls or a period the world, along open ones the particles; or
# either of them along all axes.
Subject = Annotated[Literal["auto", "world", "particles"], one_of("auto", "world", "particles")]


class _Lens(Model):
    """A camera whose lens may have a size: what is nearer or farther than its focus blurs, at quality best."""

    aperture: NotNegative = Field(
        default=0.0, description="width of the lens, at quality best; all is sharp if it is 0 [m]"
    )
    focus: Positive | None = Field(
        default=None, description="distance at which all is sharp; that of the middle of its subject if not given [m]"
    )


class _Aimed(_Lens):
    """A camera in a given direction, as near as shows all of its subject, unless its distance is given."""

    azimuth: Finite = Field(default=30.0, description="direction that it stands in, about z from +x [degrees]")
    elevation: Elevation = Field(default=20.0, description="angle above the horizon [degrees]")
    field_of_view: FieldOfView = Field(default=40.0, description="vertical angle of view [degrees]")
    subject: Subject = Field(
        default="auto", description="what is fitted into the picture; auto: the world, along open axes the particles"
    )
    zoom: Positive = Field(default=1.0, description="how much larger than fitting")
    distance: Positive | None = Field(default=None, description="distance from its target, in place of a zoom [m]")

    @model_validator(mode="after")
    def _either(self) -> Self:
        if self.distance is not None and self.zoom != 1.0:
            raise ValueError("give zoom or distance, not both")
        return self


class FixedCamera(_Aimed):
    """Stands still; a given distance is that from the middle of its subject."""

    kind: Literal["fixed"]


class _Placed(Model):
    """A camera at ``position`` that looks at ``target`` [m]."""

    position: Vector = Field(description="where it stands [m]")
    target: Vector = Field(default=(0.0, 0.0, 0.0), description="what it looks at [m]")
    field_of_view: FieldOfView = Field(default=40.0, description="vertical angle of view [degrees]")

    @model_validator(mode="after")
    def _apart(self) -> Self:
        if self.position == self.target:
            raise ValueError("position and target must differ")
        return self


class LookAtCamera(_Placed, _Lens):
    """Stands at ``position`` and looks at ``target`` [m]."""

    kind: Literal["look-at"]


def _not_zero(value: float) -> float:
    if value == 0:
        raise ValueError("zero")
    return value


class OrbitCamera(_Aimed):
    """Circles the target once in ``period`` seconds, starting at the azimuth."""

    kind: Literal["orbit"]
    period: Annotated[Number, AfterValidator(_not_zero), must_be("a number of seconds, not 0")] = Field(
        default=20.0, description="of one turn; negative turns the other way [s]"
    )
    target: Vector | None = Field(
        default=None, description="what it circles; the middle of its subject if not given [m]"
    )


class CameraKey(_Placed):
    """Where a camera is at one time."""

    time: Annotated[NotNegative, must_be("a number of seconds of 0 or more")] = Field(
        description="when it is there [s]"
    )


class PathCamera(_Lens):
    """Moves smoothly from key to key, at rest before the first and after the last."""

    kind: Literal["path"]
    keys: Annotated[list[CameraKey], Field(min_length=1), AfterValidator(in_time)] = Field(
        description="where it is, in the order of time"
    )


_Cameras = Annotated[FixedCamera | LookAtCamera | OrbitCamera | PathCamera, Field(discriminator="kind")]
Camera = Annotated[
    _Cameras,
    shorthand(
        '"fixed", "orbit", or a table such as { kind = "look-at", position = [5, 3, 2] }',
        _Cameras | Literal["fixed", "orbit"],
    ),
]


def _even(value: int) -> int:
    # H.264 with colours at half the resolution (yuv420p) has no odd edges.
    if value % 2:
        raise ValueError("odd")
    return value


_LEAST, _MOST = 64, 7680
Pixels = Annotated[int, Field(ge=_LEAST, le=_MOST), whole, AfterValidator(_even)]


def _sizes(value: Any, accept: Callable[[Any], Any]) -> Any:
    """Refuse what is no size in one line; if it is no more than odd, with the nearest that is even."""
    try:
        return accept(value)
    except ValidationError:
        what = f"must be [width, height] in pixels, two even whole numbers from {_LEAST} to {_MOST}"
        if isinstance(value, list | tuple) and len(value) == 2 and all(type(n) is int for n in value):
            width, height = (n + n % 2 for n in value)
            if min(width, height) >= _LEAST and max(width, height) <= _MOST:
                what += f"; the nearest are {width} and {height}"
        raise ValueError(what) from None


Resolution = Annotated[tuple[Pixels, Pixels], WrapValidator(_sizes)]
Quality = Annotated[Literal["draft", "normal", "high", "best"], one_of("draft", "normal", "high", "best")]

# Width and height of pictures that do not say theirs [pixels].
_SIZES: dict[str, tuple[int, int]] = {
    "draft": (640, 360),
    "normal": (1280, 720),
    "high": (1920, 1080),
    "best": (1920, 1080),
}


class Movie(Model):
    """The file that comes out."""

    fps: Annotated[PlainFloat, Field(ge=1, le=240), must_be("a number of frames a second from 1 to 240")] = Field(
        default=30.0, description="frames a second [1/s]"
    )
    speed: Annotated[PositiveNumber, must_be("a number of seconds above 0")] = Field(
        default=1.0, description="seconds of the scene in one of the movie: 0.1 is slow motion"
    )
    quality: Quality = Field(
        default="normal",
        description="draft is 640 x 360, normal 1280 x 720, high and best 1920 x 1080 with soft light and shadows",
    )
    resolution: Resolution | None = Field(
        default=None, description="[width, height], even; by the quality if not given [pixels]"
    )
    background: Annotated[Text, colour_or("transparent")] = Field(
        default="#f4f2ee", description="behind all: a colour name, '#rrggbb', or 'transparent' in .webm and .png"
    )
    crf: Annotated[int, Field(ge=0, le=51), whole, must_be("a whole number from 0 (lossless) to 51 (smallest)")] = (
        Field(default=18, description="constant rate factor of x264, from lossless to smallest: 6 more halve the file")
    )
    fade: Annotated[NotNegative, must_be("a number of seconds of 0 or more")] = Field(
        default=0.0, description="from the background at the start and to it at the end [s]"
    )
    shutter: Fraction = Field(
        default=0.0, description="part of the time between pictures that it is open; what moves is blurred as far"
    )
    sub_frames: Annotated[int, Field(ge=2, le=64), whole, must_be("a whole number from 2 to 64")] = Field(
        default=12, description="pictures that each is the mean of, where the shutter is open: it takes as much longer"
    )

    @property
    def exposure(self) -> float:
        """How long the shutter is open for each picture [s]."""
        return self.shutter * self.speed / self.fps

    @property
    def transparent(self) -> bool:
        """Whether its pictures have no background."""
        return self.background == "transparent"

    @property
    def channels(self) -> int:
        """Of its pictures: red, green and blue, and how much covers what is behind where they have no background."""
        return 4 if self.transparent else 3

    @property
    def behind(self) -> str:
        """The colour that its pictures are drawn for: of white, where they have no background."""
        return "white" if self.transparent else self.background

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the pictures [pixels]."""
        return self.resolution or _SIZES[self.quality]


_Row = Literal[
    "time", "particles", "impacts", "energy change", "dissipation",
    "temperature", "pressure", "speed", "pairs tested", "broad phases",
]  # fmt: skip
_ROWS = get_args(_Row)
_USUAL_ROWS = _ROWS[:4]


def _readout(value: Any) -> Any:
    """True, false or a list of rows. ValueError that names a word that is none."""
    if isinstance(value, bool):
        return value
    what = f"must be true, false or a list of {listed(_ROWS)}"
    check_words(value, _ROWS, what, "row")
    return list(value)


# Letters of a label at the most: more hide the picture.
_LABEL = 60
_Words = Annotated[str, Field(min_length=1, max_length=_LABEL), must_be(f"1 to {_LABEL} letters in quotes")]


class Label(Model):
    """Text beside a particle, or beside all of a group."""

    particle: Annotated[int, Field(ge=0), whole, must_be("the number of a particle, 0 the first")] | None = Field(
        default=None, description="its number, 0 the first, in the order of groups"
    )
    group: Text | None = Field(default=None, description="the name of a group, all of whose particles get a label")
    text: _Words | None = Field(
        default=None, description="what it says; the name of the group or the number of the particle if not given"
    )

    @model_validator(mode="after")
    def _either(self) -> Self:
        if (self.particle is None) == (self.group is None):
            raise ValueError("give particle or group, one of them")
        return self


class Show(Model):
    """What is drawn besides the particles."""

    box: Flag | None = Field(default=None, description="edges of the world; if not given, unless all axes are open")
    cells: Flag = Field(default=False, description="leaves of the octree")
    outlines: Flag = Field(default=False, description="dark lines where bodies end")
    plot: Annotated[Literal["energy", "momentum", "impacts"], one_of("energy", "momentum", "impacts")] | None = Field(
        default=None, description="curves over the time, which grow with the movie"
    )
    labels: list[Label] = Field(default_factory=list, description="text beside particles")
    title: Flag = Field(default=True, description="the scene's title over the opening of the movie, where it has one")
    readout: Annotated[bool | list[str], BeforeValidator(_readout, json_schema_input_type=bool | list[_Row])] = Field(
        default=True, description="which rows; true stands for time, particles, impacts and energy change"
    )
    legend: Flag | None = Field(
        default=None, description="scales of fields and names of colours; the scales alone if not given"
    )

    @property
    def rows(self) -> tuple[str, ...]:
        """The rows of the readout."""
        if isinstance(self.readout, bool):
            return _USUAL_ROWS if self.readout else ()
        return tuple(self.readout)
