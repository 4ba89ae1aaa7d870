"""What cannot be, looked for once a recorded frame: numbers that are not finite, particles behind walls, energy from
nowhere; and speeds at which the next frame would never come. Each is said with the particle, the time, and the key of
the scene that most likely leads to it.
"""

from __future__ import annotations

import numpy as np

from particlesim.core.constants import WALL, WALL_NAMES
from particlesim.model.system import Model
from particlesim.scene import Scene
from particlesim.trajectory.frames import Ledger

# The energy may grow by this fraction of all that there was to draw on, and by this much of what goes to and fro
# between motion and gravity [1]. Drift is a thousandth at the very most: what is beyond only grows from there on.
_RUNAWAY, _ROUNDING = 0.5, 1e-6


class SimulationError(RuntimeError):
    """The state has become impossible; one line with a particle, the time and what most likely leads to it."""


def check_particles(scene: Scene, model: Model, time: float) -> None:
    """SimulationError if a number of a particle is not finite, or its centroid is behind a wall."""
    b, domain = model.particles, model.system.domain[0]
    for name in ("position", "orientation", "velocity", "angular_momentum"):
        bad = np.flatnonzero(~np.isfinite(b[name]).all(axis=1))
        if len(bad):
            raise _error(scene, b[bad[0]], f"{name} of {{}} is not finite", time)
    # Beside walls; bodies that overlap them by rounding are far from it.
    beyond = np.stack([domain["lower"] - b["position"], b["position"] - domain["upper"]], axis=2)
    beyond[:, domain["boundary"] != WALL] = -1.0
    out = np.argwhere(beyond > 0.0)
    if len(out):
        i, axis, side = out[0]
        wall = WALL_NAMES[2 * axis + side]
        raise _error(scene, b[i], f"{{}} is {beyond[i, axis, side]:.3g} m behind the {wall} wall", time)


def check_energy(scene: Scene, model: Model, first: Ledger, now: Ledger) -> None:
    """SimulationError if there is far more energy than there was at first, than fell, was worked or came since."""
    came = 0.0 if now.flow_energy is None else float(now.flow_energy[0])
    drawn_on = abs(first.energy) + abs(now.work or 0.0) + came + max(-now.potential, 0.0)
    gain = now.own_energy - first.own_energy
    if gain > _RUNAWAY * drawn_on + _ROUNDING * (now.kinetic + abs(now.potential)):
        b = model.particles
        fastest = b[np.argmax(b["mass"] * (b["velocity"] ** 2).sum(axis=1))]
        wrong = f"the energy has grown by {gain:.3g} J, where there were {drawn_on:.3g} J, most of it in {{}},"
        raise _error(scene, fastest, wrong, now.time)


def too_fast(scene: Scene, model: Model, time: float) -> SimulationError:
    """The error of particles that are so fast that time steps, in which they move a little, come to no end."""
    b = model.particles
    speed = np.linalg.norm(b["velocity"], axis=1)
    fastest = int(np.argmax(speed))
    wrong = f"{{}} goes at {speed[fastest]:.3g} m/s, and time steps come to no end,"
    return _error(scene, b[fastest], wrong, time)


def _error(scene: Scene, body: np.void, wrong: str, time: float) -> SimulationError:
    g = int(body["group"])
    whose = f"particle {body['id']} ({scene.key(g)} of the scene)"
    return SimulationError(f"{wrong.format(whose)} at {time:g} s; most likely for {_likely(scene, g)}")


def _likely(scene: Scene, g: int) -> str:
    """The key of a scene that most likely leads to what cannot be."""
    for k, obstacle in enumerate(scene.obstacles):
        if obstacle.motion is not None:
            return f"obstacles[{k}].motion"
    if scene.fields:
        return "fields[0]" if len(scene.fields) == 1 else "fields"
    return "solver.time_step" if scene.solver.time_step != "auto" else scene.key(g)
