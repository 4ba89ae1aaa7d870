"""The faces of what a picture shows, worked out once for all the pixels that see them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.core.jit import entry_kernel, kernel, without_refcounts
from particlesim.core.math3d import axpy, cross, dot, load_vec3, norm, scale, set_vec3, store_vec3, sub, to_vec3
from particlesim.core.parallel import ThreadTeam
from particlesim.core.records import record
from particlesim.rendering.visibility.instances import Instances
from particlesim.rendering.visibility.projection import Projection
from particlesim.rendering.visibility.scan_lines import in_view, rotated, view_rotation

# A face: its unit normal in view coordinates, the cosine by which its body is turned to the eye with it, and its edges:
# rows first:last of FacesInView.edge.
FACE_IN_VIEW = record([("normal", "f4", (3,)), ("facing", "f4"), ("first", "i8"), ("last", "i8")])

# A form of rays that is positive for all of them.
_EVERYWHERE = 0.0, 0.0, 1.0


class FacesInView(NamedTuple):
    """The faces that some polyhedra turn to the eye; what there is of the others means nothing.

    Parameters
    ----------
    start : (k,) int64
        Where those of each polyhedron begin in ``face``.
    face : (f,) FACE_IN_VIEW
    edge : (e, 3, 3) float32
        Of each edge what, times a ray of depth 1, is how far from the edge within the face the ray meets it, as if that
        were seen from ahead [pixels], and likewise how far on from where it begins to be seen, and to where it ends.
    """

    start: np.ndarray
    face: np.ndarray
    edge: np.ndarray


def faces_in_view(instances: Instances, indices: np.ndarray, projection: Projection) -> FacesInView:
    """Of the instances ``indices`` (k,), the faces of those that are polyhedra without rounding."""
    shapes = instances.tables.shapes
    rims = instances.tables.rims.first
    faces, edges = (
        np.where(shapes.shape["rounding"] > 0.0, 0, ends[shapes.shape["last_face"]] - ends[shapes.shape["first_face"]])
        for ends in (np.arange(len(rims)), rims)
    )
    of_each = instances.tables.body["shape"][indices]
    end, last_edge = np.cumsum(faces[of_each]), np.cumsum(edges[of_each])
    view = FacesInView(
        start=end - faces[of_each],
        face=np.empty(end[-1] if len(end) else 0, dtype=FACE_IN_VIEW),
        edge=np.empty((last_edge[-1] if len(end) else 0, 3, 3), dtype=np.float32),
    )
    strip, first_edge = projection.strip(0, 0), last_edge - edges[of_each]
    world = instances.position, instances.orientation, instances.tables

    def fill(_: int, first: int, last: int) -> None:
        _fill((first, last), indices, faces, first_edge, world, strip, view)

    ThreadTeam(len(indices)).each(fill, len(indices))
    return view


@entry_kernel
def _fill(which, indices, faces, first_edge, world, strip, view):
    indices, faces, first_edge = without_refcounts(indices), without_refcounts(faces), without_refcounts(first_edge)
    world, strip, view = without_refcounts(world), without_refcounts(strip), without_refcounts(view)
    position, orientation, tables = world
    for k in range(which[0], which[1]):
        i = indices[k]
        body = tables.body[i]
        if faces[body.shape]:
            centre = in_view(strip, load_vec3(position, i))
            placed = body.shape, body.size, centre, view_rotation(strip.axes, orientation, i)
            _fill_polyhedron(placed, tables, strip.scale, first_edge[k], view, view.start[k])


@kernel
def _fill_polyhedron(placed, tables, pixels, edge, view, row):
    """Fill in the faces that a polyhedron turns to the eye; ``edge``, ``row``: its first edge and face in ``view``."""
    shapes, rims, (number, size, centre, axes) = tables.shapes, tables.rims, placed
    shape = shapes.shape[number]
    body = axpy(centre, rotated(axes, load_vec3(rims.middle, number)), -size)
    distance = norm(body)
    for f in range(shape.first_face, shape.last_face):
        face, out = shapes.face[f], view.face[row]
        normal = rotated(axes, to_vec3(face.normal))
        offset = dot(normal, centre) + face.offset * size
        if offset < 0.0:
            set_vec3(out.normal, normal)
            out.facing, out.first = -dot(normal, body) / distance, edge
            for r in range(rims.first[f], rims.first[f + 1]):
                _fill_edge(placed, (normal, offset), rims, r, pixels, view.edge[edge])
                edge += 1
            out.last = edge
        row += 1


@kernel
def _fill_edge(placed, plane, rims, r, pixels, form):
    """Fill in an edge of a face: how far what a ray meets in a plane is from a line, over its depth, is linear."""
    normal, offset = plane
    line = rims.line[r]
    here = _corner(placed, line, 1)
    way = sub(here, _corner(placed, line, 0))
    inward = cross(way, normal)  # so in axes that are left-handed, as these are
    inward = scale(inward, pixels / norm(inward))
    store_vec3(form, 0, axpy(inward, normal, -dot(inward, here) / offset))
    if rims.whole[r]:
        store_vec3(form, 1, _EVERYWHERE)
        store_vec3(form, 2, _EVERYWHERE)
        return
    way = scale(way, pixels / norm(way))
    store_vec3(form, 1, axpy(way, normal, -dot(way, _corner(placed, line, 2)) / offset))
    back = scale(way, -1.0)
    store_vec3(form, 2, axpy(back, normal, -dot(back, _corner(placed, line, 3)) / offset))


@kernel
def _corner(placed, line, k):
    """A point of a line in view coordinates."""
    return axpy(placed[2], rotated(placed[3], load_vec3(line, k)), placed[1])
