"""What lies stays as it lies while other particles come and go."""

import numpy as np

import particlesim as ps
from particlesim.dynamics.contact.lasting_islands import forces_of
from particlesim.dynamics.solver_state import FORCE
from tests.worlds import listed, scene

STACK = [{"position": (0, 0, -3.5 + k)} for k in range(6)]
ABOVE = {"lower": [2, 2, 2], "upper": [3, 3, 3]}
BELOW = {"lower": [-4, -4, -4], "upper": [-1, -1, 0]}


def test_forces_stay_with_the_particles_that_stay():
    """Of bodies 0 to 3, and the obstacles 4 and 5, the particles 0 and 2 stay, and a new one comes before the last."""
    forces = np.zeros(6, dtype=FORCE)
    pairs = [(0, 2), (0, 1), (2, 4), (2, 5), (3, 4), (1, 3)]
    forces["contact"], forces["force"][:, 0] = [a * 6 + b for a, b in pairs], np.arange(6)
    kept = forces_of(forces, np.array([0, -1, 2]), 6, 5)
    assert kept["contact"].tolist() == [0 * 5 + 2, 2 * 5 + 3, 2 * 5 + 4]
    assert kept["force"][:, 0].tolist() == [0, 2, 3]


def test_a_stack_stands_while_particles_come_and_go():
    """A column whose forces were forgotten with each that comes would begin to settle anew each time."""
    emitter = {"shape": "sphere", "size": 0.2, "count": 40, "rate": 40.0, "region": ABOVE, "velocity": [0, 0, -1]}
    what = scene(
        listed("cube", *STACK),
        size=(8, 8, 8),
        gravity=(0, 0, -9.81),
        restitution=0.0,
        friction=0.5,
        emitters=[emitter],
        sinks=[{"region": BELOW}],
    )
    sim = ps.Simulation(what)
    sim.run(duration=0.2)
    before = sim.particles.position[:6].copy()
    sim.run(duration=1.0)
    assert len(sim.particles.mass) > 30
    assert np.abs(sim.particles.position[:6] - before).max() < 1e-9
    solver = sim._solver
    held = solver.state
    solver.change_particles(sim.model.particles.copy(), np.arange(len(sim.particles.mass)))
    assert np.array_equal(solver.state.forces, held.forces)
    assert np.array_equal(solver.state.lasting, held.lasting)
    assert held.lasting[:6].all()
