"""Whether a step was foreseen: bodies that no contact point is known of have not come so near that they may touch."""

from __future__ import annotations

from particlesim.core.jit import entry_kernel, kernel, without_refcounts
from particlesim.core.math3d import axpy, dot, norm, scale, sub
from particlesim.core.math3d import to_vec3 as vec
from particlesim.dynamics.contact.clearance import turning_speed
from particlesim.dynamics.contact.lasting_contacts import reach_of
from particlesim.dynamics.contact.parts_ahead import comes_upon_part
from particlesim.dynamics.contact.position_correction import travel
from particlesim.geometry.narrow_phase.half_space import half_space_separation
from particlesim.geometry.narrow_phase.pair import pair_nearer
from particlesim.geometry.narrow_phase.parts import parts_nearer
from particlesim.geometry.support import half_space_plane, has_parts, is_sphere
from particlesim.model.bodies import angular_velocity, placed
from particlesim.model.domain import nearest_image


@kernel
def _ways(system, motion, ahead, carried, i):
    """How far a body goes in the step: to where it is in the end, straight until it is struck, and by turning [m].

    What is free falls, which is one and the same. Turning is by as much as surfaces move at most.
    """
    b, then, duration = system.body[i], ahead[i], motion.duration
    if not carried[i]:
        fall = scale(vec(system.domain[0].gravity), 0.5 * duration * duration)
        shift = axpy(fall, vec(b.velocity), duration)
        return shift, shift, turning_speed(system, motion.spin, i) * duration
    shift, turn = travel(system, ahead, i)
    if i < system.particles and not is_sphere(system.shapes, b.shape_row):
        turn = max(turn, norm(angular_velocity(then)) * b.radius * duration)
    return shift, scale(vec(then.velocity), duration), turn


@kernel
def _nearer(system, meshes, a, b, distance):
    """Whether two bounded bodies, as their records have them, are nearer than a distance [m]."""
    offset = nearest_image(sub(vec(b.position), vec(a.position)), system.domain[0].period)
    if meshes is not None and (has_parts(system.shapes, a.shape_row) or has_parts(system.shapes, b.shape_row)):
        return parts_nearer(system.shapes, meshes, placed(a), placed(b), offset, distance)
    return pair_nearer(system.shapes, placed(a), placed(b), offset, distance)


@kernel
def _meet(system, motion, ahead, carried, pair, clear):
    """Whether two bodies that are ``clear`` apart or more meet in the step, unknown to contacts.

    Those that are carried do if they touch in the end, others if their ways are long enough.
    """
    i, j = pair
    reach, _, lossless = reach_of(system, motion, i, j)
    if lossless or clear <= reach:
        return False
    shift_a, straight_a, turn_a = _ways(system, motion, ahead, carried, i)
    shift_b, straight_b, turn_b = _ways(system, motion, ahead, carried, j)
    both, way = carried[i] and carried[j], norm(sub(shift_b, shift_a))
    if not both:
        way = max(way, norm(sub(straight_b, straight_a)))
    way += turn_a + turn_b
    if clear > way or not _nearer(system, system.meshes, system.body[i], system.body[j], way):
        return False
    return not both or _nearer(system, system.meshes, ahead[i], ahead[j], 0.0)


@kernel
def _meets_plane(system, motion, ahead, i, j):
    """Whether a particle is in a half-space by the end of the step, unknown to contacts."""
    normal, level = half_space_plane(system.shapes, placed(ahead[j]))
    offset = sub(vec(ahead[j].position), vec(ahead[i].position))
    if -dot(normal, offset) - level > ahead[i].radius:
        return False
    reach, _, lossless = reach_of(system, motion, i, j)
    a, b = system.body[i], system.body[j]
    before, _ = half_space_separation(system.shapes, placed(a), placed(b), sub(vec(b.position), vec(a.position)))
    after, _ = half_space_separation(system.shapes, placed(ahead[i]), placed(ahead[j]), offset)
    return not lossless and before > reach and after < 0.0


@kernel
def _meets_surroundings(system, meshes, motion, ahead, i, j):
    """Whether a particle is in a half-space or a mesh by the end of the step, unknown to contacts."""
    shapes, a, b = system.shapes, system.body[i], system.body[j]
    if meshes is not None and (has_parts(shapes, a.shape_row) or has_parts(shapes, b.shape_row)):
        reach, _, lossless = reach_of(system, motion, i, j)
        return not lossless and comes_upon_part(system, meshes, ahead, (i, j), reach)
    return _meets_plane(system, motion, ahead, i, j)


@entry_kernel
def unforeseen(system, neighbours, motion, search, ahead, carried):
    """Whether any of the bodies that are ``carried`` (n,), or held, may meet another, unknown to contacts.

    What is carried goes straight until it is struck, and has gained and lost what it does by the end of the step: it is
    not to be struck by what is free, but for what rebounds in full. What is held may be.
    """
    system, neighbours, motion, search, ahead = without_refcounts((system, neighbours, motion, search, ahead))
    for i in range(system.particles):
        place, now, held = neighbours.place[i], search.round[i], motion.held[i]
        if now < 0:
            continue
        for near in range(neighbours.start[place], neighbours.start[place + 1]):
            j = neighbours.body[neighbours.other[near]]
            if not ((carried[i] and not held) or (carried[j] and j < system.particles and not motion.held[j])):
                continue
            if search.round[j] < 0 or search.round[j] > now or (search.round[j] == now and j > i):
                clear = search.clearance[near] - search.displacement[i] - search.displacement[j]
                if _meet(system, motion, ahead, carried, (i, j), clear):
                    return True
        for j in range(system.bounded, len(system.body)):
            if carried[i] and not held and _meets_surroundings(system, system.meshes, motion, ahead, i, j):
                return True
    return False
