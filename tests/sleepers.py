"""What sleeps in a simulation, and what becomes of it as an obstacle sets off beneath it."""

import numpy as np
import pytest

G = 9.81


def asleep(sim):
    """Which particles sleep, (n,)."""
    return sim._solver.state.asleep


def check_taken_along(sim, speed):
    """All that sleeps now on what sets off upwards at ``speed`` [m/s] goes as fast, and it works m g v."""
    assert asleep(sim).all()
    before, count = sim.particles.position.copy(), len(sim.particles.position)
    sim.run(duration=0.1)
    assert not asleep(sim).any()
    work = sim.ledger.work
    sim.run(duration=1.0)
    assert sim.particles.position - before == pytest.approx(np.tile([0, 0, 1.1 * speed], (count, 1)), abs=2e-3)
    assert sim.particles.velocity == pytest.approx(np.tile([0, 0, speed], (count, 1)), abs=1e-6)
    assert sim.ledger.work - work == pytest.approx(sim.particles.mass.sum() * G * speed, rel=1e-6)
