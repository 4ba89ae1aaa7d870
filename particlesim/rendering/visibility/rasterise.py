"""What is seen at each pixel, found before anything is drawn.

All particles are visited, group by group from near to far, and each leaves at the pixels where it is the nearest so far
how close it is there, its number, and a hull which of its faces: the picture needs to shade each of these pixels once.
The shadow map is what the light sees. A picture asks at the middles of pixels, so nothing else counts.

Closeness is 1 / distance along the axis of the view, or minus the distance in a parallel view.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.core.jit import kernel, without_refcounts
from particlesim.core.parallel import ThreadTeam
from particlesim.rendering.visibility.geometry_tables import Bodies
from particlesim.rendering.visibility.occlusion_clusters import Groups
from particlesim.rendering.visibility.projection import Outlook, nearest_first
from particlesim.rendering.visibility.rasterise_hull import cast_hull, room_for, trace_hull, trace_hull_beside, turned
from particlesim.rendering.visibility.rasterise_sphere import span, trace_disc, trace_sphere, trace_sphere_beside

# Edge of the squares whose farthest pixel is known, or is found when it is asked for [pixels]: what is farther than
# that is hidden in all of the square.
_SQUARE = 8

# Closeness is kept in single precision: what is nearer by less than this share is not hidden.
_ROUNDING = 1e-6


class Sight(NamedTuple):
    """What is seen from an outlook of (width, height) pixels; the first row is the lowest; all (height, width).

    ``close`` float32: closeness of the nearest; ``owner`` int32: number of the particle that is seen, or -1; ``face``
    int32: which of its faces, if it is a hull.
    """

    close: np.ndarray
    owner: np.ndarray
    face: np.ndarray


class _Squares(NamedTuple):
    """``far`` float32: closeness of the farthest pixel of each square, or less; ``stale``: whether it may be less."""

    far: np.ndarray
    stale: np.ndarray


def look(outlook: Outlook, bodies: Bodies, groups: Groups, orientation: np.ndarray) -> Sight:
    """Find what is seen of particles in ``groups`` at ``orientation`` (n, 4) float64.

    In a parallel view, which is that of a light, a sphere is the disc through its middle and a hull the faces that it
    turns away: then none of them shades its own lit side.
    """
    width, height = outlook.size
    sight = Sight(
        close=np.full((height, width), -np.inf, dtype=np.float32),
        owner=np.full((height, width), -1, dtype=np.int32),
        face=np.empty((height, width), dtype=np.int32),
    )
    shape = -(-height // _SQUARE), -(-width // _SQUARE)
    squares = _Squares(np.full(shape, -np.inf, dtype=np.float32), np.zeros(shape, dtype=np.bool_))
    axes, eye = np.ascontiguousarray(outlook.axes), np.ascontiguousarray(outlook.eye)
    # Middles of the groups' boxes along the axes of the view, and how far the boxes reach from them.
    middle = (0.5 * (groups.lower + groups.upper) - eye) @ axes.T
    reach = 0.5 * (groups.upper - groups.lower) @ np.abs(axes).T
    order = nearest_first(middle[:, 2] - reach[:, 2])

    def strip(_: int, first: int, last: int) -> None:
        # A square belongs to one strip.
        window = (0.5 * width, 0.5 * height, outlook.scale, first * _SQUARE, min(last * _SQUARE, width))
        hull = room_for(bodies)
        view = axes, eye, outlook.parallel, window
        _look(order, middle, reach, groups, bodies, orientation, view, hull, sight, squares)

    # What hides what in a strip of the picture is told by that strip alone; some have more to look at than others.
    crew = ThreadTeam(sight.close.size)
    crew.each(strip, shape[1], 2 * crew.threads)
    return sight


@kernel
def _look(order, middle, reach, groups, bodies, orientation, view, hull, sight, squares):
    """Visit all that a strip of the picture might see."""
    groups, bodies, hull = without_refcounts(groups), without_refcounts(bodies), without_refcounts(hull)
    sight, squares, view = without_refcounts(sight), without_refcounts(squares), without_refcounts(view)
    parallel, window, height = view[2], view[3], len(sight.close)
    for group in order:
        x, y, z = middle[group, 0], middle[group, 1], middle[group, 2]
        dx, dy, dz = reach[group, 0], reach[group, 1], reach[group, 2]
        if parallel or z > dz:
            box, front = _box(x, y, z, dx, dy, dz, parallel, window, height)
            if _hidden(sight.close, squares, box, front):
                continue
        for k in range(groups.start[group], groups.start[group + 1]):
            _visit(k, groups, bodies, orientation, view, hull, sight, squares)


@kernel
def _visit(k, groups, bodies, orientation, view, hull, sight, squares):
    axes, eye, parallel, window = view
    height = len(sight.close)
    a, b, c = groups.balls[k, 0] - eye[0], groups.balls[k, 1] - eye[1], groups.balls[k, 2] - eye[2]
    x = axes[0, 0] * a + axes[0, 1] * b + axes[0, 2] * c
    y = axes[1, 0] * a + axes[1, 1] * b + axes[1, 2] * c
    z = axes[2, 0] * a + axes[2, 1] * b + axes[2, 2] * c
    outer, i = groups.balls[k, 3], groups.members[k]
    beside = not parallel and z <= outer
    if beside:
        # Any pixel may see some of it, but for what is behind or out of the picture altogether.
        if z <= -outer or _aside(x, y, z, outer, window, height):
            return
        box = 0, height, window[3], window[4]
    else:
        box, front = _box(x, y, z, outer, outer, outer, parallel, window, height)
        if _hidden(sight.close, squares, box, front) or not _any_farther(sight.close, box, front):
            return
    shape = bodies.shape[i]
    if bodies.first_plane[shape] == bodies.first_plane[shape + 1]:
        if parallel:
            trace_disc(x, y, z, outer, window, sight.close)
        elif beside:
            trace_sphere_beside(i, x, y, z, outer, window, sight.close, sight.owner)
        else:
            trace_sphere(i, x, y, z, outer, window, sight.close, sight.owner)
    else:
        m = turned(axes, orientation, i)
        if parallel:
            cast_hull(i, x, y, z, m, bodies, window, box, hull, sight.close)
        elif beside:
            trace_hull_beside(i, x, y, z, m, bodies, window, hull, sight.close, sight.owner, sight.face)
        else:
            trace_hull(i, x, y, z, m, bodies, window, box, hull, sight.close, sight.owner, sight.face)
    for row in range(box[0] // _SQUARE, (box[1] - 1) // _SQUARE + 1):
        for column in range(box[2] // _SQUARE, (box[3] - 1) // _SQUARE + 1):
            squares.stale[row, column] = True


@kernel
def _box(x, y, z, dx, dy, dz, parallel, window, height):
    """The rectangle of pixels about what reaches so far from a place, rows, then columns; and how close it may be."""
    middle_x, middle_y, scale, first, last = window
    # How large a metre is in its rear and in its front, seen from afar as 1 at distance 1.
    least = most = 1.0
    front = dz - z
    if not parallel:
        least, most = 1.0 / (z + dz), 1.0 / (z - dz)
        front = most * (1.0 + _ROUNDING)
    left, right, low, high = x - dx, x + dx, y - dy, y + dy
    left = left * (most if left < 0.0 else least)
    right = right * (most if right > 0.0 else least)
    low = low * (most if low < 0.0 else least)
    high = high * (most if high > 0.0 else least)
    bottom, top = span(low, high, middle_y, scale, 0, height)
    start, end = span(left, right, middle_x, scale, first, last)
    return (bottom, top, start, end), front


@kernel
def _aside(x, y, z, outer, window, height):
    """Whether a sphere is beyond one of the four planes about what the picture shows."""
    middle_x, middle_y, scale, first, last = window
    right, left = (last - middle_x) / scale, (first - middle_x) / scale
    high, low = (height - middle_y) / scale, -middle_y / scale
    return (
        x - right * z > outer * (1.0 + abs(right))
        or left * z - x > outer * (1.0 + abs(left))
        or y - high * z > outer * (1.0 + abs(high))
        or low * z - y > outer * (1.0 + abs(low))
    )


@kernel
def _hidden(close, squares, box, front):
    """Whether all squares about a box show what is closer everywhere, or there are no pixels in it."""
    if box[0] >= box[1] or box[2] >= box[3]:
        return True
    for row in range(box[0] // _SQUARE, (box[1] - 1) // _SQUARE + 1):
        for column in range(box[2] // _SQUARE, (box[3] - 1) // _SQUARE + 1):
            if squares.far[row, column] < front:
                if squares.stale[row, column]:
                    squares.far[row, column] = _farthest(close, row * _SQUARE, column * _SQUARE)
                    squares.stale[row, column] = False
                if squares.far[row, column] < front:
                    return False
    return True


@kernel
def _farthest(close, row, column):
    far = np.float32(np.inf)
    for r in range(row, min(row + _SQUARE, close.shape[0])):
        for c in range(column, min(column + _SQUARE, close.shape[1])):
            far = min(far, close[r, c])
    return far


@kernel
def _any_farther(close, box, front):
    for row in range(box[0], box[1]):
        for column in range(box[2], box[3]):
            if close[row, column] < front:
                return True
    return False
