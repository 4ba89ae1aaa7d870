"""Two bodies that nearly touch, for tests of what they do next."""

import numpy as np

from particlesim.core.constants import MAX_MANIFOLD
from particlesim.dynamics.contact.contact import CONTACT, find_contact
from particlesim.model.overlap import separation_of
from particlesim.simulation.simulation import Simulation
from tests.kernels import callable_from_python
from tests.worlds import listed, scene

_find_contact = callable_from_python(find_contact)


def nearly_touching(seed, shapes):
    """A simulation of two bodies of size 0.1 all but touching, flying and spinning at random."""
    rng = np.random.default_rng(seed)
    groups = []
    for k, shape in enumerate(shapes):
        pose = {"position": (0.3 * k, 0, 0), "orientation": {"axis": tuple(rng.normal(size=3)), "angle": 180}}
        groups.append({**listed(shape, pose), "size": 0.1})
    sim = Simulation(scene(*groups, size=(4, 4, 4), boundary="open"))
    body, direction = sim.model.particles, rng.normal(size=3)
    direction /= np.linalg.norm(direction)
    body["position"][1] = body["position"][0] + 0.3 * direction
    for _ in range(200):  # advanced conservatively until they nearly touch
        gap = separation_of(sim.model.system, 0, 1)
        if gap <= 1e-5:
            break
        body["position"][1] -= 0.99 * (gap - 5e-6) * direction
    assert gap <= 1e-5
    body["velocity"] = rng.normal(scale=0.5, size=(2, 3))
    body["angular_momentum"] = rng.normal(scale=10.0, size=(2, 3)) * body["principal_inertia"].mean(axis=1)[:, None]
    return sim


def contact_of(system, body):
    """The contact of two bodies as records have them: (separation, CONTACT, its points)."""
    contact, points = np.zeros(1, dtype=CONTACT), np.empty((MAX_MANIFOLD, 3))
    separation = _find_contact(system, body[0], body[1], contact[0], points)
    return separation, contact[0], points[: contact["count"][0]]
