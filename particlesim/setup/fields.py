"""The fields of a scene as the solver takes them."""

from __future__ import annotations

import numpy as np

from particlesim.model.fields import CENTRAL, DRAG, EVERYWHERE, FIELD, IN_BOX, IN_ELLIPSOID, UNIFORM, VORTEX
from particlesim.scene import Scene
from particlesim.scene.fields import CentralField, UniformField, VortexField

_WHERE = {"box": IN_BOX, "ellipsoid": IN_ELLIPSOID}


def fields_of(scene: Scene) -> np.ndarray:
    """The fields of a scene, (f,) FIELD."""
    fields = np.zeros(len(scene.fields), dtype=FIELD)
    for row, field in zip(fields, scene.fields, strict=True):
        if isinstance(field, UniformField):
            row["kind"], row["vector"] = UNIFORM, field.acceleration
        elif isinstance(field, CentralField):
            row["kind"], row["centre"], row["strength"] = CENTRAL, field.centre, field.strength
            row["exponent"], row["softening"] = field.exponent, field.softening
        elif isinstance(field, VortexField):
            row["kind"], row["centre"], row["strength"] = VORTEX, field.centre, field.strength
            row["vector"] = np.asarray(field.axis) / np.linalg.norm(field.axis)
        else:
            row["kind"], row["strength"], row["vector"] = DRAG, field.coefficient, field.velocity
        row["where"] = EVERYWHERE
        if field.region is not None:
            row["where"], row["lower"], row["upper"] = _WHERE[field.region.form], field.region.lower, field.region.upper
    return fields
