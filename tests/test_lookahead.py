"""What would sink in by the end of a stretch of time is given the contact points that keep it out."""

import numpy as np
import pytest

from particlesim.constants import MAX_MANIFOLD
from particlesim.impacts.contact_points import BEND, COLUMNS, GAP, INRADIUS, LEVER_I, LEVER_J, MASS, NORMAL, parting_at
from particlesim.impacts.lookahead import fly, sunk_points
from particlesim.motion import spins
from particlesim.narrow_phase.contacts import contact_now
from particlesim.state import State
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
    for _ in range(200):
        spin = spins(sim.constants, state)
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


@pytest.mark.parametrize("shapes", [("sphere", "cube"), ("cube", "pyramid"), ("cube", "cube")])
def test_bodies_that_would_sink_in_are_kept_apart_within_a_few_looks(shapes):
    sunk = 0
    for seed in range(60):
        sim = nearly_touching(seed, shapes)
        state, inradius = sim.state, sim.constants.inradius.min()
        before = state.velocity.copy(), spins(sim.constants, state)
        momentum = all_momentum(sim)
        ahead = State(*(array.copy() for array in state))
        partner, point = unknown(inradius)
        where = sim.table, sim.world, sim.constants
        for _ in range(4):
            fly(sim.constants, state, np.zeros((2, 3)), DURATION, ahead)
            spin = spins(sim.constants, state)
            more, of, _ = sunk_points(*where, state, ahead, spin, before, partner, point, DURATION)
            gap, _, _, _ = contact_now(*where, ahead, 0, 1, np.empty((MAX_MANIFOLD, 3)))
            assert (len(more) > 0) == (gap < -1e-4 * inradius)
            if not len(more):
                break
            sunk += 1
            partner, point = np.concatenate((partner, of)), np.concatenate((point, more))
            push(sim, partner[1:], point[1:])
        assert gap >= -1e-4 * inradius
        assert np.allclose(all_momentum(sim), momentum, rtol=0, atol=1e-12)
    assert sunk > 20
