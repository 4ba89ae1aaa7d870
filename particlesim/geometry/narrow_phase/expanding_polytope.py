"""How deep two overlapping cores of many corners are in each other: the expanding polytope algorithm.

A polytope within the difference body D = B - A grows where it is nearest to the origin until that face of it is one of
D's own: no face of D is nearer (G. van den Bergen, Proximity Queries and Penetration Depth Computation on 3D Game
Objects, Game Developers Conference 2001). It asks for the farthest points of D only, some twenty times where bodies
touch, and the separating axis test for every pair of edges. Here the origin need not be within the polytope at first:
faces that it is in front of are the nearest of all, at a distance below 0.
"""

import math

import numpy as np

from particlesim.core.jit import kernel
from particlesim.core.math3d import (
    add,
    cross,
    dot,
    grow_records,
    load_vec3,
    mat_transposed_vec,
    mat_vec,
    norm,
    scale,
    set_vec3,
    sub,
    to_vec3,
)
from particlesim.core.records import record
from particlesim.geometry.support import bounding_radius, support_vertex, vertex_position
from particlesim.geometry.tolerances import MAX_EXPANSIONS, POLYTOPE_GAP, POLYTOPE_ROUNDING

# A corner of the polytope: a point of the difference body, and the vertices of either core that it is of.
_CORNER = record([("position", "f8", (3,)), ("pick", "i8", (2,))])

# A triangle of the polytope.
_FACET = record(
    [
        ("corner", "i8", (3,)),  # counter-clockwise seen from outside
        ("beside", "i8", (3,)),  # the triangles beyond its sides, which begin at these corners
        ("normal", "f8", (3,)),  # unit, outward
        ("height", "f8"),  # of its plane from the origin along the normal [m]; inf of a sliver or of one taken away
        ("taken", "i8"),  # 1 if it is taken away
    ]
)


@kernel
def _farthest(cores, direction):
    """The vertices of two cores whose difference is farthest along ``direction``, in world axes."""
    table, a, b, _ = cores
    of_a = support_vertex(table, a[0], mat_transposed_vec(a[2], scale(direction, -1.0)))
    return of_a, support_vertex(table, b[0], mat_transposed_vec(b[2], direction))


@kernel
def _difference(cores, pick):
    """The point of the difference body that is the difference of two vertices."""
    table, a, b, offset = cores
    return sub(add(offset, vertex_position(table, b, pick[1])), vertex_position(table, a, pick[0]))


@kernel
def _farther_off(cores, start, direction):
    """The vertices whose difference is farthest from ``start`` along a direction or against it."""
    ahead, behind = _farthest(cores, direction), _farthest(cores, scale(direction, -1.0))
    along, against = sub(_difference(cores, ahead), start), sub(_difference(cores, behind), start)
    return ahead if dot(direction, along) >= -dot(direction, against) else behind


@kernel
def _across(v):
    """A vector across ``v``: the axis that v is least along, and v, span a plane; across it."""
    x, y, z = abs(v[0]), abs(v[1]), abs(v[2])
    if x <= y and x <= z:
        return 0.0, v[2], -v[1]
    return (-v[2], 0.0, v[0]) if y <= z else (v[1], -v[0], 0.0)


@kernel
def _edge_of(body, table, start, end):
    """From one vertex of a turned core to another: exact but for the last digit, however near they are."""
    edge = sub(load_vec3(table.vertex, end), load_vec3(table.vertex, start))
    return mat_vec(body[2], scale(edge, body[1]))


@kernel
def _side(cores, corner, start, end):
    """A side of a triangle, from row ``start`` of ``corner`` to row ``end``."""
    table, a, b, _ = cores
    of_b = _edge_of(b, table, corner[start].pick[1], corner[end].pick[1])
    return sub(of_b, _edge_of(a, table, corner[start].pick[0], corner[end].pick[0]))


@kernel
def _put_facet(facet, cores, corner, rows, beside):
    """Write the triangle of three rows of ``corner``, and which triangles are beside it."""
    e, f = _side(cores, corner, rows[0], rows[1]), _side(cores, corner, rows[1], rows[2])
    g = _side(cores, corner, rows[2], rows[0])
    # Across the two shorter sides: of a narrow triangle, the longer two are nearly parallel.
    if dot(e, e) >= dot(f, f) and dot(e, e) >= dot(g, g):
        e, f = f, g
    elif dot(f, f) >= dot(g, g):
        e, f = g, e
    n = cross(e, f)
    area = norm(n)
    set_vec3(facet.corner, rows)
    set_vec3(facet.beside, beside)
    facet.height, facet.taken = math.inf, 0
    if area > POLYTOPE_ROUNDING * norm(e) * norm(f):
        n = scale(n, 1.0 / area)
        set_vec3(facet.normal, n)
        facet.height = dot(n, to_vec3(corner[rows[0]].position))


@kernel
def _put_corner(corner, cores, pick):
    """Write the difference of two vertices."""
    corner.pick[0], corner.pick[1] = pick
    set_vec3(corner.position, _difference(cores, pick))


@kernel
def _put_tetrahedron(cores, corner, facet):
    """Begin with four points of the difference body, as far from each other as a few looks tell."""
    _put_corner(corner[0], cores, _farthest(cores, (1.0, 0.0, 0.0)))
    _put_corner(corner[1], cores, _farthest(cores, (-1.0, 0.0, 0.0)))
    p = to_vec3(corner[0].position)
    along = sub(to_vec3(corner[1].position), p)
    _put_corner(corner[2], cores, _farther_off(cores, p, _across(along)))
    n = cross(along, sub(to_vec3(corner[2].position), p))
    _put_corner(corner[3], cores, _farther_off(cores, p, n))
    q, r = (2, 1) if dot(n, sub(to_vec3(corner[3].position), p)) > 0.0 else (1, 2)
    _put_facet(facet[0], cores, corner, (0, q, r), (1, 2, 3))
    _put_facet(facet[1], cores, corner, (0, 3, q), (3, 2, 0))
    _put_facet(facet[2], cores, corner, (q, 3, r), (1, 3, 0))
    _put_facet(facet[3], cores, corner, (r, 3, 0), (2, 1, 0))


@kernel
def _nearest_facet(facet, count):
    """The triangle whose plane is nearest to the origin, or farthest behind it."""
    nearest = 0
    for k in range(1, count):
        if facet[k].height < facet[nearest].height:
            nearest = k
    return nearest


@kernel
def _is_known(corner, count, pick):
    """Whether the difference of two vertices is one of the polytope's corners."""
    known = False
    for k in range(count):
        known = known or (corner[k].pick[0] == pick[0] and corner[k].pick[1] == pick[1])
    return known


@kernel
def _take_away(facet, first, w, slack, border):
    """Take a triangle away, and those that hang together with it and face a point ``w``.

    Returns how many sides the hole has: rows (start, end, triangle beyond) of ``border``, as they ran in what is gone.
    """
    facet[first].taken = 1
    waiting, sides, last = np.empty(len(facet), dtype=np.int64), 0, 1
    waiting[0] = first
    while last > 0:
        last -= 1
        here = facet[waiting[last]]
        here.height = math.inf
        for side in range(3):
            beyond = here.beside[side]
            other = facet[beyond]
            if other.taken == 1:
                continue
            if other.height == math.inf or dot(to_vec3(other.normal), w) - other.height > slack:
                other.taken = 1
                waiting[last] = beyond
                last += 1
            else:
                border[sides] = here.corner[side], here.corner[(side + 1) % 3], beyond
                sides += 1
    return sides


@kernel
def _join(cores, corner, top, facet, first, border):
    """Put a triangle on each side of a hole, from it to corner ``top``: rows of ``facet`` from ``first`` on."""
    for k in range(len(border)):
        start, end, beyond = border[k, 0], border[k, 1], border[k, 2]
        ahead = behind = first
        for m in range(len(border)):
            ahead = first + m if border[m, 0] == end else ahead
            behind = first + m if border[m, 1] == start else behind
        _put_facet(facet[first + k], cores, corner, (start, end, top), (beyond, ahead, behind))
        for side in range(3):
            if facet[beyond].corner[side] == end and facet[beyond].corner[(side + 1) % 3] == start:
                facet[beyond].beside[side] = first + k


@kernel
def expanded_depth(table, a, b, offset):
    """Separation of two cores along the best axis, and that axis, as ``core_depth``; and whether the search ended.

    One of the cores must be a polyhedron.
    """
    cores = table, a, b, offset
    sizes = bounding_radius(table, a) + bounding_radius(table, b)
    corner, facet = np.empty(64, dtype=_CORNER), np.empty(256, dtype=_FACET)
    border = np.empty((256, 3), dtype=np.int64)
    _put_tetrahedron(cores, corner, facet)
    facets = corners = 4
    for _ in range(MAX_EXPANSIONS):
        first = _nearest_facet(facet, facets)
        n, height = to_vec3(facet[first].normal), facet[first].height
        pick = _farthest(cores, n)
        w = _difference(cores, pick)
        reach = dot(n, w)
        if reach - height <= POLYTOPE_GAP * sizes:
            return -reach, scale(n, -1.0), True
        if _is_known(corner, corners, pick):
            # Rounding has turned a narrow triangle: the body does not reach farther, whatever its plane says.
            facet[first].height = reach
            continue
        if corners == len(corner):
            corner = grow_records(corner)
        _put_corner(corner[corners], cores, pick)
        sides = _take_away(facet, first, w, POLYTOPE_ROUNDING * sizes, border)
        while facets + sides > len(facet):
            facet = grow_records(facet)
        _join(cores, corner, corners, facet, facets, border[:sides])
        facets, corners = facets + sides, corners + 1
        # The next hole has at most the sides of all triangles.
        if 3 * facets > len(border):
            border = np.empty((6 * facets, 3), dtype=np.int64)
    return 0.0, offset, False
