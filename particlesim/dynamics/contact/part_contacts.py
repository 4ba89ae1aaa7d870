"""The contacts of bodies of which one has parts at one moment: one for each normal with which they touch."""

from __future__ import annotations

import math

from particlesim.core.jit import kernel
from particlesim.core.math3d import load_vec3
from particlesim.dynamics.contact.contact import find_contact, write_contact
from particlesim.dynamics.contact.part_patches import gather_patches, new_patches, patch_corners
from particlesim.dynamics.settings import MESH_TOUCH
from particlesim.geometry.support import has_parts
from particlesim.geometry.tolerances import NORMAL_SINE, PARALLEL_TOLERANCE


@kernel
def _find_part_contacts(system, meshes, moment, c, total):
    """Fill in contact ``c``, of bodies that have parts, and those of other normals after the ``total``; how many then.

    Where nothing is touched it has no points.
    """
    a, b = moment.actor[moment.contact[c].a], moment.actor[moment.contact[c].b]
    sizes = a.scale if b.inradius == math.inf else a.scale + b.scale
    patches, limits = new_patches(), (MESH_TOUCH * sizes, PARALLEL_TOLERANCE, 0.0)
    offset, count, _ = gather_patches(system, meshes, a, b, limits, NORMAL_SINE, patches)
    write_contact(moment.contact[c], (0.0, 0.0, 1.0), offset, 0)
    for k in range(count):
        slot = c
        if k > 0:
            if total == len(moment.contact):
                break
            slot = total
            moment.contact[slot].a, moment.contact[slot].b = moment.contact[c].a, moment.contact[c].b
            total += 1
        kept = patch_corners(patches, k, moment.points[slot])
        write_contact(moment.contact[slot], load_vec3(patches.normal, k), offset, kept)
    return total


@kernel
def find_contacts(system, meshes, moment, count):
    """Fill in the contacts of a moment where its bodies are now, and their points; returns how many there are then."""
    total = count
    for c in range(count):
        contact = moment.contact[c]
        a, b = moment.actor[contact.a], moment.actor[contact.b]
        if meshes is not None and (has_parts(system.shapes, a.shape_row) or has_parts(system.shapes, b.shape_row)):
            total = _find_part_contacts(system, meshes, moment, c, total)
        else:
            find_contact(system, a, b, contact, moment.points[c])
    return total
