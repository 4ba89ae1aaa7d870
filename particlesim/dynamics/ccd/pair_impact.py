"""The next impact of a particle with another or with a wall, along the paths they are on."""

import math

from particlesim.core.constants import APPROACH_TOLERANCE, IMPACT_TOLERANCE, SPHERE, WALL
from particlesim.core.jit import kernel
from particlesim.core.math3d import add, cross, dot, load_vec3, norm, scale, sub
from particlesim.dynamics.ccd.time_of_impact import (
    first_touch,
    most_closing,
    sphere_meets_wall,
    spheres_meet,
    spheres_near,
)
from particlesim.geometry.narrow_phase.gjk import NO_CORNERS
from particlesim.geometry.narrow_phase.half_space import wall_contact, wall_normal
from particlesim.geometry.narrow_phase.hull_hull import hulls_nearer
from particlesim.geometry.narrow_phase.pair import nearest_image, pair_contact
from particlesim.model.free_motion import free_path, spin_of


@kernel
def later(path, moments, time):
    """The path (position, orientation, velocity, momentum, acceleration) as seen ``time`` seconds later."""
    position, turn, velocity, momentum, acceleration = path
    if time == 0.0:
        return path
    position, turn, velocity = free_path(position, turn, velocity, momentum, moments, acceleration, time)
    return position, turn, velocity, momentum, acceleration


@kernel
def velocity_at(path, moments, arm):
    """Velocity of the point of a body at ``arm`` from its centroid."""
    return add(path[2], cross(spin_of(path[1], path[3], moments), arm))


@kernel
def _speed_at_depth(depth, acceleration):
    """Half the speed that an acceleration gives to bodies until they have sunk into each other by ``depth`` [m/s].

    What parts more slowly would meet again within a moment, over and over.
    """
    return 0.5 * math.sqrt(2.0 * acceleration * depth)


@kernel(inline=True)
def _touches(table, world, body_i, path_i, body_j, path_j, wall, points):
    """Whether two bodies touch; whether any point of their contact approaches; how deep they may go if none does [m].

    If they part everywhere, that is as deep as they are. If not, or if they part so slowly that they would be back at
    once, it is ``world.sinking`` of their sizes, or a little deeper than they are up to twice that.
    """
    if wall >= 0:
        separation, count = wall_contact(table, world, wall, body_i[0], body_i[1], path_i[1], path_i[0], points)
        normal, offset = wall_normal(wall), (0.0, 0.0, 0.0)
        sizes = body_i[1]
    else:
        offset = nearest_image(sub(path_j[0], path_i[0]), world.period)
        separation, normal, count = pair_contact(
            table, body_i[0], body_i[1], path_i[1], body_j[0], body_j[1], path_j[1], offset, points
        )
        sizes = body_i[1] + body_j[1]
    tolerance = IMPACT_TOLERANCE * sizes
    touching = separation <= tolerance
    pull = path_i[4] if wall >= 0 else sub(path_j[4], path_i[4])
    sinking = world.sinking * sizes
    at_once = _speed_at_depth(sinking, norm(pull))
    approaching, leaving = False, True
    for k in range(count if touching else 0):
        of_i = velocity_at(path_i, body_i[3], load_vec3(points, k))
        parting, speed = -dot(of_i, normal), norm(of_i)
        if wall < 0:
            of_j = velocity_at(path_j, body_j[3], sub(load_vec3(points, k), offset))
            parting += dot(of_j, normal)
            speed += norm(of_j)
        none = APPROACH_TOLERANCE * speed + world.still
        approaching = approaching or parting < -none
        leaving = leaving and parting > none + at_once
    depth = max(0.0, -separation) + 4.0 * tolerance
    if not leaving:
        depth = max(sinking, depth, min(depth + 0.25 * sinking, 2.0 * sinking))
    return touching, approaching, depth


@kernel
def _hull_meets(table, world, body_i, path_i, body_j, path_j, wall, start, end, corners, points):
    """When two bodies of which one at least is a hull meet in ``start .. end``, on paths given at time 0."""
    if wall < 0 and corners[0] == 0 and table.kind[body_i[0]] != SPHERE and table.kind[body_j[0]] != SPHERE:
        # Most are too far apart, which the first direction or two of the distance algorithm tell.
        offset = nearest_image(sub(path_j[0], path_i[0]), world.period)
        way = most_closing(body_i, path_i, body_j, path_j, end)
        if not hulls_nearer(table, body_i[0], body_i[1], path_i[1], body_j[0], body_j[1], path_j[1], offset, way):
            return math.inf
    where = table, world.lower, world.upper, world.period, body_i, path_i, body_j, path_j, wall, start, end
    time = first_touch(*where, 0.0, corners, points)
    if time == start:
        then_i = later(path_i, body_i[3], start)
        then_j = later(path_j, body_j[3], start)
        touching, approaching, depth = _touches(table, world, body_i, then_i, body_j, then_j, wall, points)
        if touching and not approaching:
            time = first_touch(*where, depth, corners, points)
    return time


@kernel(inline=True)
def body_of(constants, i):
    """Shape, size, radius and moments of particle ``i``."""
    return constants.shape[i], constants.size[i], constants.radius[i], load_vec3(constants.inertia, i)


@kernel(inline=True)
def _spheres_meet(body_i, path_i, body_j, path_j, offset, still, duration):
    """When two spheres under the same acceleration meet, at once only if they approach by more than rounding."""
    velocity = sub(path_j[2], path_i[2])
    reach = body_i[2] + body_j[2]
    time = spheres_meet(offset, velocity, reach, duration)
    if time == 0.0:
        of_i = velocity_at(path_i, body_i[3], scale(offset, body_i[2] / reach))
        of_j = velocity_at(path_j, body_j[3], scale(offset, -body_j[2] / reach))
        tolerance = APPROACH_TOLERANCE * (norm(of_i) + norm(of_j)) + still
        if dot(offset, velocity) >= -tolerance * norm(offset):
            time = math.inf
    return time


@kernel(inline=True)
def pair_meets(table, world, kind_i, body_i, path_i, kind_j, body_j, path_j, duration, corners, points):
    """When two particles meet within ``duration`` on paths given at time 0; inf if they do not.

    ``corners`` are those that hulls looked into before were found to be nearest by, or NO_CORNERS (see gjk.py).
    """
    offset = nearest_image(sub(path_j[0], path_i[0]), world.period)
    acceleration = sub(path_j[4], path_i[4])
    if kind_i == SPHERE and kind_j == SPHERE and dot(acceleration, acceleration) == 0.0:
        time = _spheres_meet(body_i, path_i, body_j, path_j, offset, world.still, duration)
    else:
        # Bounding spheres first: larger by what the acceleration could do.
        reach = body_i[2] + body_j[2] + 0.5 * norm(acceleration) * duration * duration
        time, end = spheres_near(offset, sub(path_j[2], path_i[2]), reach, duration)
        if time < math.inf:
            time = _hull_meets(table, world, body_i, path_i, body_j, path_j, -1, time, end, corners, points)
    return time


@kernel(inline=True)
def _sphere_meets_wall(body, path, normal, room, speed, acceleration, still, sinking, duration):
    """When a sphere meets a wall; if it touches it and hardly moves, when it has sunk into it a little."""
    if room <= IMPACT_TOLERANCE * body[1]:
        surface = velocity_at(path, body[3], scale(normal, body[2]))
        none = APPROACH_TOLERANCE * norm(surface) + still
        if -none - _speed_at_depth(sinking, max(acceleration, 0.0)) <= speed <= none:
            room = max(0.25 * sinking, sinking + room)
    return sphere_meets_wall(room, speed, acceleration, duration)


@kernel(inline=True)
def wall_meets(table, world, lower, upper, boundary, kind, body, path, wall, duration, points):
    """When a particle meets a wall within ``duration`` on a path given at time 0; inf if it does not."""
    time = math.inf
    axis = wall // 2
    if boundary[axis] == WALL:
        normal = wall_normal(wall)
        room = (upper[axis] - path[0][axis] if wall % 2 else path[0][axis] - lower[axis]) - body[2]
        speed, acceleration = dot(path[2], normal), dot(path[4], normal)
        if kind == SPHERE:
            time = _sphere_meets_wall(
                body, path, normal, room, speed, acceleration, world.still, world.sinking * body[1], duration
            )
        else:
            time = sphere_meets_wall(room, speed, acceleration, duration)
            if time < math.inf or room <= 0.0:
                start = time if room > 0.0 else 0.0
                time = _hull_meets(table, world, body, path, body, path, wall, start, duration, NO_CORNERS, points)
    return time
