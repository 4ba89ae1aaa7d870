"""What is seen at each pixel, found before anything is shaded.

All instances are visited, cluster by cluster from near to far, and each leaves at the pixels where it is the nearest
so far its inverse depth, its number, and which of its primitives is seen: the picture shades each of these pixels once.
The shadow map is what the light sees. Depth is sampled at the middles of pixels, so nothing else counts.

Inverse depth is 1 / distance along the axis of the view; in a parallel projection it is minus the distance.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.core.jit import entry_kernel, kernel, without_refcounts
from particlesim.core.math3d import load_vec3
from particlesim.core.parallel import ThreadTeam
from particlesim.rendering.visibility.depth_tiles import TILE, any_farther, depth_tiles, is_hidden, mark_stale
from particlesim.rendering.visibility.geometry_tables import BALL, FACETED, drawn_as
from particlesim.rendering.visibility.instances import Instances
from particlesim.rendering.visibility.occlusion_clusters import OcclusionClusters
from particlesim.rendering.visibility.projection import Projection, depth_order
from particlesim.rendering.visibility.rasterise_polyhedron import (
    rasterise_near_polyhedron,
    rasterise_polyhedron,
    rasterise_polyhedron_shadow,
)
from particlesim.rendering.visibility.rasterise_rounded import rasterise_rounded, rasterise_rounded_shadow
from particlesim.rendering.visibility.rasterise_sphere import rasterise_disc, rasterise_near_sphere, rasterise_sphere
from particlesim.rendering.visibility.scan_lines import in_view, scratch_for, view_rotation
from particlesim.rendering.visibility.screen_bounds import outside_frustum, screen_box, whole_strip


class VisibilityBuffer(NamedTuple):
    """What each pixel sees; all (height, width), the first row the lowest.

    Parameters
    ----------
    inverse_depth : float32
        That of the nearest surface [1/m], or minus its distance [m]; -inf where there is none.
    id : int32
        Number of the instance that is seen, or -1.
    primitive : int32
        Which of its primitives, unless it is a ball: faces, then edges, then vertices, in the order of its shape.
    """

    inverse_depth: np.ndarray
    id: np.ndarray
    primitive: np.ndarray


def rasterise(projection: Projection, instances: Instances, clusters: OcclusionClusters) -> VisibilityBuffer:
    """Find what is seen of ``instances``, which are in ``clusters``.

    In a parallel projection, which is that of a light, only the inverse depth is filled in, and of each shape by a
    surface within it that has its outline: a ball as the disc through its centre, a polyhedron as the faces that it
    turns away, a rounded shape as its core swept by such a disc. So none of them casts a shadow on its own lit side.
    """
    width, height = projection.size
    buffer = VisibilityBuffer(
        inverse_depth=np.full((height, width), -np.inf, dtype=np.float32),
        id=np.full((height, width), -1, dtype=np.int32),
        primitive=np.empty((height, width), dtype=np.int32),
    )
    tiles = depth_tiles(width, height)
    # Middles of the clusters' AABBs in view coordinates, and how far these reach from there.
    middle = (0.5 * (clusters.lower + clusters.upper) - projection.eye) @ projection.axes.T
    reach = 0.5 * (clusters.upper - clusters.lower) @ np.abs(projection.axes).T
    order = depth_order(middle[:, 2] - reach[:, 2])
    world = clusters, instances.orientation, instances.tables.body, instances.tables.shapes

    def fill(_: int, first: int, last: int) -> None:
        # A tile belongs to one strip.
        strip = projection.strip(first * TILE, min(last * TILE, width))
        scratch = scratch_for(instances.tables.shapes)
        _rasterise_strip(order, middle, reach, world, strip, scratch, buffer, tiles)

    # What hides what in a strip of the picture is told by that strip alone; some take more work than others.
    team = ThreadTeam(buffer.inverse_depth.size)
    team.each(fill, tiles.stale.shape[1], 2 * team.threads)
    return buffer


@entry_kernel
def _rasterise_strip(order, middle, reach, world, strip, scratch, buffer, tiles):
    """Visit all that a strip of the picture might see."""
    world, strip, scratch = without_refcounts(world), without_refcounts(strip), without_refcounts(scratch)
    buffer, tiles = without_refcounts(buffer), without_refcounts(tiles)
    start = world[0].start
    for c in order:
        centre = middle[c, 0], middle[c, 1], middle[c, 2]
        half = reach[c, 0], reach[c, 1], reach[c, 2]
        if strip.parallel or centre[2] > half[2]:
            box, front = screen_box(centre, half, strip)
            if is_hidden(buffer.inverse_depth, tiles, box, front):
                continue
        for k in range(start[c], start[c + 1]):
            _rasterise_instance(k, world, strip, scratch, buffer, tiles)


@kernel
def _rasterise_instance(k, world, strip, scratch, buffer, tiles):
    clusters, orientation, body, shapes = world
    centre, radius, i = in_view(strip, load_vec3(clusters.sphere, k)), clusters.sphere[k, 3], clusters.indices[k]
    near = not strip.parallel and centre[2] <= radius
    if near:
        # Any pixel may see some of it, but for what is behind or out of the picture altogether.
        if centre[2] <= -radius or outside_frustum(centre, radius, strip):
            return
        box = whole_strip(strip)
    else:
        box, front = screen_box(centre, (radius, radius, radius), strip)
        if is_hidden(buffer.inverse_depth, tiles, box, front) or not any_farther(buffer.inverse_depth, box, front):
            return
    number = body[i].shape
    kind = drawn_as(shapes.shape[number])
    if kind == BALL:
        _rasterise_ball(i, centre, radius, near, strip, buffer)
    else:
        placed = number, body[i].size, centre, view_rotation(strip.axes, orientation, i)
        if kind == FACETED:
            _rasterise_faceted((i, near), placed, shapes, strip, box, scratch, buffer)
        elif strip.parallel:
            rasterise_rounded_shadow(placed, shapes, strip, box, scratch, buffer.inverse_depth)
        else:
            rasterise_rounded(i, placed, shapes, strip, box, scratch, buffer)
    mark_stale(tiles, box)


@kernel
def _rasterise_ball(i, centre, radius, near, strip, buffer):
    if strip.parallel:
        rasterise_disc(centre, radius, strip, buffer.inverse_depth)
    elif near:
        rasterise_near_sphere(i, None, centre, radius, strip, buffer)
    else:
        rasterise_sphere(i, None, centre, radius, strip, buffer)


@kernel
def _rasterise_faceted(which, placed, shapes, strip, box, scratch, buffer):
    """A polyhedron; ``which``: number of the instance, and whether it reaches beside the eye."""
    if strip.parallel:
        rasterise_polyhedron_shadow(placed, shapes, strip, box, scratch, buffer.inverse_depth)
    elif which[1]:
        rasterise_near_polyhedron(which[0], placed, shapes, strip, scratch, buffer)
    else:
        rasterise_polyhedron(which[0], placed, shapes, strip, box, scratch, buffer)
