"""One step of an island: bodies in lasting contact move on together, by Moreau's time stepping.

The step is taken in a few substeps in which contacts and their levers stay as they are and gaps change linearly. In
each, gravity acts, and impulses leave no gap closing by more than there is of it (gaps as in M. Anitescu, F. A. Potra,
Nonlinear Dynamics 14 (1997) 231-247). Points that met fast then part as their restitution says.

Displacements are those of the mean of old and new velocities, as far as that closes no gap, so that what slides under a
constant force is where it should be; what was struck has moved at its new velocity.

Energy never rises: the new motion differs from the free one, which keeps it, by what the impulses did, and should these
gain any, all of them are made smaller until they do not.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.core.constants import DISSIPATION
from particlesim.core.jit import entry_kernel, kernel, without_refcounts
from particlesim.core.math3d import (
    add,
    axpy,
    dot,
    norm,
    scale,
    set_quat,
    set_vec3,
    sub,
    to_quat,
)
from particlesim.core.math3d import to_vec3 as vec
from particlesim.dynamics.contact.cone_solver import Sweeps, briefly, give, give_turn, relative_velocity, solve
from particlesim.dynamics.contact.conjugate_ways import new_ways
from particlesim.dynamics.contact.contact_records import along_normal
from particlesim.dynamics.contact.island_energy import (
    add_affordable,
    affordable,
    free_state,
    gain_ahead,
    pay,
    place_ahead,
    rounding_of_energy,
    sum_of_work,
    write_state,
)
from particlesim.dynamics.contact.law import rest_speed
from particlesim.dynamics.contact.movers import (
    begin_means,
    book,
    change_of,
    closing,
    end_means,
    gap_now,
    seek,
    take_back,
    write_mover,
)
from particlesim.dynamics.contact.position_correction import correct_positions
from particlesim.dynamics.settings import (
    CONJUGATE_SWEEPS,
    FEW_SWEEPS,
    GAP_ROUNDING,
    LARGE_SUBSTEPS,
    MAX_SWEEPS,
    MEAN_VELOCITY_ROUNDS,
    NEAR_SWEEP_CONVERGED,
    RESTING_SUBSTEPS,
    SWEEP_CONVERGED,
    SWEEP_VISITS,
)
from particlesim.model.domain import nearest_image

_STILL = (0.0, 0.0, 0.0)
FRICTION, ROLLING, REST = (DISSIPATION.index(cause) for cause in ("friction", "rolling", "rest"))


class Islands(NamedTuple):
    """Contact points and bodies of islands: those of island k are ``point[first_point[k]:first_point[k + 1]]``."""

    first_point: np.ndarray  # (k + 1,) int64
    points: np.ndarray  # (m,) CONTACT_POINT
    terms: np.ndarray  # (m,) CONTACT_TERMS
    first_member: np.ndarray  # (k + 1,) int64
    member: np.ndarray  # (n,) int64, particles
    lost: np.ndarray  # (k, 4) energy that the islands lose in the step, by the causes in DISSIPATION [J]
    work: np.ndarray  # (k,) and that obstacles give them [J]


# ---- substeps ------------------------------------------------------------------------------------------------------


@kernel
def _begin(system, islands, mover, span, members, interval):
    """Write the members as the sweeps see them; let contact points have the impulses of a part as in the step before.

    ``interval`` (time, duration): until fields have acted for as long as they have been let to, and of a part [s].
    """
    gravity, (time, duration) = vec(system.domain[0].gravity), interval
    for m in range(len(members)):
        member = mover[members[m]]
        write_mover(member, system.body[members[m]], m)
        take_back(member, scale(sub(vec(member.pull), gravity), time))
    for k in range(span[0], span[1]):
        p, t = islands.points[k], islands.terms[k]
        t.approach = dot(vec(p.normal), relative_velocity(p, mover[p.a], mover[p.b]))
        t.threshold = rest_speed(norm(vec(mover[p.a].pull)), t.inradius)
        along, across = along_normal(p, vec(t.force))
        p.push = max(along, 0.0) * duration
        set_vec3(p.drag, scale(across, duration if p.static_friction > 0.0 and p.push > 0.0 else 0.0))
        set_vec3(t.roll, scale(vec(t.torque), duration if t.rolling_friction > 0.0 else 0.0))


@kernel
def _substep(system, islands, mover, span, members, interval, sweeps, ways):
    """Take an island through the substep of an interval (time, duration); returns the last change of a velocity."""
    points, terms = islands.points, islands.terms
    time, duration = interval
    parts = False
    begin_means(mover, members)
    for i in members:
        set_vec3(mover[i].velocity, axpy(vec(mover[i].velocity), vec(mover[i].pull), duration))
    for k in range(span[0], span[1]):
        p, t = points[k], terms[k]
        a, b = mover[p.a], mover[p.b]
        gap, bent = gap_now(system, p, t, a, b, time)
        # It bends as the square of the time: so much more than until now in this substep.
        bends = -bent * (2.0 * time / duration + 1.0) * duration * duration / (time * time) if bent < 0.0 else 0.0
        room = gap - bends
        t.parting = min(max(-room, 0.0), bends) / duration
        # Sweeps of a large heap are too few for impulses to grow in (see below): what is to part does so at once.
        at_once = 0.0 if sweeps.together else t.parting
        seek(system, p, mover, at_once - max(room - t.slack, 0.0) / duration, time, duration)
        parts = parts or (sweeps.together and t.parting > 0.0)
        give(p, a, b, axpy(vec(p.drag), vec(p.normal), p.push))
        if t.rolling_friction > 0.0:
            give_turn(a, b, vec(t.roll))
    left = solve(points, terms, mover, span, members, sweeps, ways)
    if parts:
        for k in range(span[0], span[1]):
            set_vec3(points[k].wanted, axpy(vec(points[k].wanted), vec(points[k].normal), terms[k].parting))
        # They may have no room to: impulses would grow for as long as they are looked for.
        solve(points, terms, mover, span, members, briefly(sweeps), ways)
    for i in members:
        m = mover[i]
        set_vec3(m.shift, axpy(vec(m.shift), vec(m.velocity), duration))
        set_vec3(m.turn, axpy(vec(m.turn), vec(m.spin), duration))
    end_means(mover, members)
    for k in range(span[0], span[1]):
        p, t = points[k], terms[k]
        impulse = axpy(vec(p.drag), vec(p.normal), p.push)
        t.pushed += p.push
        set_vec3(t.impulse, add(vec(t.impulse), impulse))
        set_vec3(t.angular_impulse, add(vec(t.angular_impulse), vec(t.roll)))
        book(system, mover, p, t, impulse, vec(t.roll), interval)
    return left


@kernel
def _remember(islands, span, duration):
    """Keep the forces at the end of the step for the next."""
    for k in range(span[0], span[1]):
        p, t = islands.points[k], islands.terms[k]
        set_vec3(t.force, scale(axpy(vec(p.drag), vec(p.normal), p.push), 1.0 / duration))
        set_vec3(t.torque, scale(vec(t.roll), 1.0 / duration))


@kernel
def _rebound(system, islands, mover, span, members, time, sweeps, ways):
    """Let points that met fast part as their restitution says; returns whether there are any."""
    anything = False
    begin_means(mover, members)
    for k in range(span[0], span[1]):
        p, t = islands.points[k], islands.terms[k]
        if t.pushed > 0.0 and t.approach < -t.threshold and t.restitution > 0.0:
            seek(system, p, mover, -t.restitution * t.approach, time, 0.0)
            anything = True
    if anything:
        solve(islands.points, islands.terms, mover, span, members, briefly(sweeps), ways)
        end_means(mover, members)
    return anything


@kernel
def _add_rebound(system, islands, mover, span, interval, share):
    """Add a share of the impulses since ``_remember``; ``interval``: how long the step and its parts last [s]."""
    time, duration = interval
    for k in range(span[0], span[1]):
        p, t = islands.points[k], islands.terms[k]
        impulse = scale(axpy(axpy(vec(p.drag), vec(p.normal), p.push), vec(t.force), -duration), share)
        turning = scale(axpy(vec(t.roll), vec(t.torque), -duration), share)
        set_vec3(t.impulse, add(vec(t.impulse), impulse))
        set_vec3(t.angular_impulse, add(vec(t.angular_impulse), turning))
        book(system, mover, p, t, impulse, turning, (time, 0.0))


# ---- displacements -------------------------------------------------------------------------------------------------


@kernel
def _mean_velocities(system, islands, mover, span, members, time, duration):
    """Take half of what became faster in the step, for a substep, back from displacements, where that closes no gap.

    Sums of new velocities of substeps become sums of the means of old and new ones.
    """
    struck = np.zeros(len(members), dtype=np.bool_)
    for _ in range(MEAN_VELOCITY_ROUNDS):
        more = False
        for k in range(span[0], span[1]):
            p, t = islands.points[k], islands.terms[k]
            a, b = mover[p.a], mover[p.b]
            fixed_a, fixed_b = struck[a.row], b.row < 0 or struck[b.row]
            if fixed_a and fixed_b:
                continue
            of_a = (_STILL, _STILL) if fixed_a else change_of(a)
            of_b = (_STILL, _STILL) if fixed_b else change_of(b)
            gap, _ = gap_now(system, p, t, a, b, time)
            if gap - 0.5 * duration * closing(p, of_a, of_b) < min(gap, 0.0) - GAP_ROUNDING * t.inradius:
                struck[a.row] = more = True
                if b.row >= 0:
                    struck[b.row] = True
        if not more:
            break
    else:
        struck[:] = True
    for k in range(len(members)):
        m = mover[members[k]]
        if not struck[k]:
            faster, turning = change_of(m)
            set_vec3(m.shift, axpy(vec(m.shift), faster, -0.5 * duration))
            set_vec3(m.turn, axpy(vec(m.turn), turning, -0.5 * duration))


# ---- a step --------------------------------------------------------------------------------------------------------


@kernel
def _scale_impulses(islands, span, share):
    """Let contact points have had a share of their impulses."""
    for k in range(span[0], span[1]):
        t = islands.terms[k]
        set_vec3(t.impulse, scale(vec(t.impulse), share))
        set_vec3(t.angular_impulse, scale(vec(t.angular_impulse), share))
        t.rubbed, t.rolled, t.work = share * t.rubbed, share * t.rolled, share * t.work


@kernel
def _book_island(islands, k, span, gain):
    """Book what an island has lost, that has gained so much [J]: what friction and rolling did not take, rest did."""
    rubbed = rolled = 0.0
    for n in range(span[0], span[1]):
        rubbed += islands.terms[n].rubbed
        rolled += islands.terms[n].rolled
    work, lost = sum_of_work(islands, span), islands.lost[k]
    islands.work[k] = work
    lost[FRICTION], lost[ROLLING], lost[REST] = rubbed, rolled, work - gain - rubbed - rolled


@kernel
def _pairs_of_sweeps(span):
    """How many pairs of sweeps over the points of a span there is time for in a part of the step."""
    return SWEEP_VISITS // (2 * RESTING_SUBSTEPS * max(span[1] - span[0], 1))


@kernel
def _limits(islands, mover, span, members, part):
    """How many sweeps the points of a span have in a ``part`` of the step [s], and when they end."""
    fastest, pairs = 0.0, _pairs_of_sweeps(span)
    least, rolls = np.inf, False
    for i in members:
        fastest = max(fastest, norm(vec(mover[i].pull)) * part)
    for k in range(span[0], span[1]):
        fastest = max(fastest, abs(islands.terms[k].approach))
        least = min(least, islands.terms[k].inradius)
        rolls = rolls or islands.terms[k].rolling_friction > 0.0
    if pairs > FEW_SWEEPS:
        return Sweeps(min(pairs, MAX_SWEEPS), SWEEP_CONVERGED * fastest, True, False, rolls)
    small = max(SWEEP_CONVERGED * fastest, NEAR_SWEEP_CONVERGED * least / part)
    return Sweeps(CONJUGATE_SWEEPS, small, False, True, rolls)


@kernel
def _step_island(system, islands, mover, k, interval, ahead):
    """Take island ``k`` through a step; ``interval`` and what is returned are as in ``step_islands``."""
    span = islands.first_point[k], islands.first_point[k + 1]
    members = islands.member[islands.first_member[k] : islands.first_member[k + 1]]
    gravity, (duration, until_fields) = vec(system.domain[0].gravity), interval
    parts = RESTING_SUBSTEPS if _pairs_of_sweeps(span) > FEW_SWEEPS else LARGE_SUBSTEPS
    part = duration / parts
    _begin(system, islands, mover, span, members, (until_fields, part))
    sweeps = _limits(islands, mover, span, members, part)
    ways = new_ways(span[1] - span[0], len(members))
    left = 0.0
    for substep in range(parts):
        left = _substep(system, islands, mover, span, members, (substep * part, part), sweeps, ways)
    _remember(islands, span, part)
    _mean_velocities(system, islands, mover, span, members, duration, part)
    states = np.empty((len(members), 12)), np.empty((len(members), 12)), np.empty((len(members), 12))
    rounding = rounding_of_energy(system, mover, members)
    free_state(system, mover, members, gravity, duration, states[0])
    write_state(islands, mover, span, members, states[1])
    share = affordable(system, members, gravity, duration, states, sum_of_work(islands, span), rounding)
    if share < 1.0:
        _scale_impulses(islands, span, share)
    place_ahead(system, members, gravity, duration, states[2], ahead)
    held = correct_positions(system, islands, mover, span, ahead, len(members))
    work = sum_of_work(islands, span)
    gain = gain_ahead(system, members, gravity, ahead) - work
    if gain > rounding:
        pay(members, ahead, gain)
    write_state(islands, mover, span, members, states[0])
    if _rebound(system, islands, mover, span, members, duration, sweeps, ways):
        _add_rebound(system, islands, mover, span, (duration, part), 1.0)
        write_state(islands, mover, span, members, states[1])
        works = work, sum_of_work(islands, span) - work
        share = add_affordable(system, members, gravity, states[1] - states[0], works, ahead)
        _add_rebound(system, islands, mover, span, (duration, part), share - 1.0)
    _book_island(islands, k, span, gain_ahead(system, members, gravity, ahead))
    return np.inf if held else left


@entry_kernel
def step_islands(system, islands, mover, interval, ahead, first, last):
    """Take islands ``first .. last`` through a step.

    ``interval``: how long it is, and until fields have acted for as long as they have been let to [s]. Writes where
    bodies are in the end, and how they move, into ``ahead`` (n,) BODY, and the impulses. Returns the largest velocity
    that was still changing [m/s], infinity if some bodies were held back.
    """
    system, islands, mover, ahead = without_refcounts((system, islands, mover, ahead))
    left = 0.0
    for k in range(first, last):
        left = max(left, _step_island(system, islands, mover, k, interval, ahead))
    return left


@entry_kernel
def write_obstacles(body, mover, asleep):
    """Write obstacles as the sweeps see them, and particles that sleep (n,): nothing pushes these either."""
    body, mover, asleep = without_refcounts((body, mover, asleep))
    for i in range(len(body)):
        if i >= len(asleep) or asleep[i]:
            write_mover(mover[i], body[i], -1)
            mover[i].inverse_mass = 0.0
            for k in range(6):
                mover[i].inverse_inertia[k] = 0.0


@entry_kernel
def take_over(body, member, ahead):
    """Give particles the velocities and angular momenta that they go on with for the step: they do not fall."""
    body, member, ahead = without_refcounts((body, member, ahead))
    for i in member:
        set_vec3(body[i].velocity, vec(ahead[i].velocity))
        set_vec3(body[i].angular_momentum, vec(ahead[i].angular_momentum))
        body[i].resting = 1


@entry_kernel
def finish(system, member, ahead):
    """Put particles that have not been struck since where they are at the end of the step."""
    system, member, ahead = without_refcounts((system, member, ahead))
    for i in member:
        b, then = system.body[i], ahead[i]
        if b.resting != 0:
            # They may have come back into a periodic domain.
            shift = nearest_image(sub(vec(then.position), vec(b.position)), system.domain[0].period)
            set_vec3(b.position, add(vec(b.position), shift))
            set_quat(b.orientation, to_quat(then.orientation))
