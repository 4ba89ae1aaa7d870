"""What is seen at each pixel, found before anything is drawn.

All particles are visited from near to far, and each leaves at the pixels where it is the nearest so far how close it
is there. Spheres are traced ray by ray and leave their number too: the picture needs to shade each of these pixels
once. Hulls are traced likewise; those that nobody can see need not be drawn. The shadow map is what the light sees.
A picture asks at the middles of pixels, so nothing else counts.

Closeness is 1 / distance along the axis, or minus the distance in a parallel view: along a line of pixels that of a
plane changes evenly, and of a convex body's planes those that face the eye bound it from above, the others from below.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from particlesim.crew import Crew
from particlesim.jit import kernel
from particlesim.rendering.bodies import Bodies
from particlesim.rendering.outlook import Outlook, nearest_first

# Edge of the squares of the picture that are noted as holding spheres [pixels].
TILE = 16

# OpenGL moves corners to places that it can tell apart, by at most 1/256 of a pixel: a hull hides only what is hidden
# by it wherever within this [pixels] it is drawn, and is left out only if nobody saw it there.
_MOVED = 1.0 / 128.0

# Closeness is kept in single precision: what is nearer by less than this share is not hidden.
_ROUNDING = 1e-6


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
                    _sphere_beside(order[k], x, y, z, outer, window, close, owner, tiles)
                seen[k] = z > -outer and not is_sphere
                continue
            least, most = 1.0 / (z + outer), 1.0 / (z - outer)
            front = most * (1.0 + _ROUNDING)
        box = _box(x, y, outer, least, most, window, len(close))
        if not _any_farther(close, box, front):
            continue
        i = order[k]
        if not is_sphere:
            m = _turned(axes, orientation, i)
            facing = _sides(x, y, z, size[i], m, planes, start[i], faces[i], parallel, window, sides)
            if parallel:
                _cast(sides, facing, faces[i], box, close)
            else:
                seen[k] = _hull(sides, facing, faces[i], box, close, owner)
        elif parallel:
            _disc(x, y, z, outer, window, close)
        else:
            _sphere(i, x, y, z, outer, window, close, owner, tiles)


@kernel
def _span(low, high, middle, scale, first, last):
    """The pixels of ``first .. last`` whose middles lie between two lines [m at distance 1]: first, past last."""
    start = middle + scale * low - 0.5
    end = middle + scale * high - 0.5
    # Compared as numbers first: a line may be farther away than an integer can say.
    start = first if start <= first else (last if start >= last else math.ceil(start))
    end = first if end < first else (last if end >= last - 1 else math.floor(end) + 1)
    return int(start), int(end)


@kernel
def _box(x, y, outer, least, most, window, height):
    """The rectangle of pixels about a particle, as large in the picture as any part of it is: rows, then columns."""
    middle_x, middle_y, scale, first, last = window
    left, right, low, high = x - outer, x + outer, y - outer, y + outer
    left = left * (most if left < 0.0 else least)
    right = right * (most if right > 0.0 else least)
    low = low * (most if low < 0.0 else least)
    high = high * (most if high > 0.0 else least)
    bottom, top = _span(low, high, middle_y, scale, 0, height)
    start, end = _span(left, right, middle_x, scale, first, last)
    return bottom, top, start, end


@kernel
def _any_farther(close, box, front):
    for row in range(box[0], box[1]):
        for column in range(box[2], box[3]):
            if close[row, column] < front:
                return True
    return False


@kernel
def _disc(x, y, z, radius, window, close):
    """A disc that faces a parallel view."""
    middle_x, middle_y, scale, first, last = window
    low, high = _span(y - radius, y + radius, middle_y, scale, 0, len(close))
    for row in range(low, high):
        aside = (row + 0.5 - middle_y) / scale - y
        half = math.sqrt(max(radius * radius - aside * aside, 0.0))
        start, end = _span(x - half, x + half, middle_x, scale, first, last)
        for column in range(start, end):
            close[row, column] = max(close[row, column], -z)


@kernel
def _sphere(i, x, y, z, radius, window, close, owner, tiles):
    """A sphere before the eye: where the ray (u, v, 1) t meets it first, t^2 (d.d) - 2 t (d.c) + c.c - r^2 = 0."""
    middle_x, middle_y, scale, first, last = window
    power = x * x + y * y + z * z - radius * radius
    # The rows between the two planes through the eye that touch it, and in a row the columns between two rays that do.
    reach = radius * math.sqrt(y * y + z * z - radius * radius)
    across = z * z - radius * radius
    low, high = _span((y * z - reach) / across, (y * z + reach) / across, middle_y, scale, 0, len(close))
    front = 1.0 / (z - radius)
    across = power - x * x
    for row in range(low, high):
        v = (row + 0.5 - middle_y) / scale
        w, g = v * y + z, 1.0 + v * v
        half = math.sqrt(max(x * x * w * w + across * (w * w - g * power), 0.0))
        start, end = _span((x * w - half) / across, (x * w + half) / across, middle_x, scale, first, last)
        found = False
        for column in range(start, end):
            if close[row, column] < front:
                u = (column + 0.5 - middle_x) / scale
                b = u * x + w
                q = (b + math.sqrt(max(b * b - (g + u * u) * power, 0.0))) / power
                if close[row, column] < q:
                    close[row, column] = q
                    owner[row, column] = i
                    found = True
        if found:
            for tile in range(start // TILE, (end - 1) // TILE + 1):
                tiles[row // TILE, tile] = True


@kernel
def _sphere_beside(i, x, y, z, radius, window, close, owner, tiles):
    """A sphere that reaches beside the eye: any pixel may see it. None does from within."""
    middle_x, middle_y, scale, first, last = window
    power = x * x + y * y + z * z - radius * radius
    if power <= 0.0:
        return
    for row in range(len(close)):
        v = (row + 0.5 - middle_y) / scale
        for column in range(first, last):
            u = (column + 0.5 - middle_x) / scale
            b = u * x + v * y + z
            root = b * b - (1.0 + u * u + v * v) * power
            if b > 0.0 and root >= 0.0:
                q = (b + math.sqrt(root)) / power
                if close[row, column] < q:
                    close[row, column] = q
                    owner[row, column] = i
                    tiles[row // TILE, column // TILE] = True


@kernel
def _turned(axes, orientation, i):
    """The matrix from a particle's own axes to those of the one who looks, row by row."""
    w, a, b, c = orientation[i, 0], orientation[i, 1], orientation[i, 2], orientation[i, 3]
    r = (
        (1.0 - 2.0 * (b * b + c * c), 2.0 * (a * b - w * c), 2.0 * (a * c + w * b)),
        (2.0 * (a * b + w * c), 1.0 - 2.0 * (a * a + c * c), 2.0 * (b * c - w * a)),
        (2.0 * (a * c - w * b), 2.0 * (b * c + w * a), 1.0 - 2.0 * (a * a + b * b)),
    )
    return (
        _combined(axes[0, 0], axes[0, 1], axes[0, 2], r),
        _combined(axes[1, 0], axes[1, 1], axes[1, 2], r),
        _combined(axes[2, 0], axes[2, 1], axes[2, 2], r),
    )


@kernel
def _combined(a, b, c, r):
    return (
        a * r[0][0] + b * r[1][0] + c * r[2][0],
        a * r[0][1] + b * r[1][1] + c * r[2][1],
        a * r[0][2] + b * r[1][2] + c * r[2][2],
    )


@kernel
def _sides(x, y, z, size, m, planes, first, count, parallel, window, sides):
    """Closeness of a hull's planes as right * column + up * row + there, and how much that is in a pixel's diagonal.

    Planes that face the one who looks come first; returns how many they are.
    """
    middle_x, middle_y, scale, _, _ = window
    facing, away = 0, count
    for f in range(count):
        a, b, c, h = planes[first + f, 0], planes[first + f, 1], planes[first + f, 2], planes[first + f, 3]
        nx = m[0][0] * a + m[0][1] * b + m[0][2] * c
        ny = m[1][0] * a + m[1][1] * b + m[1][2] * c
        nz = m[2][0] * a + m[2][1] * b + m[2][2] * c
        offset = nx * x + ny * y + nz * z + h * size
        if parallel:
            # A plane seen from its edge is as good as one that turns away a little.
            nz = nz if abs(nz) > 1e-9 else 1e-9
            faces, right, up, there = nz < 0.0, nx / nz, ny / nz, -offset / nz
        else:
            tiny = 1e-9 * size
            offset = offset if abs(offset) > tiny else tiny
            faces, right, up, there = offset < 0.0, nx / offset, ny / offset, nz / offset
        if faces:
            place = facing
            facing += 1
        else:
            away -= 1
            place = away
        right, up = right / scale, up / scale
        sides[place, 0] = right
        sides[place, 1] = up
        sides[place, 2] = there + right * (0.5 - middle_x) + up * (0.5 - middle_y)
        sides[place, 3] = abs(right) + abs(up)
    return facing


@kernel
def _most(sides, facing, row, column, grown):
    """The greatest closeness of a hull at a pixel, by the planes that face the eye, grown by a part of a pixel."""
    most = np.inf
    for f in range(facing):
        most = min(most, sides[f, 0] * column + sides[f, 1] * row + sides[f, 2] + grown * sides[f, 3])
    return most


@kernel
def _room(sides, facing, count, row, column, grown):
    """By how much the planes of a hull leave room for it at a pixel, below 0 if it is not seen; and how that grows."""
    most, least = np.inf, -np.inf
    slope_most = slope_least = 0.0
    for f in range(count):
        q = sides[f, 0] * column + sides[f, 1] * row + sides[f, 2]
        if f < facing:
            q += grown * sides[f, 3]
            if q < most:
                most, slope_most = q, sides[f, 0]
        else:
            q -= grown * sides[f, 3]
            if q > least:
                least, slope_least = q, sides[f, 0]
    return most - least, slope_most - slope_least


@kernel
def _border(sides, facing, count, row, column, end, grown):
    """Where a row of pixels comes into a hull on its way from ``column`` to ``end``, or beyond that if it never does.

    The room for the hull is concave along the row: the root of its slope is never beyond the border, and each planes'
    corner is passed once.
    """
    way = 1.0 if end >= column else -1.0
    for _ in range(count):
        room, slope = _room(sides, facing, count, row, column, grown)
        if room >= 0.0:
            return column
        if slope * way <= 0.0:
            return end + way
        column -= room / slope
        if (column - end) * way > 0.0:
            return column
    return column


@kernel
def _seen_in_row(sides, facing, count, row, start, end, grown):
    """The pixels ``start .. end`` of a row whose middles see a hull: the first, and one past the last."""
    left = _border(sides, facing, count, row, float(start), end - 1.0, grown)
    if left > end - 1.0:
        return start, start
    right = _border(sides, facing, count, row, end - 1.0, left, grown)
    return math.ceil(left), math.floor(right) + 1


@kernel
def _hull(sides, facing, count, box, close, owner):
    """Whether a hull may be seen; it hides what is behind it."""
    seen = False
    for row in range(box[0], box[1]):
        start, end = _seen_in_row(sides, facing, count, row, box[2], box[3], -_MOVED)
        for column in range(start, end):
            most = _most(sides, facing, row, column, -_MOVED)
            if close[row, column] < most:
                close[row, column] = most
                owner[row, column] = -1
                seen = True
    return seen or _peeps_out(sides, facing, count, box, close)


@kernel
def _peeps_out(sides, facing, count, box, close):
    """Whether any pixel might see a hull that is a little larger, and nearer, than it is."""
    for row in range(box[0], box[1]):
        start, end = _seen_in_row(sides, facing, count, row, box[2], box[3], _MOVED)
        for column in range(start, end):
            if close[row, column] < _most(sides, facing, row, column, _MOVED) * (1.0 + _ROUNDING):
                return True
    return False


@kernel
def _cast(sides, facing, count, box, close):
    """A hull in the light hides it from what is behind its rear."""
    for row in range(box[0], box[1]):
        start, end = _seen_in_row(sides, facing, count, row, box[2], box[3], 0.0)
        for column in range(start, end):
            rear = -np.inf
            for f in range(facing, count):
                rear = max(rear, sides[f, 0] * column + sides[f, 1] * row + sides[f, 2])
            close[row, column] = max(close[row, column], rear)
