"""The bodies of a movie and their shapes as tables for the rasteriser."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.core.jit import kernel
from particlesim.core.records import record
from particlesim.geometry.shape_table import ShapeTable, stack_shapes
from particlesim.rendering.visibility.rims import Rims, rims_of
from particlesim.trajectory.frames import Header

# A body: number of its shape, and the factor on that of size 1 [m].
BODY = record([("shape", "i8"), ("size", "f8")])

# How a shape is drawn: a ball is one sphere; of a faceted one each pixel sees one face; of a rounded shape one offset
# face, the cylinder about one edge, or the sphere about one vertex.
BALL, FACETED, ROUNDED = range(3)


class GeometryTables(NamedTuple):
    """The bodies of a trajectory.

    Parameters
    ----------
    shapes : ShapeTable
        Their shapes of size 1.
    rims : Rims
        Their edges that are to be seen.
    body : (n,) BODY
        Which shape each body has, and its size.
    radius, inradius : (n,) float64
        Radii of the spheres about and within each body [m].
    """

    shapes: ShapeTable
    rims: Rims
    body: np.ndarray
    radius: np.ndarray
    inradius: np.ndarray


def geometry_tables(header: Header) -> GeometryTables:
    """The bodies of a trajectory."""
    body = np.empty(len(header.size), dtype=BODY)
    body["shape"], body["size"] = header.shape, header.size
    inradius = np.array([shape.inradius for shape in header.shapes])[header.shape] * header.size
    shapes = stack_shapes(header.shapes)
    return GeometryTables(shapes, rims_of(header.shapes, shapes), body, header.radius, inradius)


def taken(tables: GeometryTables, rows: np.ndarray) -> GeometryTables:
    """Some of the bodies of a table."""
    return GeometryTables(tables.shapes, tables.rims, *(column[rows] for column in tables[2:]))


def joined(some: GeometryTables, more: GeometryTables) -> GeometryTables:
    """The bodies of two tables that have the same shapes."""
    body, radius, inradius = (np.concatenate([a, b]) for a, b in zip(some[2:], more[2:], strict=True))
    return GeometryTables(some.shapes, some.rims, body, radius, inradius)


@kernel
def drawn_as(shape):
    """Whether a SHAPE row is drawn as a BALL, a FACETED or as ROUNDED."""
    if shape.first_edge == shape.last_edge:
        return BALL
    return ROUNDED if shape.rounding > 0.0 else FACETED
