"""What a picture shows, spheres and faces of hulls, as the table from which OpenGL shades each pixel once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.crew import Crew
from particlesim.jit import borrowed, kernel
from particlesim.rendering.bodies import Bodies
from particlesim.rendering.outlook import Outlook
from particlesim.rendering.visibility import Sight
from particlesim.vec import apply, cross, dot, matrix_of, norm, row, row4, scaled, sub, vector

# Edge of the squares of the picture that are noted as showing spheres, or hulls [pixels].
TILE = 16

# Rows of a sphere; of a face there is one more for each of its edges.
_BALL_ROWS, _FACE_ROWS = 2, 3


class Surfaces(NamedTuple):
    """What is seen of particles at the pixels of a picture.

    ``seen`` (k,) int64: the particles; ``parts`` (s, 3) int32: of each surface its particle's place in ``seen``, its
    face, -1 for a sphere, and its first row in the table, of ``rows`` in all; ``balls`` and ``hulls`` bool: squares of
    TILE pixels that show some. ``first_row`` (height, width) int32: that of the sphere at each pixel, -2 minus that of
    the face of a hull, or -1.
    """

    seen: np.ndarray
    parts: np.ndarray
    rows: int
    balls: np.ndarray
    hulls: np.ndarray
    first_row: np.ndarray


def surfaces_of(sight: Sight, bodies: Bodies) -> Surfaces:
    """Number what is seen. The owners of ``sight`` become first rows: that array is taken over."""
    height, width = sight.owner.shape
    number = np.full(len(bodies.shape), -1, dtype=np.int32)
    seen = np.empty(min(len(number), sight.owner.size), dtype=np.int64)
    parts = np.empty((sight.owner.size, 3), dtype=np.int32)
    balls, hulls = np.zeros((2, -(-height // TILE), -(-width // TILE)), dtype=np.bool_)
    particles, surfaces, rows = _number(sight, bodies, number, seen, parts, balls, hulls)
    return Surfaces(seen[:particles], parts[:surfaces], rows, balls, hulls, sight.owner)


def table_of(
    surfaces: Surfaces,
    bodies: Bodies,
    outlook: Outlook,
    position: np.ndarray,
    orientation: np.ndarray,
    paint: np.ndarray,
) -> np.ndarray:
    """The table (rows, 4) float32 that shaders/surface.glsl describes.

    ``position`` (n, 3) and ``orientation`` (n, 4) of all particles; ``paint`` (k, 4) of those that are seen: linear
    colour, and share of the sky's light.
    """
    table = np.empty((surfaces.rows, 4), dtype=np.float32)
    eye, ahead = np.ascontiguousarray(outlook.eye), np.ascontiguousarray(outlook.axes[2])

    def fill(_: int, first: int, last: int) -> None:
        _fill(surfaces, bodies, eye, ahead, outlook.scale, position, orientation, paint, table, first, last)

    Crew(len(surfaces.parts)).each(fill, len(surfaces.parts))
    return table


@kernel
def _number(sight, bodies, number, seen, parts, balls, hulls):
    """Give rows to what is seen, square by square; returns how many particles, surfaces and rows there are."""
    owner, face = sight.owner, sight.face
    height, width = owner.shape
    particles = surfaces = rows = slots = 0
    # Where the faces of each particle that is seen begin in the list of first rows of faces.
    first_slot = np.empty(len(seen), dtype=np.int64)
    row_of = np.full(4096, -1, dtype=np.int32)
    # Most pixels show what the one before them shows.
    last, last_face, told = -1, -1, -1
    for tile in range(balls.size):
        down, across = tile // balls.shape[1], tile % balls.shape[1]
        for y in range(down * TILE, min(down * TILE + TILE, height)):
            for x in range(across * TILE, min(across * TILE + TILE, width)):
                i = owner[y, x]
                if i < 0:
                    continue
                if i != last or face[y, x] != last_face and told < -1:
                    last, last_face = i, face[y, x]
                    first = bodies.first_plane[bodies.shape[i]]
                    planes = bodies.first_plane[bodies.shape[i] + 1] - first
                    if number[i] < 0:
                        number[i] = particles
                        seen[particles] = i
                        first_slot[particles] = slots
                        particles += 1
                        slots += max(planes, 1)
                        while slots > len(row_of):
                            row_of = np.append(row_of, np.full(len(row_of), -1, dtype=np.int32))
                    f = last_face if planes else -1
                    slot = first_slot[number[i]] + max(f, 0)
                    if row_of[slot] < 0:
                        row_of[slot] = rows
                        parts[surfaces, 0], parts[surfaces, 1], parts[surfaces, 2] = number[i], f, rows
                        surfaces += 1
                        rows += _FACE_ROWS + bodies.corners[first + f] if planes else _BALL_ROWS
                    told = -2 - row_of[slot] if planes else row_of[slot]
                owner[y, x] = told
                if told < 0:
                    hulls[down, across] = True
                else:
                    balls[down, across] = True
    return particles, surfaces, rows


@kernel
def _fill(surfaces, bodies, eye, ahead, scale, position, orientation, paint, table, first, last):
    surfaces, bodies = borrowed(surfaces), borrowed(bodies)
    for k in range(first, last):
        number, f, start = surfaces.parts[k, 0], surfaces.parts[k, 1], surfaces.parts[k, 2]
        i = surfaces.seen[number]
        place = sub(row(position, i), vector(eye))
        for channel in range(4):
            table[start + 1, channel] = paint[number, channel]
        if f < 0:
            _put_row(table, start, place, bodies.outer[i])
        else:
            depth = dot(vector(ahead), place)
            _put_face(bodies, i, f, place, depth, row4(orientation, i), scale, table, start)


@kernel
def _put_face(bodies, i, f, place, depth, turn, scale, table, start):
    """All rows of a face but that of its paint."""
    m, size, shape = matrix_of(turn), bodies.size[i], bodies.shape[i]
    first = bodies.first_plane[shape]
    normal, offset = _plane(bodies.planes, first + f, m, size, place)
    _put_row(table, start, normal, offset)
    facing, corners = -dot(normal, place) / norm(place), bodies.corners[first + f]
    _put_row(table, start + 2, (facing, depth, float(corners)), 0.0)
    start += _FACE_ROWS
    for edge in range(bodies.first_edge[shape], bodies.first_edge[shape + 1]):
        left, right = bodies.edges[edge, 0], bodies.edges[edge, 1]
        if f in (left, right):
            # How far the plane of the other face is, along this one, changes evenly over the picture too.
            other, beyond = _plane(bodies.planes, first + left + right - f, m, size, place)
            inward = sub(scaled(normal, beyond / offset), other)
            _put_row(table, start, scaled(inward, scale / norm(cross(normal, other))), 0.0)
            start += 1


@kernel
def _plane(planes, number, m, size, place):
    """Unit normal of a plane in world axes, and its distance from the eye along that."""
    normal = apply(m, vector(planes[number]))
    return normal, dot(normal, place) + planes[number, 3] * size


@kernel
def _put_row(table, number, v, w):
    table[number, 0], table[number, 1], table[number, 2], table[number, 3] = v[0], v[1], v[2], w
