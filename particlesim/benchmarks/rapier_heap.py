"""The particles of a model in Rapier (https://rapier.rs), a physics engine for games, as it comes but for gravity."""

from __future__ import annotations

from typing import Any

import rapier3d
from rapier3d import Collider, Isometry3, RigidBody, Rotation3, Vec3

from particlesim.core.constants import SPHERE
from particlesim.geometry.shapes import Shape
from particlesim.model.system import Model


def _collider(shape: Shape, size: float, **surface: float) -> Any:
    if shape.kind == SPHERE:
        return Collider.ball(0.5 * size, **surface)
    if shape.name == "cube":
        return Collider.cuboid(*(3 * [0.5 * size]), **surface)
    return Collider.convex_hull(shape.vertices * size, **surface)


def rapier_world(model: Model, friction: float, restitution: float, threads: int) -> rapier3d.PhysicsWorld:
    """The particles of a model, spheres and sharp polyhedra, between its walls."""
    system, surface = model.system, {"friction": friction, "restitution": restitution}
    world = rapier3d.PhysicsWorld(gravity=tuple(system.domain[0]["gravity"].tolist()))
    world.set_num_threads(threads)
    for wall in system.body[system.bounded :]:
        axis, upper = divmod(int(wall["wall"]), 2)
        normal = [0.0, 0.0, 0.0]
        normal[axis] = 1.0 - 2.0 * upper
        world.add_collider(Collider.halfspace(normal, translation=wall["position"].tolist(), **surface))
    for b in model.particles:
        collider = _collider(model.shapes[b["shape_row"]], float(b["scale"]), density=1000.0, **surface)
        turned = Isometry3(Vec3(*b["position"].tolist()), Rotation3(*b["orientation"].tolist()))
        body = RigidBody.dynamic(position=turned)
        world.add_body(body, colliders=[collider])
    return world
