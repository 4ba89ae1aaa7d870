"""Light from a lamp that has a size, and from everywhere, pixel by pixel: what many shadow maps say, taken together.

The lamp is points of a disc, and the sky directions spread evenly, each with a map of what it sees. A pixel is lit by
those that see it: soft edges, wider the farther away what casts them, and ambient occlusion from all that is there.
Rows of a picture take turns, each with half of the maps: pixels are means of several rows.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from particlesim.core.jit import entry_kernel, kernel, without_refcounts
from particlesim.core.math3d import load_vec3
from particlesim.core.parallel import ThreadTeam
from particlesim.rendering.shading.light import NONE, ONE, single
from particlesim.rendering.shading.lighting import Light, Lighting
from particlesim.rendering.shading.pixel_row import new_row
from particlesim.rendering.shading.runs import round_form, run_from, seen_span
from particlesim.rendering.shading.shade_floor import Ground, find_floor
from particlesim.rendering.shading.shadow import ShadowMap, light_row, shadow_map
from particlesim.rendering.visibility.geometry_tables import FACETED
from particlesim.rendering.visibility.projection import Projection, Strip
from particlesim.rendering.visibility.rasterise import VisibilityBuffer
from particlesim.rendering.visibility.scan_lines import in_view

# Share of the light from everywhere where nothing of the sky is seen: what surfaces send on to each other.
_LEAST = np.float32(0.3)

_TINY = np.float32(1e-6)
_GOLDEN = math.pi * (3.0 - math.sqrt(5.0))  # [rad], the angle from one seed of a sunflower to the next


class LightMaps(NamedTuple):
    """Lights from several directions, as ``Lighting`` has one; all with maps of one size.

    Parameters
    ----------
    towards : (k, 3) float64
    zenith : (3,) float64
    to_map : (k, 3, 4) float64
    closeness, least, most : (k, h, w) float32
    """

    towards: np.ndarray
    zenith: np.ndarray
    to_map: np.ndarray
    closeness: np.ndarray
    least: np.ndarray
    most: np.ndarray


class PixelLight(NamedTuple):
    """Shares 0 .. 1 of the light that reach what each pixel sees, both (height, width) float32.

    ``lit``: of the key light; ``sky``: of the light from everywhere.
    """

    lit: np.ndarray
    sky: np.ndarray


def disc_of_lamps(towards: np.ndarray, count: int, width: float, turn: float) -> np.ndarray:
    """Unit vectors (count, 3) to points of a lamp whose disc is ``width`` [rad] across about ``towards`` (3,)."""
    right = np.array([-towards[1], towards[0], 0.0]) / np.hypot(*towards[:2])
    number = np.arange(count)
    radius = 0.5 * width * np.sqrt((number + 0.5) / count)
    angle = _GOLDEN * number + 2.0 * np.pi * turn
    aside = np.outer(np.cos(angle), right) + np.outer(np.sin(angle), np.cross(towards, right))
    points = towards + radius[:, None] * aside
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def all_around(count: int, lift: float, turn: float) -> np.ndarray:
    """Unit vectors (count, 3) spread evenly: a spiral that is ``lift``, 0 .. 1 of a step, and ``turn``ed, 0 .. 1."""
    number = np.arange(count)
    z = 1.0 - 2.0 * (number + np.clip(lift, 0.02, 0.98)) / count
    angle, across = _GOLDEN * number + 2.0 * np.pi * turn, np.sqrt(1.0 - z * z)
    return np.column_stack([across * np.cos(angle), across * np.sin(angle), z])


def light_maps(lights: list[Light], closeness: list[np.ndarray], view: Projection) -> LightMaps:
    """Lights, and how close to each what it sees is, (h, w) float32 [m], as ``view`` has them."""
    each = [light.in_view(view, shadow_map(seen)) for light, seen in zip(lights, closeness, strict=True)]
    shadows = [lighting.shadow for lighting in each]
    return LightMaps(
        np.array([lighting.towards for lighting in each]),
        each[0].zenith,
        np.array([lighting.to_map for lighting in each]),
        *(np.array([shadow[k] for shadow in shadows]) for k in range(3)),
    )


def pixel_light(
    strip: Strip, buffer: VisibilityBuffer, world: tuple, ground: Ground, lamps: LightMaps, sky: LightMaps
) -> PixelLight:
    """What reaches each pixel of a picture: ``world`` as ``shade`` has it."""
    light = PixelLight(*np.empty((2, *buffer.id.shape), dtype=np.float32))

    def fill(_: int, first: int, last: int) -> None:
        _fill_rows((first, last), strip, buffer, world, ground, (lamps, sky), light)

    team = ThreadTeam(light.lit.size)
    team.each(fill, len(light.lit), 4 * team.threads)
    return light


@entry_kernel
def _fill_rows(rows, strip, buffer, world, ground, maps, light):
    strip, buffer, world = without_refcounts(strip), without_refcounts(buffer), without_refcounts(world)
    ground, maps, light = without_refcounts(ground), without_refcounts(maps), without_refcounts(light)
    width = light.lit.shape[1]
    normal, weight = np.empty((3, width), dtype=np.float32), np.empty(width, dtype=np.float32)
    row = new_row(strip, width)
    for number in range(rows[0], rows[1]):
        y = (number + 0.5 - strip.middle_y) / strip.scale
        find_floor(y, strip, ground, buffer.inverse_depth[number], row)
        first, last = seen_span(row.close)
        span = first, last, y
        _mean(span, number, maps[0], row, light.lit[number])
        _find_normals(number, y, strip, (buffer, world, maps[1].zenith), row, normal)
        _mean_of_sky(span, number, maps[1], row, (normal, weight), light.sky[number])


@kernel
def _lighting(maps, k):
    shadow = ShadowMap(maps.closeness[k], maps.least[k], maps.most[k])
    return Lighting(maps.towards[k], maps.zenith, maps.to_map[k], shadow)


@kernel
def _mean(span, number, maps, row, out):
    """Fill in the mean share of all lights of a row's turn."""
    first, last, y = span
    out[:] = NONE
    total, lit = out[first:last], row.lit[first:last]
    turns, count = len(maps.towards), NONE
    for k in range(number % min(2, turns), turns, 2):
        light_row((first, last), y, _lighting(maps, k), row)
        for x in range(len(total)):
            total[x] += lit[x]
        count += ONE
    for x in range(len(total)):
        total[x] /= count


@kernel
def _mean_of_sky(span, number, maps, row, room, out):
    """The same of directions of the sky, each as much as a matt surface is turned to it; ``room``: normals, weights."""
    first, last, y = span
    normal, weight = room
    out[:] = ONE
    total, lit, full = out[first:last], row.lit[first:last], weight[first:last]
    a, b, c = normal[0, first:last], normal[1, first:last], normal[2, first:last]
    total[:], full[:] = NONE, _TINY
    for k in range(number % 2, len(maps.towards), 2):
        light_row((first, last), y, _lighting(maps, k), row)
        towards = single(maps.towards[k])
        for x in range(len(total)):
            turned = max(a[x] * towards[0] + b[x] * towards[1] + c[x] * towards[2], NONE)
            total[x] += turned * lit[x]
            full[x] += turned
    for x in range(len(total)):
        total[x] = _LEAST + (ONE - _LEAST) * total[x] / full[x]


@kernel
def _find_normals(number, y, strip, seen, row, normal):
    """Write the unit normal of what each pixel of a row sees, in view coordinates, (3, width)."""
    buffer, world, zenith = seen
    first = 0
    while first < len(row.close):
        last, kind = run_from(buffer, number, first, row.close, world[2])
        if kind < 0:
            normal[0, first:last], normal[1, first:last], normal[2, first:last] = single(zenith)
        else:
            i, p = buffer.id[number, first], buffer.primitive[number, first]
            centre = in_view(strip, load_vec3(world[0], i))
            if kind == FACETED:
                face = world[4].face[world[4].start[world[3].seen.number[i]] + p].normal
                form = centre, (0.0, 0.0, 0.0), 0.0, (float(face[0]), float(face[1]), float(face[2]))
            else:
                form = round_form((i, p, kind), centre, strip, world)
            _write_normals((first, last, y), form, row, normal)
        first = last


@kernel
def _write_normals(span, form, row, normal):
    """Normals of a surface whose ``form`` is as ``shade_round`` has it."""
    first, last, y = span
    centre, axis, flat = single(form[0]), single(form[1]), single(form[3])
    bend, v = np.float32(form[2]), np.float32(y)
    aside, close = row.aside[first:last], row.close[first:last]
    nx, ny, nz = normal[0, first:last], normal[1, first:last], normal[2, first:last]
    for k in range(len(aside)):
        depth = ONE / close[k]
        a, b, c = aside[k] * depth - centre[0], v * depth - centre[1], depth - centre[2]
        along = a * axis[0] + b * axis[1] + c * axis[2]
        nx[k] = flat[0] + (a - along * axis[0]) * bend
        ny[k] = flat[1] + (b - along * axis[1]) * bend
        nz[k] = flat[2] + (c - along * axis[2]) * bend
