"""What would sink in by the end of a stretch of time is given the contact points that keep it out."""

import numpy as np
import pytest

from particlesim.core.constants import MAX_MANIFOLD, SETTLES
from particlesim.dynamics.contact.contact_points import (
    BEND,
    COLUMNS,
    GAP,
    INRADIUS,
    LEVER_I,
    LEVER_J,
    MASS,
    NORMAL,
    parting_at,
)
from particlesim.dynamics.contact.end_of_step_correction import fly, sunk_points
from particlesim.model.bodies import State
from particlesim.model.free_motion import spins
from particlesim.model.touching import contact_now
from tests.touching import nearly_touching

DURATION = 1e-3


def unknown(inradius):
    """A contact point of two bodies whose gap does not change, and its partners."""
    point = np.zeros((1, COLUMNS))
    point[0, INRADIUS] = inradius
    return np.array([[0, 1]]), point


def push(sim, partner, point):
    """Let no gap close by more than there is, by impulses as those who settle get."""
    state, mass, total = sim.state, sim.constants.mass, np.zeros(len(point))
    spin = spins(sim.constants, state)
    for _ in range(200):
        for k, row in enumerate(point):
            wanted = (row[BEND] - row[GAP]) / DURATION
            lack = wanted - parting_at(state.velocity, spin, *partner[k], point, k)
            more = max(-total[k], lack * row[MASS])
            total[k] += more
            normal = row[NORMAL : NORMAL + 3]
            state.velocity[:] += more * np.array([-normal / mass[0], normal / mass[1]])
            state.angular_momentum[:] += more * np.array([-row[LEVER_I : LEVER_I + 3], row[LEVER_J : LEVER_J + 3]])
            spin = spins(sim.constants, state)


def all_momentum(sim):
    state = sim.state
    of_each = sim.constants.mass[:, None] * state.velocity
    return of_each.sum(axis=0), (np.cross(state.position, of_each) + state.angular_momentum).sum(axis=0)


def looked_ahead(sim, before, partner, point):
    """What is found to have sunk in after DURATION, and the separation then."""
    ahead = State(*(array.copy() for array in sim.state))
    where = sim.table, sim.world, sim.constants
    fly(sim.constants, sim.state, np.zeros((2, 3)), np.full(2, SETTLES), DURATION, ahead)
    spin = spins(sim.constants, sim.state)
    found = sunk_points(*where, sim.state, ahead, spin, before, partner, point, DURATION)
    gap, _, _, _ = contact_now(*where, ahead, 0, 1, np.empty((MAX_MANIFOLD, 3)))
    return found, gap


@pytest.mark.parametrize("shapes", [("sphere", "cube"), ("pyramid", "sphere"), ("cube", "pyramid"), ("cube", "cube")])
def test_bodies_that_would_sink_in_are_kept_apart_within_a_few_looks(shapes):
    sunk = 0
    for seed in range(60):
        sim = nearly_touching(seed, shapes)
        state, inradius = sim.state, sim.constants.inradius.min()
        before = state.velocity.copy(), spins(sim.constants, state)
        momentum, turning = all_momentum(sim), state.angular_momentum.copy()
        partner, point = unknown(inradius)
        for _ in range(4):
            (more, of, _), gap = looked_ahead(sim, before, partner, point)
            assert (len(more) > 0) == (gap < -1e-4 * inradius)
            if not len(more):
                break
            sunk += 1
            partner, point = np.concatenate((partner, of)), np.concatenate((point, more))
            push(sim, partner[1:], point[1:])
        assert gap >= -1e-4 * inradius
        assert np.allclose(all_momentum(sim), momentum, rtol=0, atol=1e-12)
        for i, shape in enumerate(shapes):
            if shape == "sphere":  # nothing makes it spin
                assert np.allclose(state.angular_momentum[i], turning[i], rtol=1e-12, atol=0)
    assert sunk > 20


def approaching(shapes):
    """Two bodies that will have sunk in after DURATION, and their velocities and spins."""
    for seed in range(60):
        sim = nearly_touching(seed, shapes)
        before = sim.state.velocity.copy(), spins(sim.constants, sim.state)
        (more, _, _), _ = looked_ahead(sim, before, *unknown(0.05))
        if len(more):
            return sim, before
    raise AssertionError("none of them meet")


@pytest.mark.parametrize("shapes", [("sphere", "sphere"), ("sphere", "cube"), ("cube", "pyramid")])
def test_what_is_added_does_not_depend_on_who_looks(shapes):
    sim, before = approaching(shapes)
    (more, _, _), _ = looked_ahead(sim, before, *unknown(0.05))
    wind = np.array([3.0, -2.0, 1.0])
    sim.state.velocity[:] += wind
    (more_in_wind, _, _), _ = looked_ahead(sim, (before[0] + wind, before[1]), *unknown(0.05))
    assert np.allclose(more_in_wind, more, rtol=1e-9, atol=1e-12)


def test_added_points_stand_beside_those_of_the_same_partners():
    sim, before = approaching(("cube", "pyramid"))
    partner, point = unknown(0.05)
    wall = np.array([[0, -1]])
    partner, point = np.concatenate((wall, partner, partner, wall - 1)), np.repeat(point, 4, axis=0)
    (_, of, place), _ = looked_ahead(sim, before, partner, point)
    assert (place == 3).all()
    assert (of == [0, 1]).all()
    beside = np.insert(partner, place, of, axis=0)
    assert beside[:, 1].tolist() == [-1, *[1] * (2 + len(of)), -2]
