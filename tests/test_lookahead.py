"""What would sink in by the end of a substep is given the contact points that keep it out."""

import numpy as np
import pytest

from particlesim.dynamics.contact.contact_points import CONTACT_POINT, normal_velocity_in
from particlesim.dynamics.contact.end_of_step_correction import place_ahead, sunk_points
from particlesim.dynamics.standing import SETTLES
from particlesim.model.bodies import angular_velocities
from tests.kernels import callable_from_python
from tests.touching import contact_of, nearly_touching

DURATION = 1e-3

normal_velocity = callable_from_python(normal_velocity_in)


def spins(sim):
    return angular_velocities(sim.model.system.body, 2)


def unknown(inradius):
    """A contact point of two bodies whose gap does not change."""
    point = np.zeros(1, dtype=CONTACT_POINT)
    point["b"], point["inradius"] = 1, inradius
    return point


def push(sim, point):
    """Let no gap close by more than there is, by impulses as those that settle get."""
    body, total = sim.model.particles, np.zeros(len(point))
    mass, spin = body["mass"], spins(sim)
    for _ in range(200):
        for k, p in enumerate(point):
            wanted = (p["bend"] - p["gap"]) / DURATION
            lack = wanted - normal_velocity(sim.model.system.body, spin, p)
            more = max(-total[k], lack * p["effective_mass"])
            total[k] += more
            body["velocity"] += more * np.array([-p["normal"] / mass[0], p["normal"] / mass[1]])
            body["angular_momentum"] += more * np.array([-p["lever_a"], p["lever_b"]])
            spin = spins(sim)


def all_momentum(sim):
    body = sim.model.particles
    of_each = body["mass"][:, None] * body["velocity"]
    return of_each.sum(axis=0), (np.cross(body["position"], of_each) + body["angular_momentum"]).sum(axis=0)


def looked_ahead(sim, before, point):
    """What is found to have sunk in after DURATION, and the separation then."""
    system = sim.model.system
    ahead = system.body.copy()
    place_ahead(system, np.full(2, SETTLES), DURATION, ahead)
    found = sunk_points(system, ahead, (*before, spins(sim)), point, DURATION)
    return found, contact_of(system, ahead)[0]


def moving(sim):
    """Velocities and angular velocities."""
    return sim.particles.velocity.copy(), spins(sim)


@pytest.mark.parametrize("shapes", [("sphere", "cube"), ("pyramid", "sphere"), ("cube", "pyramid"), ("cube", "cube")])
def test_bodies_that_would_sink_in_are_kept_apart_within_a_few_looks(shapes):
    sunk = 0
    for seed in range(60):
        sim = nearly_touching(seed, shapes)
        inradius, before = sim.particles.inradius.min(), moving(sim)
        momentum, turning = all_momentum(sim), sim.particles.angular_momentum.copy()
        point = unknown(inradius)
        for _ in range(4):
            (more, _), gap = looked_ahead(sim, before, point)
            assert (len(more) > 0) == (gap < -1e-4 * inradius)
            if not len(more):
                break
            sunk += 1
            point = np.concatenate((point, more))
            push(sim, point[1:])
        assert gap >= -1e-4 * inradius
        assert np.allclose(all_momentum(sim), momentum, rtol=0, atol=1e-12)
        for i, shape in enumerate(shapes):
            if shape == "sphere":  # nothing makes it spin
                assert np.allclose(sim.particles.angular_momentum[i], turning[i], rtol=1e-12, atol=0)
    assert sunk > 20


def approaching(shapes):
    """Two bodies that will have sunk in after DURATION, and their velocities and spins."""
    for seed in range(60):
        sim = nearly_touching(seed, shapes)
        before = moving(sim)
        (more, _), _ = looked_ahead(sim, before, unknown(0.05))
        if len(more):
            return sim, before
    raise AssertionError("none of them meet")


def numbers(point):
    """Contact points as rows of their numbers."""
    return np.column_stack([point[name].reshape(len(point), -1) for name in CONTACT_POINT.names])


@pytest.mark.parametrize("shapes", [("sphere", "sphere"), ("sphere", "cube"), ("cube", "pyramid")])
def test_what_is_added_does_not_depend_on_the_frame_of_reference(shapes):
    sim, before = approaching(shapes)
    (more, _), _ = looked_ahead(sim, before, unknown(0.05))
    wind = np.array([3.0, -2.0, 1.0])
    sim.particles.velocity[:] += wind
    (more_in_wind, _), _ = looked_ahead(sim, (before[0] + wind, before[1]), unknown(0.05))
    assert np.allclose(numbers(more_in_wind), numbers(more), rtol=1e-9, atol=1e-12)


def test_added_points_stand_beside_those_of_the_same_pair():
    sim, before = approaching(("cube", "pyramid"))
    point = np.repeat(unknown(0.05), 4)
    point["a"], point["b"] = [1, 0, 0, 1], [0, 1, 1, 0]
    point["gap"][[0, 3]] = np.inf  # the others do not come near
    (more, place), _ = looked_ahead(sim, before, point)
    assert (place == 3).all()
    assert (more["a"] == 0).all() and (more["b"] == 1).all()
    beside = np.insert(point, place, more)
    assert beside["b"].tolist() == [0, *[1] * (2 + len(more)), 0]
