"""Which bodies touch or overlap where they are now, and how deep."""

from __future__ import annotations

import numpy as np

from particlesim.core.constants import MAX_MANIFOLD
from particlesim.core.jit import entry_kernel, kernel, without_refcounts
from particlesim.core.math3d import dot, load_vec3, set_vec3, sub, to_vec3
from particlesim.core.parallel import ThreadTeam
from particlesim.geometry.narrow_phase.gjk import NO_SIMPLEX
from particlesim.geometry.narrow_phase.pair import pair_overlaps, pair_separation
from particlesim.geometry.narrow_phase.parts import parts_separation
from particlesim.geometry.support import has_parts
from particlesim.model.bodies import placed
from particlesim.model.domain import nearest_image
from particlesim.model.system import System


@kernel
def offset_of(system, i, j):
    """Position of body j from that of body i, by the shortest way round a periodic domain."""
    a, b = system.body[i], system.body[j]
    return nearest_image(sub(to_vec3(b.position), to_vec3(a.position)), system.domain[0].period)


@kernel
def overlaps_any(shapes, meshes, a, point, others, period, points):
    """Whether a body ``a``, put at a ``point``, overlaps any of ``others``; ``points`` is scratch."""
    placed_a = placed(a)
    for k in range(len(others)):
        b = others[k]
        offset = nearest_image(sub(to_vec3(b.position), point), period)
        reach = a.radius + b.radius
        if dot(offset, offset) > reach * reach:
            continue
        if meshes is not None and (has_parts(shapes, a.shape_row) or has_parts(shapes, b.shape_row)):
            if parts_separation(shapes, meshes, placed_a, placed(b), offset, points)[0] <= 0.0:
                return True
        elif pair_overlaps(shapes, placed_a, placed(b), offset, points):
            return True
    return False


@entry_kernel
def put_where_free(system, others, count, bodies, proposals):
    """Put each of ``bodies`` (m,) BODY at the first of its ``proposals`` (m, tries, 3) [m] where it is free.

    ``others`` (k,) BODY: the first ``count`` of them are in its way; it has room for m more, which are added. Returns
    how many found a place before one that did not.
    """
    system, others, bodies, proposals = without_refcounts((system, others, bodies, proposals))
    points, period = np.empty((MAX_MANIFOLD, 3)), to_vec3(system.domain[0].period)
    for i in range(len(bodies)):
        found = False
        for attempt in range(proposals.shape[1]):
            point = load_vec3(proposals[i], attempt)
            if not overlaps_any(system.shapes, system.meshes, bodies[i], point, others[:count], period, points):
                set_vec3(bodies[i].position, point)
                found = True
                break
        if not found:
            return i
        others[count] = bodies[i]
        count += 1
    return len(bodies)


@kernel
def separation_along(shapes, meshes, a, b, offset, points):
    """Separation and normal of two placed shapes; of what has parts see ``parts_separation``."""
    if meshes is not None and (has_parts(shapes, a[0]) or has_parts(shapes, b[0])):
        return parts_separation(shapes, meshes, a, b, offset, points)
    separation, normal, _ = pair_separation(shapes, a, b, offset, NO_SIMPLEX, points)
    return separation, normal


@entry_kernel
def separation_of(system, i, j):
    """Separation of bodies i < j where they are now [m]; of what has parts any above 0 if they are apart."""
    system = without_refcounts(system)
    points = np.empty((MAX_MANIFOLD, 3))
    a, b = placed(system.body[i]), placed(system.body[j])
    return separation_along(system.shapes, system.meshes, a, b, offset_of(system, i, j), points)[0]


@entry_kernel
def _mark_touching(system, meshes, pairs, touches, first, last):
    """Mark which of the candidate pairs ``first .. last`` touch or overlap."""
    system, pairs, touches = without_refcounts((system, pairs, touches))
    points, shapes = np.empty((MAX_MANIFOLD, 3)), system.shapes
    for k in range(first, last):
        a, b = system.body[pairs[k, 0]], system.body[pairs[k, 1]]
        offset = offset_of(system, pairs[k, 0], pairs[k, 1])
        reach = a.radius + b.radius
        touches[k] = dot(offset, offset) <= reach * reach
        if meshes is not None and (has_parts(shapes, a.shape_row) or has_parts(shapes, b.shape_row)):
            touches[k] = touches[k] and separation_of(system, pairs[k, 0], pairs[k, 1]) <= 0.0
        else:
            touches[k] = touches[k] and pair_overlaps(shapes, placed(a), placed(b), offset, points)


def touching_pairs(system: System, pairs: np.ndarray) -> np.ndarray:
    """The candidate pairs (m, 2) of bounded bodies that touch or overlap, in the order of ``pairs``."""
    touches = np.empty(len(pairs), dtype=np.bool_)
    ThreadTeam(len(pairs)).each(
        lambda _, first, last: _mark_touching(system, system.meshes, pairs, touches, first, last), len(pairs)
    )
    return pairs[touches]


@entry_kernel
def touching_surroundings(system):
    """Particles that touch or cross a half-space or a mesh, (m, 2): the particle and that body."""
    system = without_refcounts(system)
    found = np.empty((64, 2), dtype=np.int64)
    count = 0
    for i in range(system.particles):
        for j in range(system.bounded, len(system.body)):
            if separation_of(system, i, j) <= 0.0:
                if count == len(found):
                    found = np.concatenate((found, np.empty_like(found)))
                found[count, 0], found[count, 1] = i, j
                count += 1
    return found[:count]


@entry_kernel
def _deepest_of(system, pairs):
    """The largest overlap among pairs of bodies [m]."""
    system, pairs = without_refcounts((system, pairs))
    deepest = 0.0
    for k in range(len(pairs)):
        deepest = max(deepest, -separation_of(system, pairs[k, 0], pairs[k, 1]))
    return deepest


def deepest_overlap(system: System, pairs: np.ndarray) -> float:
    """The largest overlap among candidate pairs and with surroundings [m]; 0 if nothing overlaps."""
    touching = touching_pairs(system, pairs), touching_surroundings(system)
    return float(max(_deepest_of(system, contacts) for contacts in touching))
