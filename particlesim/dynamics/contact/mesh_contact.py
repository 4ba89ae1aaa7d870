"""The contacts of a particle with a mesh at one moment: one for each normal with which the mesh is touched.

Triangles in one plane are one face, however it is divided: their points are those of one patch.
"""

from __future__ import annotations

import numpy as np

from particlesim.core.constants import MAX_MANIFOLD
from particlesim.core.jit import kernel
from particlesim.core.math3d import inverse_rotate, load_vec3, norm, scale, store_vec3, sub, to_quat, to_vec3
from particlesim.dynamics.contact.contact import find_contact, write_contact
from particlesim.dynamics.settings import MESH_TOUCH
from particlesim.geometry.narrow_phase.mesh import box_about, has_normal, next_triangle
from particlesim.geometry.narrow_phase.pair import pair_contact
from particlesim.geometry.narrow_phase.patch import MAX_GATHERED, corners_of, keep_some
from particlesim.geometry.support import is_mesh
from particlesim.geometry.tolerances import NORMAL_SINE
from particlesim.model.bodies import placed
from particlesim.model.domain import nearest_image

# Normals with which a particle touches a mesh at one moment; there may be more, and they are met one after the other.
_MAX_NORMALS = 16


@kernel
def _number_of(normals, count, normal):
    """Which of the normals is this one; one more is added if none is, -1 if there is no room for it."""
    for k in range(count):
        if norm(sub(load_vec3(normals, k), normal)) <= NORMAL_SINE:
            return k
    if count == len(normals):
        return -1
    store_vec3(normals, count, normal)
    return count


@kernel
def _add_points(patch, size, points, count, normal):
    """Add points to a patch, which has ``size``, of which no more are kept than its corners; how many it has then."""
    if size + count > len(patch):
        size = corners_of(patch, size, normal)
    if size + count > len(patch):
        size = keep_some(patch, size, patch)
    for k in range(count):
        store_vec3(patch, size + k, load_vec3(points, k))
    return size + count


@kernel
def _gather(system, meshes, a, b, offset, patches):
    """Find the normals with which ``a`` touches mesh ``b``, and the points of each; returns how many there are.

    ``patches`` are (normals (n, 3), how many points each has (n,), these points (n, MAX_GATHERED, 3)).
    """
    normals, sizes, gathered = patches
    points, centre = np.empty((MAX_MANIFOLD, 3)), scale(offset, -1.0)
    near = MESH_TOUCH * a.scale
    box, count = box_about(placed(b), centre, centre, a.radius + near), 0
    place, row = next_triangle(system.shapes, meshes, b.shape_row, (0, 0), box)
    while row >= 0:
        triangle = row, b.scale, to_quat(b.orientation)
        separation, normal, found = pair_contact(system.shapes, placed(a), triangle, offset, points)
        outwards = inverse_rotate(to_quat(b.orientation), scale(normal, -1.0))
        if separation <= near and has_normal(system.shapes, meshes, row, outwards):
            k = _number_of(normals, count, normal)
            if k == count:
                sizes[k] = 0
                count += 1
            if k >= 0:
                sizes[k] = _add_points(gathered[k], sizes[k], points, found, load_vec3(normals, k))
        place, row = next_triangle(system.shapes, meshes, b.shape_row, place, box)
    return count


@kernel
def _find_mesh_contacts(system, meshes, moment, c, total):
    """Fill in contact ``c``, of a particle and a mesh, and those of other normals after the ``total``; how many then.

    Where nothing is touched it has no points.
    """
    a, b = moment.actor[moment.contact[c].a], moment.actor[moment.contact[c].b]
    offset = nearest_image(sub(to_vec3(b.position), to_vec3(a.position)), system.domain[0].period)
    normals, sizes = np.empty((_MAX_NORMALS, 3)), np.zeros(_MAX_NORMALS, dtype=np.int64)
    gathered = np.empty((_MAX_NORMALS, MAX_GATHERED, 3))
    count = _gather(system, meshes, a, b, offset, (normals, sizes, gathered))
    write_contact(moment.contact[c], (0.0, 0.0, 1.0), offset, 0)
    for k in range(count):
        slot = c
        if k > 0:
            if total == len(moment.contact):
                break
            slot = total
            moment.contact[slot].a, moment.contact[slot].b = moment.contact[c].a, moment.contact[c].b
            total += 1
        normal, patch = load_vec3(normals, k), gathered[k]
        size = corners_of(patch, sizes[k], normal)
        write_contact(moment.contact[slot], normal, offset, keep_some(patch, size, moment.points[slot]))
    return total


@kernel
def find_contacts(system, meshes, moment, count):
    """Fill in the contacts of a moment where its bodies are now, and their points; returns how many there are then."""
    total = count
    for c in range(count):
        contact = moment.contact[c]
        a, b = moment.actor[contact.a], moment.actor[contact.b]
        if meshes is not None and is_mesh(system.shapes, b.shape_row):
            total = _find_mesh_contacts(system, meshes, moment, c, total)
        else:
            find_contact(system, a, b, contact, moment.points[c])
    return total
