"""Two bodies that nearly touch, for tests of what they do next."""

import numpy as np

from particlesim.core.constants import MAX_MANIFOLD
from particlesim.model.touching import contact_now
from particlesim.simulation.simulation import Simulation
from tests.worlds import listed, scene


def nearly_touching(seed, shapes):
    """A simulation of two bodies of size 0.1 all but touching, flying and spinning at random."""
    rng = np.random.default_rng(seed)
    groups = []
    for k, shape in enumerate(shapes):
        pose = {"position": (0.3 * k, 0, 0), "orientation": {"axis": tuple(rng.normal(size=3)), "angle": 180}}
        groups.append({**listed(shape, pose), "size": 0.1})
    sim = Simulation(scene(*groups, size=(4, 4, 4), boundary="open"))
    state, points = sim.state, np.empty((MAX_MANIFOLD, 3))
    way = rng.normal(size=3)
    way /= np.linalg.norm(way)
    state.position[1] = state.position[0] + 0.3 * way
    for _ in range(200):  # advanced conservatively until they nearly touch
        gap, _, _, _ = contact_now(sim.table, sim.world, sim.constants, state, 0, 1, points)
        if gap <= 1e-5:
            break
        state.position[1] -= 0.99 * (gap - 5e-6) * way
    assert gap <= 1e-5
    state.velocity[:] = rng.normal(scale=0.5, size=(2, 3))
    state.angular_momentum[:] = rng.normal(scale=10.0, size=(2, 3)) * sim.constants.inertia.mean(axis=1)[:, None]
    return sim
