"""Sleep: what has lain still for a while is held where it is, until the forces on it no longer balance.

Each particle sleeps by itself, for in most heaps something rolls or spins for ever. To those that are awake it is an
obstacle. The forces that it fell asleep with are kept, those of its neighbours that are awake are found anew in every
step, and once all of them and its weight come to more than a small part of what friction can hold, it wakes: because
something strikes it, leans on it or no longer does, was taken away from below it, or pulls it elsewhere.
"""

from __future__ import annotations

import math

import numpy as np

from particlesim.core.constants import DISSIPATION, WALL_NAMES
from particlesim.core.jit import entry_kernel, kernel, without_refcounts
from particlesim.core.math3d import add, cross, dot, norm, scale, sub
from particlesim.core.math3d import to_vec3 as vec
from particlesim.dynamics.contact.booking import NOTHING_BORNE, Borne
from particlesim.dynamics.settings import (
    APPROACH_TOLERANCE,
    SLEEP_BALANCE,
    SLEEP_LEAST_BALANCE,
    SLEEP_SPEED,
    SLEEP_TIME,
    SLEEP_WAY,
)
from particlesim.dynamics.solver_state import SolverState
from particlesim.model.bodies import KINEMATIC, angular_velocities, angular_velocity
from particlesim.model.domain import nearest_image
from particlesim.model.system import System

# Rows of what forces come to: on each wall, and on other obstacles; then the virial.
_OTHERS, _VIRIAL, _ROWS = len(WALL_NAMES), len(WALL_NAMES) + 1, len(WALL_NAMES) + 2


# ---- which -----------------------------------------------------------------------------------------------------------


def held_bodies(system: System, asleep: np.ndarray) -> np.ndarray:
    """Whether bodies stay where they are, (n,) bool: particles that sleep, and obstacles that do not move now."""
    obstacle = system.body[system.particles :]
    moves = obstacle["kind"] == KINEMATIC
    if moves.any():
        piece = system.motion[obstacle["motion"]]
        swings = (piece["angular_frequency"] != 0.0) & (piece["amplitude"].any(axis=1) | piece["across"].any(axis=1))
        goes = obstacle["velocity"].any(axis=1) | obstacle["angular_momentum"].any(axis=1)
        moves &= goes | swings | piece["surface_velocity"].any(axis=1)
    return np.concatenate([asleep, ~moves])


@kernel
def _add_wrench(total, force, torque, hold):
    """Add a force [N], a torque [N m] and what friction can hold [N] to a row of totals (n, 7)."""
    for axis in range(3):
        total[axis] += force[axis]
        total[3 + axis] += torque[axis]
    total[6] += hold


@kernel
def _stirs(system, i, speed):
    """Whether the surface of a particle moves faster than ``speed`` times that of a fall by its inscribed radius."""
    b = system.body[i]
    turning = angular_velocity(b)
    fastest = norm(vec(b.velocity)) + norm(turning) * b.radius
    return fastest > speed * math.sqrt(2.0 * norm(vec(system.domain[0].gravity)) * b.inradius)


@entry_kernel
def unbalanced(system, forces, held, chosen, limits):
    """Those of particles ``chosen`` (n,) that weight and ``forces`` (k,) FORCE do not leave where they are, (n,) bool.

    ``limits`` are the part of what friction can hold up to which they do, and how fast particles that are not held may
    be that touch them (see ``_stirs``). No obstacle may that is not held.
    """
    system, forces, held, chosen = without_refcounts((system, forces, held, chosen))
    bodies, gravity, period = len(system.body), vec(system.domain[0].gravity), system.domain[0].period
    total, found = np.zeros((system.particles, 7)), np.zeros(system.particles, dtype=np.bool_)
    share, speed = limits
    for k in range(len(forces)):
        i, j = forces[k].contact // bodies, forces[k].contact % bodies
        of_i, of_j = chosen[i], j < system.particles and chosen[j]
        if not (of_i or of_j):
            continue
        a, b = system.body[i], system.body[j]
        force, torque, arm = vec(forces[k].force), vec(forces[k].torque), vec(forces[k].arm)
        hold = min(system.law[a.material, b.material].friction, 1.0) * norm(force)
        if of_i:
            _add_wrench(total[i], scale(force, -1.0), scale(add(cross(arm, force), torque), -1.0), hold)
            found[i] |= not held[j] and (j >= system.particles or _stirs(system, j, speed))
        if of_j:
            arm_b = sub(arm, nearest_image(sub(vec(b.position), vec(a.position)), period))
            _add_wrench(total[j], force, add(cross(arm_b, force), torque), hold)
            found[j] |= not held[i] and _stirs(system, i, speed)
    for i in range(system.particles):
        if chosen[i]:
            b, row = system.body[i], total[i]
            weight = scale(gravity, b.mass)
            most = max(share * row[6], SLEEP_LEAST_BALANCE * norm(weight))
            force, torque = add((row[0], row[1], row[2]), weight), (row[3], row[4], row[5])
            found[i] |= norm(force) > most or norm(torque) > most * b.radius
            # Without friction what slides, however slowly, goes on.
            found[i] |= row[6] == 0.0 and _stirs(system, i, APPROACH_TOLERANCE)
    return found


def disturbed(system: System, state: SolverState) -> np.ndarray:
    """Sleepers that move, or are not where they were, (n,) bool."""
    body, seen, count = system.body[: system.particles], state.seen[: system.particles], system.particles
    moved = np.zeros(count, dtype=np.bool_)
    for now, then in ((body["velocity"], 0.0), (body["angular_momentum"], 0.0), (body["position"], seen["position"]),
                      (body["orientation"], seen["orientation"])):  # fmt: skip
        moved |= (now != then).any(axis=1)
    return moved & state.asleep


def wake(state: SolverState, woken: np.ndarray, times: int, bodies: int) -> None:
    """Wake particles ``woken`` (n,), and those so many contacts away; twice as many each of the ``times`` in a step."""
    woken, particles = woken.copy(), len(state.asleep)
    a, b = np.divmod(state.forces["contact"], bodies)
    among = b < particles
    a, b = a[among], b[among]
    for _ in range(2**times // 2):
        reached = woken.copy()
        reached[b[woken[a]]] = reached[a[woken[b]]] = True
        if np.array_equal(reached, woken):
            break
        woken = reached
    woken &= state.asleep
    state.asleep[woken] = False
    state.still["since"][woken] = state.time
    state.still["displacement"][woken] = state.displacement[:particles][woken]


def note_still(system: System, state: SolverState) -> None:
    """Note since when particles have been still, as they are at the start of a step."""
    displacement, still = state.displacement[: system.particles], state.still
    moved = displacement - still["displacement"] > SLEEP_WAY * system.body["inradius"][: system.particles]
    still["since"][moved], still["displacement"][moved] = state.time, displacement[moved]


def fall_asleep(system: System, state: SolverState, members: np.ndarray) -> tuple[np.ndarray, Borne]:
    """Let those of particles ``members`` (k,) sleep that have been still for long; which, (n,), and what that took."""
    particle = system.body[: system.particles]
    gravity = float(np.linalg.norm(system.domain[0]["gravity"]))
    tired = np.zeros(system.particles, dtype=np.bool_)
    still = state.time - state.still["since"][members]
    of_members = particle.take(members)
    lies = (of_members["resting"] != 0) & state.lasting[members].astype(np.bool_)
    tired[members] = lies & (gravity * still**2 >= SLEEP_TIME**2 * of_members["radius"])
    if not tired.any():
        return tired, NOTHING_BORNE
    tired &= ~unbalanced(system, state.forces, held_bodies(system, state.asleep), tired, (SLEEP_BALANCE, SLEEP_SPEED))
    bodies = particle[tired]
    spin = angular_velocities(bodies, len(bodies))
    momentum = bodies["mass"] @ bodies["velocity"]
    lost = np.zeros(len(DISSIPATION))
    lost[DISSIPATION.index("rest")] = 0.5 * (
        (bodies["mass"] * (bodies["velocity"] ** 2).sum(axis=1)).sum() + (bodies["angular_momentum"] * spin).sum()
    )
    state.asleep |= tired
    particle["velocity"][tired] = particle["angular_momentum"][tired] = 0.0
    total = _borne_forces(system, state.forces, state.asleep)
    return tired, _on_walls(_by_main_wall(total, momentum), 0.0)._replace(lost=lost)


# ---- what sleepers bear ----------------------------------------------------------------------------------------------


@entry_kernel
def _borne_forces(system, forces, asleep):
    """What the ``forces`` (k,) FORCE that sleepers are held by come to, (rows, 4): vectors [N], the virial [J].

    The last column is the sum of all forces on each wall, whatever is held [N].
    """
    system, forces, asleep = without_refcounts((system, forces, asleep))
    bodies, period = len(system.body), system.domain[0].period
    total = np.zeros((_ROWS, 4))
    for k in range(len(forces)):
        i, j, force = forces[k].contact // bodies, forces[k].contact % bodies, vec(forces[k].force)
        if j >= system.particles:
            row = system.body[j].wall if system.body[j].wall >= 0 else _OTHERS
            total[row, 3] += norm(force)
            for axis in range(3):
                total[row, axis] += force[axis] if asleep[i] else 0.0
        elif asleep[i] and asleep[j]:
            offset = nearest_image(sub(vec(system.body[j].position), vec(system.body[i].position)), period)
            total[_VIRIAL, 0] += dot(offset, force)
    return total


def kept_forces(forces: np.ndarray, held: np.ndarray) -> np.ndarray:
    """Those of ``forces`` (k,) FORCE that act between bodies that are held."""
    a, b = np.divmod(forces["contact"], len(held))
    return forces.compress(held[a] & held[b])


def borne_asleep(system: System, state: SolverState, pushed: np.ndarray, duration: float) -> Borne:
    """What sleepers hand on in a step [s], given an impulse ``pushed`` (3,) in all by others [N s]."""
    if not state.asleep.any():
        return NOTHING_BORNE
    total = _borne_forces(system, state.forces, state.asleep) * duration
    weight = system.body["mass"][: system.particles][state.asleep].sum() * system.domain[0]["gravity"]
    left = weight * duration + pushed - total[: _OTHERS + 1, :3].sum(axis=0)
    return _on_walls(total[:_OTHERS, :3] + _by_main_wall(total, left), float(total[_VIRIAL, 0]))


def _by_main_wall(total: np.ndarray, impulse: np.ndarray) -> np.ndarray:
    """The impulses (6, 3) on walls of which the one that bears most, if any does, gets all."""
    walls = np.zeros((_OTHERS, 3))
    if total[:_OTHERS, 3].any():
        walls[np.argmax(total[:_OTHERS, 3])] = impulse
    return walls


def _on_walls(impulse: np.ndarray, virial: float) -> Borne:
    """What walls bear by impulses (6, 3) [N s]."""
    outward = np.repeat(np.eye(3), 2, axis=0) * np.tile([-1.0, 1.0], 3)[:, None]
    along = (impulse * outward).sum(axis=1)
    return NOTHING_BORNE._replace(wall_impulse=along, wall_shear=impulse - along[:, None] * outward, virial=virial)
