"""For how long nothing touches anything: where few bodies are far apart, all of them can go there in one stretch.

Every pair of bounding spheres is looked at once, however fast they are: bodies on all of which gravity acts alike, and
nothing else, go straight as seen from each other. The work of a fast body alone, or of a few that fall for a long
while, is then that of what they meet, not of how far they go.
"""

from __future__ import annotations

import math

from particlesim.core.jit import entry_kernel, kernel, without_refcounts
from particlesim.core.math3d import dot, scale, sub, to_vec3
from particlesim.dynamics.ccd.time_of_impact import sphere_half_space_impact, sphere_sphere_impact
from particlesim.dynamics.settings import MAX_PAIRS_AT_ONCE, MAX_STRETCH, MAX_SUBSTEPS, MIN_STRETCH
from particlesim.geometry.support import half_space_plane, is_sphere
from particlesim.model.bodies import STATIC, placed
from particlesim.model.domain import nearest_image
from particlesim.model.free_motion import free_acceleration
from particlesim.model.system import System

# The fraction of the time until something touches that bodies certainly do not: what rounding leaves of it is less.
_SURELY = 0.999


@kernel
def _time_of_pair(system, a, b):
    """For how long [s] two particles certainly do not touch."""
    period = system.domain[0].period
    offset = nearest_image(sub(to_vec3(b.position), to_vec3(a.position)), period)
    velocity, reach = sub(to_vec3(b.velocity), to_vec3(a.velocity)), a.radius + b.radius
    spheres = is_sphere(system.shapes, a.shape_row) and is_sphere(system.shapes, b.shape_row)
    if not spheres and dot(offset, offset) <= reach * reach:
        return 0.0
    time = sphere_sphere_impact(offset, velocity, reach, math.inf)
    for axis in range(3):
        if period[axis] > 0.0 and velocity[axis] != 0.0:
            # The next image is half a period away at least.
            time = min(time, max(0.5 * period[axis] - reach, 0.0) / abs(velocity[axis]))
    return time


@kernel
def _time_of_wall(system, b, wall):
    """For how long [s] a particle certainly does not touch a static half-space."""
    inward = scale(half_space_plane(system.shapes, placed(wall))[0], -1.0)
    room = dot(inward, sub(to_vec3(wall.position), to_vec3(b.position))) - b.radius
    if room <= 0.0 and not is_sphere(system.shapes, b.shape_row):
        return 0.0
    speed, acceleration = dot(inward, to_vec3(b.velocity)), dot(inward, free_acceleration(system, b))
    return sphere_half_space_impact(room, speed, acceleration, math.inf)


@entry_kernel
def _time_of_all(system, enough):
    system = without_refcounts(system)
    shortest = math.inf
    for i in range(system.particles):
        a = system.body[i]
        if a.resting != 0:
            return 0.0
        for j in range(system.bounded, len(system.body)):
            if system.body[j].kind != STATIC:
                return 0.0
            shortest = min(shortest, _time_of_wall(system, a, system.body[j]))
        for j in range(i + 1, system.particles):
            shortest = min(shortest, _time_of_pair(system, a, system.body[j]))
        if shortest <= enough:
            return 0.0
    return shortest


def longest_stretch(system: System, substep: float, wanted: float) -> float:
    """For how long [s] nothing touches anything, up to ``wanted``; 0 if that is not many times ``substep`` [s].

    It is not known, and 0, of many bodies, where there are obstacles other than walls, or where anything rests.
    """
    enough, many = MIN_STRETCH * substep, system.particles**2 > MAX_PAIRS_AT_ONCE
    if wanted <= enough or many or system.bounded > system.particles or system.meshes is not None:
        return 0.0
    return min(_SURELY * _time_of_all(system, enough), MAX_STRETCH * substep, wanted)


def check_work(duration: float, at_once: float) -> None:
    """ValueError if too much is to be done: a ``duration`` [s], no more than ``at_once`` [s] at a time."""
    if duration > MAX_SUBSTEPS * at_once:
        raise ValueError(f"a time step of {duration:g} s would take more than {MAX_SUBSTEPS:,} substeps")
