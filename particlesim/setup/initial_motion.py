"""How particles start: their velocities and spins."""

from __future__ import annotations

import numpy as np

from particlesim.core.rotations import rotations_of
from particlesim.scene import Scene
from particlesim.scene.groups import (
    FixedVelocity,
    Group,
    Maxwell,
    RadialVelocity,
    SpinMaxwell,
    SpinUniform,
    UniformSpeed,
)
from particlesim.scene.placements import ListPlacement


def random_quaternions(random: np.random.Generator, count: int) -> np.ndarray:
    """Evenly distributed orientations, (count, 4): four normal deviates, normalised."""
    q = random.normal(size=(count, 4))
    return q / np.linalg.norm(q, axis=1, keepdims=True)


def set_in_motion(scene: Scene, bodies: np.ndarray, randoms: list[np.random.Generator]) -> None:
    """Give particles (n,) BODY, which stand where they start, the velocities and spins that their groups say."""
    for g, (group, random) in enumerate(zip(scene.groups, randoms, strict=True)):
        members = bodies["group"] == g
        if not members.any():
            continue
        own = bodies[members]
        bodies["velocity"][members] = _velocities(group, own["position"], own["mass"], random)
        bodies["angular_momentum"][members] = _angular_momenta(
            group, own["orientation"], own["principal_inertia"], random
        )


def _directions(random: np.random.Generator, count: int) -> np.ndarray:
    """Evenly distributed unit vectors, (count, 3)."""
    v = random.normal(size=(count, 3))
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def _velocities(group: Group, position: np.ndarray, mass: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Velocities of a group, (count, 3) [m/s]."""
    law, count = group.velocity, len(position)
    if isinstance(law, Maxwell):
        velocity = np.sqrt(law.temperature / mass)[:, None] * random.normal(size=(count, 3)) + law.drift
    elif isinstance(law, UniformSpeed):
        velocity = law.speed * _directions(random, count) + law.drift
    elif isinstance(law, FixedVelocity):
        velocity = np.tile(law.vector, (count, 1))
    elif isinstance(law, RadialVelocity):
        offset = position - law.centre
        distance = np.linalg.norm(offset, axis=1, keepdims=True)
        outward = np.divide(offset, distance, out=np.zeros_like(offset), where=distance > 0.0)
        velocity = outward * (law.speed if law.kind == "outward" else -law.speed)
    else:
        velocity = np.zeros((count, 3))
    return _overridden(group, velocity, "velocity")


def _angular_momenta(
    group: Group, orientation: np.ndarray, inertia: np.ndarray, random: np.random.Generator
) -> np.ndarray:
    """Angular momenta of a group in world axes, (count, 3) [kg m^2/s]."""
    law, count = group.spin, len(orientation)
    if not count:
        return np.zeros((0, 3))
    rotation = rotations_of(orientation)
    if isinstance(law, SpinMaxwell):
        spin = rotation.apply(np.sqrt(law.temperature / inertia) * random.normal(size=(count, 3)))
    elif isinstance(law, SpinUniform):
        spin = law.speed * _directions(random, count)
    elif isinstance(law, FixedVelocity):
        spin = np.tile(law.vector, (count, 1))
    else:
        spin = np.zeros((count, 3))
    spin = _overridden(group, spin, "spin")
    return rotation.apply(inertia * rotation.apply(spin, inverse=True))


def _overridden(group: Group, values: np.ndarray, key: str) -> np.ndarray:
    """Values of a group with those that the poses of a list state themselves put in."""
    if isinstance(group.placement, ListPlacement):
        for k, pose in enumerate(group.placement.poses):
            own = getattr(pose, key)
            if own is not None:
                values[k] = own
    return values
