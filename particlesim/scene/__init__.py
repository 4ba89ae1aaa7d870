"""The scene: what a scene file may say, as pydantic models. The same models build scenes from Python.

Every model refuses unknown keys. Where a table has kinds, its usual kind has a shorthand: ``size = 0.2`` for
``size = {kind = "fixed", value = 0.2}``, ``shape = "cube"`` for ``shape = {kind = "cube"}``.
"""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field, ValidationError, model_validator

from particlesim.scene.base import MAX_COUNT, Model, PlainFloat, Text, whole
from particlesim.scene.camera import Camera, FixedCamera, Movie, Show
from particlesim.scene.colours import FieldColour
from particlesim.scene.errors import SceneError
from particlesim.scene.fields import ForceField
from particlesim.scene.flow import Emitter, Sink
from particlesim.scene.groups import Group
from particlesim.scene.messages import hint, must_be, shown
from particlesim.scene.obstacles import Obstacle
from particlesim.scene.recording import Recording
from particlesim.scene.surface import WALLS, Contact
from particlesim.scene.validation_errors import explain
from particlesim.scene.world import Solver, World

# More frames than this are refused: a movie of months.
_MOST_FRAMES = 100_000_000

# More labels would hide what they are of.
_MOST_LABELS = 1000


class Scene(Model):
    """A whole scene. ``Scene(...)`` in Python takes what a scene file says, as dicts or as the models above.

    SceneError, in one line, if it is wrong. Paths start at the current folder.
    """

    title: Text = Field(default="", description="over the opening of the movie")
    seed: Annotated[int, Field(ge=0, le=2**63 - 1), whole, must_be("a whole number from 0 to 2^63 - 1")] = Field(
        default=0, description="of all that is random"
    )
    duration: Annotated[PlainFloat, Field(gt=0, le=1e9), must_be("a number of seconds above 0, up to 1e9")] = Field(
        default=10.0, description="how long it goes on [s]"
    )
    world: World = Field(description="the space that particles move in")
    particles: list[Group] = Field(default_factory=list, description="groups of particles")
    emitters: list[Emitter] = Field(default_factory=list, description="where particles come from while it goes on")
    sinks: list[Sink] = Field(default_factory=list, description="where they leave")
    obstacles: list[Obstacle] = Field(default_factory=list, description="bodies that nothing can push")
    fields: list[ForceField] = Field(default_factory=list, description="forces on particles")
    contact: list[Contact] = Field(
        default_factory=list, description="what two groups do to each other, in place of what they usually do"
    )
    solver: Solver = Field(default_factory=Solver, description="how the motion is computed")
    trajectory: Recording = Field(default_factory=Recording, description="what is kept of the motion in a file of it")
    movie: Movie = Field(default_factory=Movie, description="the file that comes out")
    camera: Camera = Field(default_factory=lambda: FixedCamera(kind="fixed"), description="where it is seen from")
    show: Show = Field(default_factory=Show, description="what is drawn besides particles")

    def __init__(self, /, **table: Any) -> None:
        try:
            super().__init__(**table)
        except ValidationError as error:
            raise SceneError(*explain(error, table, Scene)) from None

    def __repr__(self) -> str:
        """A line: a scene may list thousands of particles."""
        what = f"{self.number:,} particles in {len(self.groups):,} group{'s'[: len(self.groups) > 1]}"
        x, y, z = self.world.size
        called = f" {shown(self.title)}" if self.title else ""
        return f"<Scene{called}: {what}, {x:g} x {y:g} x {z:g} m, {self.duration:g} s, {self.frames:,} frames>"

    __str__ = __repr__

    @model_validator(mode="after")
    def _has_particles(self) -> Scene:
        if not self.groups:
            raise ValueError("there must be [[particles]] or [[emitters]]")
        return self

    @model_validator(mode="after")
    def _one_scale_for_a_field(self) -> Scene:
        scales: dict[str, FieldColour] = {}
        for g, group in enumerate(self.groups):
            colour = group.colour
            if isinstance(colour, FieldColour) and scales.setdefault(colour.field, colour) != colour:
                raise ValueError(f"{self.key(g)}.colour has another scale of {colour.field} than a group before it")
        return self

    @model_validator(mode="after")
    def _names_tell_groups_apart(self) -> Scene:
        known = {WALLS: "the walls have"}
        for key, entry in self._entries:
            if entry.name in known:
                raise ValueError(f"{key}.name = {shown(entry.name)}: {known[entry.name]} this name already")
            if entry.name is not None:
                known[entry.name] = f"{key} has"
        return self

    @model_validator(mode="after")
    def _contacts_are_between_groups(self) -> Scene:
        names = [WALLS, *(entry.name for _, entry in self._entries if entry.name is not None)]
        fixed = {WALLS, *(obstacle.name for obstacle in self.obstacles)}
        before: dict[frozenset[str], int] = {}
        for c, contact in enumerate(self.contact):
            where = f"contact[{c}].between = {shown(contact.between)}"
            for name in contact.between:
                if name not in names:
                    raise ValueError(f"{where}: no group or obstacle has the name {shown(name)}{hint(name, names)}")
            pair = frozenset(contact.between)
            if pair <= fixed:
                raise ValueError(f"{where}: walls and obstacles do not touch each other")
            if before.setdefault(pair, c) != c:
                raise ValueError(f"{where}: contact[{before[pair]}] is between these two already")
        return self

    @model_validator(mode="after")
    def _labels_are_of_particles(self) -> Scene:
        numbers = {group.name: group.number for group in self.groups if group.name is not None}
        labels = 0
        for k, label in enumerate(self.show.labels):
            if label.group is not None and label.group not in numbers:
                where = f"show.labels[{k}].group = {shown(label.group)}"
                raise ValueError(f"{where}: no group has this name{hint(label.group, numbers)}")
            if label.particle is not None and label.particle >= self.number:
                where = f"show.labels[{k}].particle = {label.particle}"
                raise ValueError(f"{where}: there are the particles 0 to {self.number - 1:,}")
            labels += 1 if label.group is None else numbers[label.group]
        if labels > _MOST_LABELS:
            raise ValueError(f"show.labels: are beside {labels:,} particles; there may be up to {_MOST_LABELS:,}")
        return self

    @model_validator(mode="after")
    def _storable(self) -> Scene:
        if self.number > MAX_COUNT:
            raise ValueError(f"{self.number:,} particles in all; there may be up to {MAX_COUNT:,}")
        return self

    @model_validator(mode="after")
    def _ends_some_day(self) -> Scene:
        if self.frames > _MOST_FRAMES:
            per_second = f"{self.movie.fps / self.movie.speed:g} frames a second of the scene"
            raise ValueError(
                f"duration = {self.duration:g} s at {per_second} makes {self.frames:,} frames; "
                f"there may be up to {_MOST_FRAMES:,}"
            )
        return self

    @property
    def _entries(self) -> list[tuple[str, Group | Obstacle]]:
        """All that may have a name, with their keys."""
        groups = ((self.key(g), group) for g, group in enumerate(self.groups))
        obstacles = ((f"obstacles[{k}]", obstacle) for k, obstacle in enumerate(self.obstacles))
        return [*groups, *obstacles]

    @property
    def groups(self) -> list[Group]:
        """All groups of particles: those that are there from the start, then those of emitters."""
        return [*self.particles, *self.emitters]

    def key(self, g: int) -> str:
        """Where the group ``g`` of all stands in a scene file."""
        first = len(self.particles)
        return f"particles[{g}]" if g < first else f"emitters[{g - first}]"

    @property
    def number(self) -> int:
        """How many particles the scene has, those that are yet to come among them."""
        return sum(group.number for group in self.groups)

    @property
    def is_open(self) -> bool:
        """Whether particles come and go."""
        return bool(self.emitters or self.sinks)

    @property
    def box_shown(self) -> bool:
        """Whether the edges of the world are drawn."""
        nothing_there = all(boundary == "open" for boundary in self.world.boundary)
        return self.show.box if self.show.box is not None else not nothing_there

    @property
    def frames(self) -> int:
        """How many frames the movie has, the first at time zero."""
        return self.frame_at(self.duration) + 1

    def frame_at(self, time: float) -> int:
        """The last frame that is not after ``time`` [s]."""
        return int(time * self.movie.fps / self.movie.speed + 1e-9)

    def time_of(self, frame: int) -> float:
        """The time of a frame [s]."""
        return frame * self.movie.speed / self.movie.fps
