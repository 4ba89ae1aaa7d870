"""Two shapes in special positions, in a world that is not aligned with the axes, so that nothing is exact by luck."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import particlesim as ps
from tests import oracles
from tests.oracles import unit_quaternion

UPRIGHT = (1.0, 0.0, 0.0, 0.0)
TILTS = (UPRIGHT, tuple(unit_quaternion(np.random.default_rng(1))), tuple(unit_quaternion(np.random.default_rng(2))))
GAPS = (0.0, 1e-3, -1e-3, 1e-9, -1e-9, 1e-12, -1e-12)


def about(axis, degrees):
    """The quaternion of a rotation about an axis."""
    rotation = Rotation.from_rotvec(np.radians(degrees) * np.asarray(axis) / np.linalg.norm(axis))
    return np.roll(rotation.as_quat(), 1)


def sorted_rows(points):
    return np.array(sorted(np.round(points, 7).tolist())) + 0.0


def meet(shape_a, shape_b, offset, turn_a=UPRIGHT, turn_b=UPRIGHT, size_b=1.0, tilt=UPRIGHT):
    """The separation with everything tilted, and seen in axes that are tilted too; a stands at the origin."""
    found = ps.separation(
        shape_a,
        ((0.0, 0.0, 0.0), oracles.product(tilt, turn_a)),
        shape_b,
        (oracles.turned(tilt, offset), oracles.product(tilt, turn_b), size_b),
    )
    back = oracles.rotation(tilt).T
    return found.distance, back @ found.normal, found.points @ back.T


def check(found, distance, normal, points, uncertain=1e-12):
    assert found[0] == pytest.approx(distance, abs=1e-14)
    np.testing.assert_allclose(found[1], normal, atol=uncertain)
    np.testing.assert_allclose(sorted_rows(found[2]), sorted_rows(np.asarray(points, dtype=float)), atol=1e-7)
