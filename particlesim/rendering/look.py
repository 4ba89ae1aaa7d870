"""The look of a movie: all that its pictures depend on beside their frames, settled once for the whole run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from particlesim.core.constants import DISSIPATION
from particlesim.rendering.camera import WHOLE, Box, Window, subject_box
from particlesim.rendering.hud.overlay import Overlay
from particlesim.rendering.shading.colour import ParticleColours
from particlesim.scene import Scene
from particlesim.setup.build import contact_laws_of
from particlesim.trajectory.frames import Frame, Header, Ledger


@dataclass(frozen=True)
class Look:
    """How frames are drawn; the same for all frames of a movie, in whatever order and process they are drawn.

    Parameters
    ----------
    scene
        Camera, movie, what is shown, colours of groups, and the world.
    header
        What stays the same about the particles.
    subject
        The box that the camera frames [m].
    window
        Where in the picture it does: beside what lies over it.
    colours
        Colours of particles, with the scales of fields.
    start
        Ledger of the first frame, which changes refer to; None where it is not known.
    causes
        Of DISSIPATION, those that there can be in the scene.
    """

    scene: Scene
    header: Header
    subject: Box
    window: Window
    colours: ParticleColours
    start: Ledger | None
    causes: tuple[str, ...]


def look_of(scene: Scene, header: Header, first: Frame, frames: Sequence[Frame] = ()) -> Look:
    """The look of a movie of these particles whose first frame, at the start of the run, is ``first``.

    ``frames``: what scales are settled by where the scene leaves them open, in the order of time; ``first`` if none.
    """
    look = Look(
        scene=scene,
        header=header,
        subject=subject_box(scene, header, first),
        colours=ParticleColours(scene, header, frames or (first,)),
        start=first.ledger,
        causes=_causes(scene),
        window=WHOLE,
    )
    return replace(look, window=Overlay(look, dark=False).window(first))


def _causes(scene: Scene) -> tuple[str, ...]:
    """What can take energy in a scene, of DISSIPATION."""
    laws = contact_laws_of(scene)
    soft, weight = (laws["restitution"] < 1.0).any(), any(scene.world.gravity)
    rough, rolling = ((laws[name] > 0.0).any() for name in ("friction", "rolling_friction"))
    there = soft, rough, rough and rolling, soft and weight
    return tuple(cause for cause, possible in zip(DISSIPATION, there, strict=True) if possible)
