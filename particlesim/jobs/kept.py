"""What a trajectory must have kept for what is to be made of it: what it has not is said before any work."""

from __future__ import annotations

from particlesim.rendering.camera import foresees_flight
from particlesim.rendering.shading.fields import field_colours
from particlesim.scene import Scene
from particlesim.scene.groups import SphereShape
from particlesim.trajectory.gsd_chunks import TrajectoryError
from particlesim.trajectory.gsd_file import Trajectory

# Quantities of the particles, each with what cannot be without it.
Uses = dict[str, str]


def check_kept(source: Scene | Trajectory, uses: Uses) -> None:
    """TrajectoryError if a trajectory has not kept a quantity that is used; of a scene all of them are there."""
    if isinstance(source, Trajectory):
        for quantity, what in uses.items():
            if quantity not in source.fields:
                kept = f"[trajectory] fields = {source.fields}".replace("'", '"')
                raise TrajectoryError(f"{source.path}: keeps no {quantity}, which {what} needs: its scene has {kept}")


def uses_of_pictures(scene: Scene) -> Uses:
    """What pictures need that look like this."""
    shown = {colour.field for colour in field_colours(scene) if colour is not None}
    uses = uses_of_shapes(scene)
    if foresees_flight(scene):
        uses["velocity"] = "a camera that follows where particles will fly"
    if "speed" in scene.show.rows:
        uses["velocity"] = "the readout of the speed"
    if "speed" in shown:
        uses["velocity"] = "colour by_speed"
    if scene.movie.shutter:
        uses["velocity"] = "motion blur"
        if "orientation" in uses:
            uses["angular_momentum"] = "motion blur of a shape that turns"
    if "impacts" in shown:
        uses["impacts"] = "colour by_impacts"
    return uses


def uses_of_shapes(scene: Scene) -> Uses:
    """What shapes need, wherever they are shown."""
    turning = any(not isinstance(group.shape, SphereShape) for group in scene.groups)
    return {"orientation": "a shape that turns"} if turning else {}
