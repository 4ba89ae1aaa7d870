"""What the pixels of a picture look like: each shades the one surface that it sees, the others the floor or nothing.

All in view coordinates: x to the right, y up and z away from the eye. What a pixel sees lies on its ray (x, y, 1), at
that divided by its inverse depth. A row is shaded run by run, of pixels beside each other that see the same primitive:
its numbers are worked out once, and what is left to do for each pixel is arithmetic that processors do eight at a time.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.core.jit import entry_kernel, kernel, without_refcounts
from particlesim.core.math3d import load_vec3
from particlesim.core.parallel import ThreadTeam
from particlesim.rendering.shading.faces_in_view import faces_in_view
from particlesim.rendering.shading.lighting import Lighting
from particlesim.rendering.shading.pixel_light import LightMaps, pixel_light
from particlesim.rendering.shading.pixel_row import new_row
from particlesim.rendering.shading.runs import round_form, run_from, seen_span
from particlesim.rendering.shading.shade_face import find_rim, shade_face
from particlesim.rendering.shading.shade_floor import Ground, find_floor, floor_form, shade_floor, shade_nothing
from particlesim.rendering.shading.shade_round import shade_round
from particlesim.rendering.shading.shadow import light_row
from particlesim.rendering.visibility.geometry_tables import FACETED
from particlesim.rendering.visibility.instances import Instances
from particlesim.rendering.visibility.projection import Projection
from particlesim.rendering.visibility.rasterise import VisibilityBuffer
from particlesim.rendering.visibility.scan_lines import in_view


class Seen(NamedTuple):
    """The instances that pixels see.

    Parameters
    ----------
    indices : (k,) int64
    number : (m,) int32
        The place of each instance among them, -1 for those that are not.
    """

    indices: np.ndarray
    number: np.ndarray


class Paint(NamedTuple):
    """What instances are coloured with.

    Parameters
    ----------
    seen : Seen
        Which instances.
    colour : (k, 4) float64
        Linear colour, and share of the ambient light, of each that is seen.
    haze : (3,) float64
        Depth where it begins [m], 1 / depth over which it grows [1/m], and the share of the background in the colour of
        what is at its end.
    """

    seen: Seen
    colour: np.ndarray
    haze: np.ndarray


def seen_instances(buffer: VisibilityBuffer, count: int) -> Seen:
    """Those of ``count`` instances that pixels see."""
    number = np.full(count, -1, dtype=np.int32)
    indices = np.empty(min(count, buffer.id.size), dtype=np.int64)
    return Seen(indices[: _list_instances(buffer.id, number, indices)], number)


def shade(
    projection: Projection,
    buffer: VisibilityBuffer,
    instances: Instances,
    paint: Paint,
    lighting: Lighting,
    ground: Ground,
    maps: tuple[LightMaps, LightMaps] | None = None,
) -> np.ndarray:
    """The picture, (height, width, 4) uint8 sRGB, its first row the lowest and its fourth channel full.

    ``maps``: of the points of a lamp and of the sky, whose light is then found for each pixel; ``lighting`` has but one
    map of the key light, and the colours of ``paint`` a share of the sky's.
    """
    height, width = buffer.id.shape
    pixels = np.empty((height, width), dtype=np.int32)
    faces = faces_in_view(instances, paint.seen.indices, projection)
    world = instances.position, instances.orientation, instances.tables, paint, faces
    strip = projection.strip(0, width)
    light = None if maps is None else pixel_light(strip, buffer, world, ground, *maps)

    def fill(_: int, first: int, last: int) -> None:
        _shade_rows((first, last), strip, buffer, world, lighting, ground, light, pixels)

    team = ThreadTeam(pixels.size)
    # Rows of the sky take less work than others.
    team.each(fill, height, 4 * team.threads)
    return pixels.view(np.uint8).reshape(height, width, 4)


@entry_kernel
def _list_instances(ids, number, indices):
    """Number the instances that pixels see, and list them; returns how many they are."""
    found, last = 0, -1
    for y in range(ids.shape[0]):
        for x in range(ids.shape[1]):
            i = ids[y, x]
            # Most pixels show what the one before them shows.
            if i != last:
                last = i
                if i >= 0 and number[i] < 0:
                    number[i] = found
                    indices[found] = i
                    found += 1
    return found


@entry_kernel
def _shade_rows(rows, strip, buffer, world, lighting, ground, light, pixels):
    strip, buffer, world = without_refcounts(strip), without_refcounts(buffer), without_refcounts(world)
    lighting, ground, pixels = without_refcounts(lighting), without_refcounts(ground), without_refcounts(pixels)
    width, to_floor = pixels.shape[1], floor_form(strip, ground)
    row = new_row(strip, width)
    for number in range(rows[0], rows[1]):
        y = (number + 0.5 - strip.middle_y) / strip.scale
        find_floor(y, strip, ground, buffer.inverse_depth[number], row)
        if light is None:
            light_row(seen_span(row.close), y, lighting, row)
            out = pixels[number], None
        else:
            row.lit[:] = light.lit[number]
            out = pixels[number], light.sky[number]
        first = 0
        while first < width:
            last, kind = run_from(buffer, number, first, row.close, world[2])
            span = first, last, y
            if kind >= 0:
                which = buffer.id[number, first], buffer.primitive[number, first], kind
                _shade_instance(span, which, strip, world, lighting, ground.colours[0], row, out)
            elif row.close[first] > 0.0:
                shade_floor(span, number, to_floor, ground, row, out[0], out[1])
            else:
                shade_nothing(span, ground, pixels[number])
            first = last


@kernel
def _shade_instance(span, which, strip, world, lighting, background, row, out):
    """Shade a run of pixels that see the same primitive; ``which``: instance, primitive, and how it is drawn."""
    position, _, _, paint, faces = world
    pixels, sky = out
    i, p, kind = which
    centre = in_view(strip, load_vec3(position, i))
    number, haze = paint.seen.number[i], paint.haze
    over = haze[2] * min(max((centre[2] - haze[0]) * haze[1], 0.0), 1.0)
    colour = paint.colour[number, 0], paint.colour[number, 1], paint.colour[number, 2], paint.colour[number, 3], over
    if kind == FACETED:
        face = faces.face[faces.start[number] + p]
        find_rim(span, face, faces.edge, row)
        shade_face(span, face, colour, lighting, background, row, pixels, sky)
        return
    form = round_form(which, centre, strip, world)
    shade_round(span, form, colour, lighting, background, row, pixels, sky)
