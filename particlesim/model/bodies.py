"""Bodies of every kind as rows of one array of records: what is read together lies together.

Particles (dynamic bodies) come first, then obstacles of bounded extent, static or kinematic, then half-spaces such as
the walls of a box. A pair (i, j) has i < j, so i is always a particle. What cannot be pushed has inverse mass and
inverse inertia 0: impulses pass it by without a special case.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from particlesim.core.jit import entry_kernel, kernel, without_refcounts
from particlesim.core.math3d import inverse_rotate, rotate, to_quat, to_vec3
from particlesim.core.records import record
from particlesim.geometry.shapes import Shape

# What moves a body: forces and impulses, a prescribed path, or nothing.
DYNAMIC, KINEMATIC, STATIC = 0, 1, 2

# Four cache lines of 64 bytes. The first two are all that a pass over bodies without a preferred axis reads and writes:
# where they go, and how they turn. Then how they are pushed, and what is seldom read. Records of numpy have a shape and
# a size of their own, so the fields have other names.
BODY = record(
    [
        ("position", "f8", (3,)),  # centroid; of obstacles the point that they turn about [m]
        ("radius", "f8"),  # bounding sphere about the position [m]
        ("velocity", "f8", (3,)),  # [m/s]
        ("shape_row", "i4"),  # row of the shape table
        ("kind", "i2"),  # DYNAMIC, KINEMATIC or STATIC
        ("resting", "i1"),  # whether resting contacts carry it through the present substep: it does not fall
        ("disturbed", "i1"),  # whether it was struck in the present substep: its local clock counts
        ("orientation", "f8", (4,)),  # unit quaternion, body to world
        ("angular_momentum", "f8", (3,)),  # about the position, world axes [kg m^2/s]
        ("isotropic_inertia", "f8"),  # the moment of what has no preferred axis, 0 of others [kg m^2]
        ("principal_inertia", "f8", (3,)),  # that free rotation follows; 1 of kinematic bodies [kg m^2]
        ("inverse_inertia", "f8", (3,)),  # 0 of what is not dynamic [1/(kg m^2)]
        ("inverse_mass", "f8"),  # 0 of what is not dynamic [1/kg]
        ("scale", "f8"),  # factor on the shape of size 1
        ("mass", "f8"),  # infinite of what is not dynamic [kg]
        ("inradius", "f8"),  # inscribed sphere; infinite of surroundings, whose size says nothing [m]
        ("time", "f8"),  # local clock: when the record describes the body, since the start of the substep [s]
        ("material", "i4"),  # row and column of the contact laws
        ("group", "i4"),  # entry of the scene's particles that it came from; -1 of obstacles
        ("image", "i4", (3,)),  # how often it left a periodic domain by its upper faces
        ("wall", "i4"),  # which wall of the domain it is, in the order of WALL_NAMES; -1 if none
        ("motion", "i4"),  # row of the prescribed motions; -1 if none
        ("id", "i4"),  # of a particle: its place among all that there ever are; -1 of obstacles
        ("entry", "i4"),  # of an obstacle: its place among those of the scene; -1 of particles and walls
        ("reserved", "i4"),  # to the end of the cache line: room for what comes next
    ]
)

# Moments of inertia closer than this fraction of each other are equal.
EQUAL_MOMENTS = 1e-12


def _isotropic(moments: np.ndarray) -> np.ndarray:
    """The moment of bodies whose moments (n, 3) are all equal, 0 of others, (n,)."""
    first, others = moments[:, :1], moments[:, 1:]
    equal = (np.abs(first - others) <= EQUAL_MOMENTS * (first + others)).all(axis=1)
    return np.where(equal, moments[:, 0], 0.0)


class Particles(NamedTuple):
    """The dynamic bodies as a script sees them: views of their records, but for what is computed from them."""

    shape: np.ndarray  # (n,) row of the shape table
    group: np.ndarray  # (n,) which entry of the scene's particles it came from
    size: np.ndarray  # (n,) factor on the shape of size 1
    mass: np.ndarray  # (n,) [kg]
    inertia: np.ndarray  # (n, 3) principal moments [kg m^2]
    restitution: np.ndarray  # (n,) of the particle's material, computed
    radius: np.ndarray  # (n,) bounding sphere [m]
    inradius: np.ndarray  # (n,) inscribed sphere [m]
    position: np.ndarray  # (n, 3) centroid [m]
    orientation: np.ndarray  # (n, 4) unit quaternion, body to world
    velocity: np.ndarray  # (n, 3) [m/s]
    angular_momentum: np.ndarray  # (n, 3) about the centroid, world axes [kg m^2/s]
    image: np.ndarray  # (n, 3) how often it left a periodic domain by its upper faces
    angular_velocity: np.ndarray  # (n, 3) world axes [rad/s], computed
    impacts: np.ndarray  # (n,) int64, how many each has had since the start


def make_particles(
    shapes: Sequence[Shape], shape: np.ndarray, group: np.ndarray, size: np.ndarray, density: np.ndarray
) -> np.ndarray:
    """Dynamic bodies at the origin and at rest, (n,) BODY.

    Parameters
    ----------
    shapes : sequence of Shape
        The shapes that the rows of ``shape`` refer to.
    shape, group : (n,) int
        Row of ``shapes``, and entry of the scene's particles; the material is ``group + 1``.
    size, density : (n,) float
        Factor on the shape of size 1, and density [kg/m^3].
    """
    bodies = np.zeros(len(shape), dtype=BODY)
    volume = np.array([s.volume for s in shapes])[shape] * size**3
    moments = np.array([s.moments for s in shapes]).reshape(-1, 3)[shape] * (size**5)[:, None]
    bodies["orientation"][:, 0] = 1.0
    bodies["shape_row"], bodies["group"], bodies["material"], bodies["scale"] = shape, group, group + 1, size
    bodies["mass"] = density * volume
    bodies["inverse_mass"] = 1.0 / bodies["mass"]
    bodies["principal_inertia"] = density[:, None] * moments
    bodies["inverse_inertia"] = 1.0 / bodies["principal_inertia"]
    bodies["isotropic_inertia"] = _isotropic(bodies["principal_inertia"])
    bodies["radius"] = np.array([s.radius for s in shapes])[shape] * size
    bodies["inradius"] = np.array([s.inradius for s in shapes])[shape] * size
    bodies["wall"] = bodies["motion"] = bodies["entry"] = -1
    bodies["id"] = np.arange(len(bodies))
    return bodies


def make_obstacles(count: int) -> np.ndarray:
    """Static bodies of size 1 at the origin, (count,) BODY, that nothing can push."""
    bodies = np.zeros(count, dtype=BODY)
    bodies["orientation"][:, 0] = 1.0
    bodies["scale"] = bodies["principal_inertia"] = bodies["isotropic_inertia"] = 1.0
    bodies["mass"] = bodies["radius"] = bodies["inradius"] = np.inf
    bodies["kind"] = STATIC
    bodies["group"] = bodies["wall"] = bodies["motion"] = bodies["id"] = bodies["entry"] = -1
    return bodies


@kernel
def placed(b):
    """A body as the narrow phase takes it: (shape, size, orientation)."""
    return b.shape_row, b.scale, to_quat(b.orientation)


@kernel
def angular_velocity_of(orientation, momentum, principal_inertia):
    """Angular velocity of a body with the given angular momentum about its centroid, both in world axes."""
    own = inverse_rotate(orientation, momentum)
    own = own[0] / principal_inertia[0], own[1] / principal_inertia[1], own[2] / principal_inertia[2]
    return rotate(orientation, own)


@kernel
def angular_velocity(b):
    """Angular velocity of a body, world axes [rad/s]."""
    return angular_velocity_of(to_quat(b.orientation), to_vec3(b.angular_momentum), to_vec3(b.principal_inertia))


@kernel
def angular_velocity_change(b, angular_impulse):
    """By how much an angular impulse [N m s] changes the angular velocity of a body, world axes [rad/s]."""
    q, inverse = to_quat(b.orientation), b.inverse_inertia
    own = inverse_rotate(q, angular_impulse)
    return rotate(q, (own[0] * inverse[0], own[1] * inverse[1], own[2] * inverse[2]))


@entry_kernel
def angular_velocities(body, count):
    """Angular velocities of the first ``count`` bodies, (count, 3), world axes [rad/s]."""
    body = without_refcounts(body)
    out = np.empty((count, 3))
    for i in range(count):
        out[i, 0], out[i, 1], out[i, 2] = angular_velocity(body[i])
    return out


@kernel
def per_mass(b, value):
    """A value divided by the mass of a body; 0 for what cannot be pushed."""
    return value * b.inverse_mass
