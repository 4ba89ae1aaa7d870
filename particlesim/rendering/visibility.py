"""What is seen at each pixel, found before anything is drawn.

All particles are visited from near to far, and each leaves at the pixels where it is the nearest so far how close it
is there. Spheres are traced ray by ray and leave their number too: the picture needs to shade each of these pixels
once. Hulls are traced likewise; those that nobody can see need not be drawn. The shadow map is what the light sees.
A picture asks at the middles of pixels, so nothing else counts.

Closeness is 1 / distance along the axis of the view, or minus the distance in a parallel view.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.crew import Crew
from particlesim.jit import kernel
from particlesim.rendering.bodies import Bodies
from particlesim.rendering.hull_tracing import ROUNDING, cast_hull, sides_of, trace_hull, turned
from particlesim.rendering.outlook import Outlook, nearest_first
from particlesim.rendering.sphere_tracing import TILE, span, trace_disc, trace_sphere, trace_sphere_beside


class Sight(NamedTuple):
    """What is seen from an outlook of (width, height) pixels; the first row is the lowest.

    ``close`` (height, width) float32: closeness of the nearest; ``owner`` (height, width) int32: number of the sphere
    that is seen, or -1; ``tiles`` bool: squares of TILE pixels with spheres; ``hulls`` (k,) int64: the hulls that may
    be seen, roughly the nearer ones first.
    """

    close: np.ndarray
    owner: np.ndarray
    tiles: np.ndarray
    hulls: np.ndarray


def look(outlook: Outlook, bodies: Bodies, position: np.ndarray, orientation: np.ndarray) -> Sight:
    """Find what is seen of particles at ``position`` (n, 3) and ``orientation`` (n, 4), both float64.

    Hulls left out change no pixel. In a parallel view, which is that of a light, a sphere is the disc through its
    middle and a hull the faces that it turns away: then none of them shades its own lit side.
    """
    width, height = outlook.size
    close = np.full((height, width), -np.inf, dtype=np.float32)
    owner = np.full((height, width), -1, dtype=np.int32)
    tiles = np.zeros((-(-height // TILE), -(-width // TILE)), dtype=np.bool_)
    axes, eye = np.ascontiguousarray(outlook.axes), np.ascontiguousarray(outlook.eye)
    order = nearest_first(outlook, position)
    balls = np.empty((len(position), 5))

    def gather(_: int, first: int, last: int) -> None:
        _gather(position, bodies.inner, bodies.outer, order, axes, eye, balls, first, last)

    def strip(_: int, first: int, last: int) -> np.ndarray:
        seen = np.zeros(len(position), dtype=np.bool_)
        # A tile belongs to one strip.
        window = (0.5 * width, 0.5 * height, outlook.scale, first * TILE, min(last * TILE, width))
        sides = np.empty((max(bodies.faces, default=0), 4))
        _look(balls, order, bodies, orientation, axes, outlook.parallel, window, sides, close, owner, tiles, seen)
        return seen

    Crew(len(position)).each(gather, len(position))
    # What hides what in a strip of the picture is told by that strip alone.
    seen = np.logical_or.reduce(Crew(close.size).each(strip, tiles.shape[1]))
    return Sight(close, owner, tiles, order[seen])


def renumber(owner: np.ndarray, count: int) -> np.ndarray:
    """Number the particles that occur in ``owner`` 0, 1, ... in place; returns which they were, (k,) int64."""
    number = np.full(count, -1, dtype=np.int32)
    particles = np.empty(count, dtype=np.int64)
    return particles[: _renumber(owner.reshape(-1), number, particles)]


@kernel
def _renumber(owner, number, particles):
    found = 0
    for place in range(len(owner)):
        i = owner[place]
        if i >= 0:
            if number[i] < 0:
                number[i] = found
                particles[found] = i
                found += 1
            owner[place] = number[i]
    return found


@kernel
def _gather(position, inner, outer, order, axes, eye, balls, first, last):
    """Places in the axes of the one who looks, and radii, in the order in which they are visited.

    By itself, because memory answers many questions at once as long as none waits for another.
    """
    for k in range(first, last):
        i = order[k]
        dx, dy, dz = position[i, 0] - eye[0], position[i, 1] - eye[1], position[i, 2] - eye[2]
        balls[k, 0] = axes[0, 0] * dx + axes[0, 1] * dy + axes[0, 2] * dz
        balls[k, 1] = axes[1, 0] * dx + axes[1, 1] * dy + axes[1, 2] * dz
        balls[k, 2] = axes[2, 0] * dx + axes[2, 1] * dy + axes[2, 2] * dz
        balls[k, 3] = inner[i]
        balls[k, 4] = outer[i]


@kernel
def _look(balls, order, bodies, orientation, axes, parallel, window, sides, close, owner, tiles, seen):
    """Visit all; ``seen`` becomes true for the places in ``order`` of hulls that may be seen."""
    planes, size, start, faces = bodies.planes, bodies.size, bodies.start, bodies.faces
    for k in range(len(balls)):
        x, y, z, inner, outer = balls[k, 0], balls[k, 1], balls[k, 2], balls[k, 3], balls[k, 4]
        is_sphere = inner == outer
        # How large a metre is in its rear and in its front, seen from afar as 1 at distance 1.
        least = most = 1.0
        front = outer - z
        if not parallel:
            if z <= outer:
                # About the one who looks, some of it may be seen; behind, none.
                if z > -outer and is_sphere:
                    trace_sphere_beside(order[k], x, y, z, outer, window, close, owner, tiles)
                seen[k] = z > -outer and not is_sphere
                continue
            least, most = 1.0 / (z + outer), 1.0 / (z - outer)
            front = most * (1.0 + ROUNDING)
        box = _box(x, y, outer, least, most, window, len(close))
        if not _any_farther(close, box, front):
            continue
        i = order[k]
        if not is_sphere:
            m = turned(axes, orientation, i)
            facing = sides_of(x, y, z, size[i], m, planes, start[i], faces[i], parallel, window, sides)
            if parallel:
                cast_hull(sides, facing, faces[i], box, close)
            else:
                seen[k] = trace_hull(sides, facing, faces[i], box, close, owner)
        elif parallel:
            trace_disc(x, y, z, outer, window, close)
        else:
            trace_sphere(i, x, y, z, outer, window, close, owner, tiles)


@kernel
def _box(x, y, outer, least, most, window, height):
    """The rectangle of pixels about a particle, as large in the picture as any part of it is: rows, then columns."""
    middle_x, middle_y, scale, first, last = window
    left, right, low, high = x - outer, x + outer, y - outer, y + outer
    left = left * (most if left < 0.0 else least)
    right = right * (most if right > 0.0 else least)
    low = low * (most if low < 0.0 else least)
    high = high * (most if high > 0.0 else least)
    bottom, top = span(low, high, middle_y, scale, 0, height)
    start, end = span(left, right, middle_x, scale, first, last)
    return bottom, top, start, end


@kernel
def _any_farther(close, box, front):
    for row in range(box[0], box[1]):
        for column in range(box[2], box[3]):
            if close[row, column] < front:
                return True
    return False
