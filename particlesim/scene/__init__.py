"""The scene: what a scene file may say, as pydantic models. The same models build scenes from Python.

Every model refuses unknown keys. Where a table has kinds, its usual kind has a shorthand: ``size = 0.2`` for
``size = {kind = "fixed", value = 0.2}``, ``shape = "cube"`` for ``shape = {kind = "cube"}``.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import Field, PrivateAttr

from particlesim.scene.base import Model, Positive
from particlesim.scene.groups import Group
from particlesim.scene.picture import Camera, FixedCamera, Movie, Show
from particlesim.scene.world import Solver, World


class Scene(Model):
    """A whole scene. ``Scene(...)`` in Python takes what a scene file says, as dicts or as the models above."""

    title: str = ""
    seed: Annotated[int, Field(ge=0)] = 0
    duration: Positive = 10.0  # [s]
    world: World
    particles: Annotated[list[Group], Field(min_length=1)]
    solver: Solver = Field(default_factory=Solver)
    movie: Movie = Field(default_factory=Movie)
    camera: Camera = Field(default_factory=lambda: FixedCamera(kind="fixed"))
    show: Show = Field(default_factory=Show)
    _folder: Path = PrivateAttr(default_factory=Path)

    @property
    def folder(self) -> Path:
        """Where relative paths of the scene start: the folder of its file."""
        return self._folder

    def set_folder(self, folder: Path) -> None:
        """Let relative paths start at ``folder``."""
        self._folder = folder

    @property
    def number(self) -> int:
        """How many particles the scene has."""
        return sum(group.number for group in self.particles)

    @property
    def frames(self) -> int:
        """How many frames the movie has, the first at time zero."""
        return int(self.duration * self.movie.fps + 1e-9) + 1
