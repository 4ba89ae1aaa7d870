"""Islands of lasting contacts: bodies that touch each other, and their points in an order that nothing else decides.

What happens in one island does not touch the others. Obstacles join nothing.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from particlesim.core.constants import DISSIPATION
from particlesim.core.jit import entry_kernel, kernel, without_refcounts
from particlesim.core.math3d import dot, scale, set_vec3, sub
from particlesim.core.math3d import to_vec3 as vec
from particlesim.dynamics.contact.contact_records import along_normal
from particlesim.dynamics.contact.island_step import Islands
from particlesim.dynamics.solver_state import FORCE


@kernel
def _root(root, i):
    """The smallest member of an island; on the way each is led there more directly."""
    while root[i] != i:
        root[i] = root[root[i]]
        i = root[i]
    return i


@entry_kernel
def _roots(points, asleep):
    """The smallest member of the island of each particle, (n,); what sleeps joins nothing."""
    points, asleep = without_refcounts((points, asleep))
    particles = len(asleep)
    root = np.arange(particles)
    for k in range(len(points)):
        if points[k].b < particles and not asleep[points[k].b]:
            a, b = _root(root, points[k].a), _root(root, points[k].b)
            root[max(a, b)] = min(a, b)
    for i in range(particles):
        root[i] = _root(root, i)
    return root


def joined(parts: Sequence[np.ndarray]) -> np.ndarray:
    """Arrays (m,) of the same records, one after the other.

    They are copied as bytes, in a tenth of the time that NumPy takes field by field.
    """
    dtype = parts[0].dtype
    return np.concatenate([part.view((np.void, dtype.itemsize)) for part in parts]).view(dtype)


def gathered(points: np.ndarray, terms: np.ndarray, seeds: np.ndarray, asleep: np.ndarray) -> Islands:
    """The islands of contact points (m,) that have a seed among their members or touch what sleeps, in order.

    That is the order of their smallest members.

    Parameters
    ----------
    points, terms : (m,) CONTACT_POINT, CONTACT_TERMS
        In any order but that the points of a pair of bodies have theirs.
    seeds : (k,) int
        Particles.
    asleep : (n,) bool
        Whether a particle sleeps: it is an obstacle then.
    """
    particles = len(asleep)
    root = _roots(points, asleep)
    other = points["b"][points["b"] < particles]
    seeded, touched = np.zeros((2, particles), dtype=np.bool_)
    seeded[root[seeds]] = True
    seeded[root[points["a"][points["b"] < particles][asleep[other]]]] = True
    of_point = root[points["a"]]
    # One number each, to sort which takes a twentieth of the time that three keys do; the pairs nearly are in order.
    bodies = int(points["b"].max(initial=0)) + 1
    order = np.argsort((of_point * particles + points["a"]) * bodies + points["b"], kind="stable")
    order = order[seeded[of_point[order]]]
    # Whole records are copied, where indices in brackets would do it field by field.
    points, terms, of_point = points.take(order), terms.take(order), of_point[order]
    touched[points["a"]] = True
    touched[points["b"][points["b"] < particles]] = True
    touched &= ~asleep
    member = np.flatnonzero(touched)
    member = member[np.argsort(root[member], kind="stable")]
    starts = np.flatnonzero(np.diff(of_point, prepend=-1))
    first_member = np.searchsorted(root[member], of_point[starts])
    first_point, lost = np.append(starts, len(points)), np.zeros((len(starts), len(DISSIPATION)))
    return Islands(
        first_point, points, terms, np.append(first_member, len(member)), member, lost, np.zeros(len(starts))
    )


@entry_kernel
def _hand_down(points, terms, first, last, memory):
    """See ``warm_start``; the contact of force ``k`` now has the points ``first[k] .. last[k]``."""
    points, terms, memory = without_refcounts((points, terms, memory))
    for k in range(len(memory)):
        nearest, least = -1, np.inf
        for m in range(first[k], last[k]):
            arm = vec(points[m].arm_a) if points[m].a < points[m].b else vec(points[m].arm_b)
            shift = sub(arm, vec(memory[k].arm))
            if dot(shift, shift) < least:
                nearest, least = m, dot(shift, shift)
        if nearest >= 0:
            sign = 1.0 if points[nearest].a < points[nearest].b else -1.0
            for axis in range(3):
                terms[nearest].force[axis] += sign * memory[k].force[axis]
                terms[nearest].torque[axis] += sign * memory[k].torque[axis]


def _contact_of(points: np.ndarray, bodies: int) -> np.ndarray:
    """A number for the pair of bodies at each contact point, whichever is the first."""
    a, b = points["a"].astype(np.int64), points["b"].astype(np.int64)
    return np.minimum(a, b) * bodies + np.maximum(a, b)


def warm_start(islands: Islands, forces: np.ndarray, bodies: int) -> None:
    """Give contact points the ``forces`` (k,) FORCE of the step before, each to the nearest of the same contact.

    The corners of a patch come in any order, and may be fewer or more than before; no force is lost.
    """
    contact = _contact_of(islands.points, bodies)
    order = np.argsort(contact, kind="stable")
    known, by_contact = forces["contact"], contact[order]
    first, last = np.searchsorted(by_contact, known), np.searchsorted(by_contact, known, side="right")
    # The points of a contact stand in a row.
    begin = order[np.minimum(first, len(order) - 1)] if len(order) else first
    _hand_down(islands.points, islands.terms, begin, begin + (last - first), forces)


def forces_of(forces: np.ndarray, origin: np.ndarray, before: int, now: int) -> np.ndarray:
    """The ``forces`` (k,) FORCE of contacts whose bodies are still there, where particles come and go.

    Parameters
    ----------
    origin : (n,) int
        Which of the particles before each of them was, -1 for new ones.
    before, now : int
        How many bodies there were, and are. Obstacles stay.
    """
    obstacles = now - len(origin)
    place = np.full(before, -1)
    place[origin[origin >= 0]] = np.flatnonzero(origin >= 0)
    place[before - obstacles :] = np.arange(len(origin), now)
    a, b = place[forces["contact"] // before], place[forces["contact"] % before]
    stays = (a >= 0) & (a < b)
    kept = forces[stays]
    kept["contact"] = (a * now + b)[stays]
    return kept


@entry_kernel
def borne_impulses(system, points, terms):
    """What impulses at contact points (m,) come to: on each wall (6,), along it (6, 3) [N s], and the virial [J s]."""
    system, points, terms = without_refcounts((system, points, terms))
    outward, shear, virial = np.zeros(6), np.zeros((6, 3)), 0.0
    for k in range(len(points)):
        p, impulse = points[k], vec(terms[k].impulse)
        wall = system.body[p.b].wall
        if p.b < system.particles:
            virial += dot(sub(vec(p.arm_a), vec(p.arm_b)), impulse)
        elif wall >= 0:
            along, across = along_normal(p, impulse)
            outward[wall] += along
            for axis in range(3):
                shear[wall, axis] += across[axis]
    return outward, shear, virial


@entry_kernel
def _forces(points, terms, contact, duration):
    """The forces that act at the points (m,) of contacts, as FORCE: in the end, or means of a ``duration`` [s] > 0."""
    points, terms = without_refcounts((points, terms))
    forces, size = np.empty(len(points), dtype=FORCE), 0
    for k in range(len(points)):
        p, t = points[k], terms[k]
        force, torque, arm = vec(t.force), vec(t.torque), vec(p.arm_a)
        if duration > 0.0:
            force, torque = scale(vec(t.impulse), 1.0 / duration), scale(vec(t.angular_impulse), 1.0 / duration)
        if p.a > p.b:
            force, torque, arm = scale(force, -1.0), scale(torque, -1.0), vec(p.arm_b)
        if dot(force, force) > 0.0:
            f = forces[size]
            f.contact = contact[k]
            set_vec3(f.arm, arm)
            set_vec3(f.force, force)
            set_vec3(f.torque, torque)
            size += 1
    return forces[:size]


def forces_after(islands: Islands, bodies: int) -> np.ndarray:
    """The forces of contact points for the step after, (m,) FORCE: those that there are."""
    return _forces(islands.points, islands.terms, _contact_of(islands.points, bodies), 0.0)


def mean_forces(islands: Islands, bodies: int, duration: float) -> np.ndarray:
    """The forces of contact points in the step, which took ``duration`` [s], (m,) FORCE: those that there were."""
    return _forces(islands.points, islands.terms, _contact_of(islands.points, bodies), duration)
