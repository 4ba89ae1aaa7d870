"""The impacts of islands, each island's in the order of time."""

from __future__ import annotations

import heapq
import math

import numpy as np

from particlesim.core.constants import MAX_MANIFOLD
from particlesim.core.jit import entry_kernel, kernel, without_refcounts
from particlesim.core.math3d import dot, grow_records, set_vec3, to_vec3
from particlesim.dynamics.ccd.pair_impact import next_impact
from particlesim.dynamics.contact.booking import WALLS
from particlesim.dynamics.contact.impact import MAX_CONTACTS, NOTHING, STRUCK, new_moment, resolve_contacts
from particlesim.dynamics.contact.sphere_pair import resolve_sphere_pair, strike_alone
from particlesim.dynamics.events.paths import SEGMENT, UNCHAINED, UNDISTURBED, write_segment
from particlesim.dynamics.settings import MAX_SLOW_IMPACTS, SIMULTANEOUS
from particlesim.geometry.narrow_phase.gjk import NO_SIMPLEX
from particlesim.geometry.support import half_space_plane
from particlesim.model.bodies import KINEMATIC, placed
from particlesim.model.free_motion import advance_path, path_of_body, place_on_path, set_pose

# An event is (time, i, j, stamps): when particle i and body j collide, and the sum of their stamps when that was
# predicted.


@kernel
def _stamps(clock, i, j):
    return clock[i].stamp + clock[j].stamp


@kernel
def _is_current(clock, event):
    """Whether neither of its bodies has been deflected since an event was predicted."""
    _, i, j, stamps = event
    return _stamps(clock, i, j) == stamps


@kernel
def _among(indices, size, i):
    """Whether body ``i`` is one of the first ``size``."""
    found = False
    for k in range(size):
        found = found or indices[k] == i
    return found


# ---- prediction ----------------------------------------------------------------------------------------------------


@kernel
def _predict_pair(system, clock, i, j, horizon, queue, points):
    """Put the next impact of two bodies on the queue if it comes in the horizon (soonest, end) from the clock of i."""
    now = max(system.body[i].time, system.body[j].time)
    soonest, end = horizon
    a, b = system.body[min(i, j)], system.body[max(i, j)]
    path_i = advance_path(path_of_body(system, i), to_vec3(system.body[i].principal_inertia), now - system.body[i].time)
    path_j = advance_path(path_of_body(system, j), to_vec3(system.body[j].principal_inertia), now - system.body[j].time)
    paths = (path_i, path_j) if i < j else (path_j, path_i)
    time = next_impact(system, a, b, paths, end - now, NO_SIMPLEX, points)
    if soonest <= time < math.inf:
        heapq.heappush(queue, (now + time, min(i, j), max(i, j), _stamps(clock, i, j)))


@kernel
def _predict(system, clock, neighbours, moment, done, horizon, queue):
    """Put the next impacts of particle ``moment.indices[done]`` with its island and with obstacles on the queue.

    Those with ``moment.indices[:done]`` are there already; impacts sooner than the first of the ``horizon`` are none.
    """
    points = np.empty((MAX_MANIFOLD, 3))
    i = moment.indices[done]
    place = neighbours.place[i]
    for near in range(neighbours.start[place], neighbours.start[place + 1]):
        j = neighbours.body[neighbours.other[near]]
        if j >= system.particles or (clock[j].island == clock[i].island and not _among(moment.indices, done, j)):
            _predict_pair(system, clock, i, j, horizon, queue, points)
    for j in range(system.bounded, len(system.body)):
        _predict_pair(system, clock, i, j, horizon, queue, points)


@kernel
def _begin(predicted, clock, members, queue):
    """Put the impacts on the paths that all members are on at the start on an empty queue."""
    first, pair, time = predicted
    for i in members:
        k = first[i]
        while 0 <= k < len(pair) and pair[k, 0] == i:
            heapq.heappush(queue, (time[k], i, pair[k, 1], _stamps(clock, i, pair[k, 1])))
            k += 1


# ---- the events of one moment --------------------------------------------------------------------------------------


@kernel
def _joins(system, event, moment, size):
    """Whether an event shares a particle with those of the moment; obstacles tie nothing together."""
    i, j = event[1], event[2]
    return _among(moment.indices, size, i) or (j < system.particles and _among(moment.indices, size, j))


@kernel
def _take(event, moment, count, size):
    """Add an event to those of the moment; returns how many bodies these concern."""
    moment.pair[count, 0], moment.pair[count, 1] = event[1], event[2]
    for i in event[1:3]:
        if not _among(moment.indices, size, i):
            moment.indices[size] = i
            size += 1
    return size


@kernel
def _pop_simultaneous(system, clock, queue, within, moment):
    """Take the earliest event off the queue, and those ``within`` [s] of it that hang together with it.

    Returns (time, number of contacts, number of bodies); there are none if nothing is left.
    """
    while len(queue) > 0 and not _is_current(clock, queue[0]):
        heapq.heappop(queue)
    if len(queue) == 0:
        return 0.0, 0, 0
    first = heapq.heappop(queue)
    size = _take(first, moment, 0, 0)
    count = 1
    if len(queue) == 0 or queue[0][0] > first[0] + within:
        return first[0], count, size
    waiting = [first]
    waiting.pop()
    while len(queue) > 0 and queue[0][0] <= first[0] + within:
        event = heapq.heappop(queue)
        if _is_current(clock, event):
            waiting.append(event)
    k = 0
    while k < len(waiting):
        if count < MAX_CONTACTS and _joins(system, waiting[k], moment, size):
            size = _take(waiting.pop(k), moment, count, size)
            count += 1
            k = 0
        else:
            k += 1
    for event in waiting:
        heapq.heappush(queue, event)
    return first[0], count, size


@kernel
def _advance_to(system, i, time):
    """Bring particle ``i`` along its path to ``time``."""
    b = system.body[i]
    since = time - b.time
    b.time, b.disturbed = time, 1
    if since != 0.0:
        position, orientation, velocity = place_on_path(path_of_body(system, i), to_vec3(b.principal_inertia), since)
        set_pose(b, position, orientation, velocity)


@kernel
def _gather_actors(system, moment, count, size, time):
    """Copy the records of the moment's bodies as they are at ``time``, and refer its contacts to them."""
    for k in range(size):
        i = moment.indices[k]
        moment.actor[k] = system.body[i]
        if system.body[i].kind == KINEMATIC:
            b = moment.actor[k]
            set_pose(b, *place_on_path(path_of_body(system, i), to_vec3(b.principal_inertia), time))
    for c in range(count):
        for k in range(size):
            if moment.indices[k] == moment.pair[c, 0]:
                moment.contact[c].a = k
            if moment.indices[k] == moment.pair[c, 1]:
                moment.contact[c].b = k


@kernel
def wake(system, b, left, accumulator):
    """Let gravity act again on a particle that was struck with ``left`` [s] of the substep to go.

    If it rested, it has had its share of gravity for the whole substep. What it weighs is no longer borne by the walls
    that gravity presses against.
    """
    gravity = to_vec3(system.domain[0].gravity)
    if b.resting != 0:
        for k in range(system.bounded, len(system.body)):
            wall = system.body[k]
            if wall.wall >= 0:
                load = -dot(half_space_plane(system.shapes, placed(wall))[0], gravity)
                if load > 0.0:
                    accumulator[WALLS + wall.wall] -= b.mass * load * left
    b.resting = 0


# ---- an island -----------------------------------------------------------------------------------------------------


@kernel
def _open_segments(system, clock, moment, size, time, segments):
    """Bring the particles of the moment to ``time``; those struck for the first time get a segment of how they came.

    ``segments`` are the room for them and how many there are; returns how many there are then.
    """
    segment, used = segments
    for m in range(size):
        i = moment.indices[m]
        if i < system.particles:
            if clock[i].first_segment == UNDISTURBED:
                write_segment(segment[used], system.body[i], i, 0.0)
                used += 1
                clock[i].first_segment = UNCHAINED
            _advance_to(system, i, time)
    return used


@kernel
def _deflect(system, clock, moment, m, time, segment):
    """Take what became of actor ``m`` over into its record, and write the segment that begins with it."""
    i = moment.indices[m]
    b, after = system.body[i], moment.actor[m]
    set_vec3(b.velocity, to_vec3(after.velocity))
    set_vec3(b.angular_momentum, to_vec3(after.angular_momentum))
    clock[i].impacts += moment.struck[m]
    clock[i].stamp += 1
    write_segment(segment, b, i, time)


@kernel
def _freeze(system, clock, members, interval, segments):
    """Let the members stand where they are at a time until the end of an interval (time, end).

    They keep their velocities, but nothing can get into anything else. Returns how many segments there are then.
    """
    segment, used = segments
    time, end = interval
    for i in members:
        b = system.body[i]
        if clock[i].first_segment == UNDISTURBED:
            write_segment(segment[used], b, i, 0.0)
            used += 1
            clock[i].first_segment = UNCHAINED
        _advance_to(system, i, time)
        b.time = end
        s = segment[used]
        write_segment(s, b, i, time)
        s.resting = 1
        for axis in range(3):
            s.velocity[axis] = s.angular_momentum[axis] = 0.0
        used += 1
    return used


@kernel
def _resolve_moment(system, clock, found, moment, budget, interval, accumulator, segments):
    """Resolve the contacts of a moment ``found`` (time, contacts, bodies) and write what becomes of its particles.

    Returns the outcome, whether anything was written, how many segments there are then, and the slow impacts left.
    """
    time, count, size = found
    segment, used = segments
    used = _open_segments(system, clock, moment, size, time, segments)
    _gather_actors(system, moment, count, size, time)
    outcome = resolve_contacts(system, moment, count, size, budget <= 0, accumulator)
    budget -= outcome != STRUCK
    if outcome == NOTHING and budget < 0:
        return outcome, False, used, budget
    for m in range(size):
        i = moment.indices[m]
        if i < system.particles:
            if outcome != NOTHING:
                wake(system, system.body[i], interval - time, accumulator)
            _deflect(system, clock, moment, m, time, segment[used])
            used += 1
    return outcome, True, used, budget


@kernel
def _run_island(system, clock, neighbours, members, bounds, queue, moment, segments):
    """Carry an island whose first events are on the queue through its impacts.

    ``bounds`` are the end of the substep [s], and how many moments of impact there may be for each of the members.
    ``segments`` are (room for them, how many there are, the accumulator). Returns the room, how many there are then,
    and when half of the moments were used up if all were, infinity if no impacts were left [s].
    """
    segment, used, accumulator = segments
    duration, most = bounds
    left, budget = most * len(members), MAX_SLOW_IMPACTS * len(members)
    half, time, halfway = left // 2, 0.0, 0.0
    while left > 0:
        time, count, size = _pop_simultaneous(system, clock, queue, SIMULTANEOUS * duration, moment)
        if count == 0:
            return segment, used, math.inf
        left -= 1
        halfway = time if left == half else halfway
        while used + 2 * size > len(segment):
            segment = grow_records(segment)
        outcome, written, used, budget = _resolve_moment(
            system, clock, (time, count, size), moment, budget, duration, accumulator, (segment, used)
        )
        if written:
            # What touches and was found not to approach must not be predicted for this moment again.
            soonest = SIMULTANEOUS * duration if outcome == NOTHING else 0.0
            for m in range(size):
                if moment.indices[m] < system.particles:
                    _predict(system, clock, neighbours, moment, m, (soonest, duration), queue)
    while used + 2 * len(members) > len(segment):
        segment = grow_records(segment)
    return segment, _freeze(system, clock, members, (time, duration), (segment, used)), halfway


@entry_kernel
def run_islands(system, clock, neighbours, predicted, islands, duration, accumulator, block):
    """Carry out the impacts of islands within ``duration`` [s].

    A ``block`` is (first and last island, moments of impact a member at most, contact laws if there is friction);
    ``predicted`` are the impacts on the paths of the start. Adds to the row of ``accumulator`` (n, columns as in
    booking.py) of each island's first member. Returns the path segments, how many islands were left with impacts to
    resolve, and when the first of them had half of its moments, or infinity [s].
    """
    system, clock, neighbours, predicted, islands, accumulator = without_refcounts(
        (system, clock, neighbours, predicted, islands, accumulator)
    )
    moment = new_moment(block[3])
    segment = np.empty(256, dtype=SEGMENT)
    used = unfinished = 0
    first_half = math.inf
    queue = [(0.0, 0, 0, 0)]
    for k in range(block[0], block[1]):
        queue.clear()
        members = islands.member[islands.start[k] : islands.start[k + 1]]
        i, j = min(members[0], members[-1]), max(members[0], members[-1])
        if len(members) == 2 and strike_alone(system, predicted, i, j):
            while used + 4 > len(segment):
                segment = grow_records(segment)
            interval = predicted.time[predicted.first[i]], duration
            if resolve_sphere_pair(system, clock, i, j, interval, accumulator[i], segment[used:]):
                used += 4
                continue
        _begin(predicted, clock, members, queue)
        segments, bounds = (segment, used, accumulator[members[0]]), (duration, block[2])
        segment, used, halfway = _run_island(system, clock, neighbours, members, bounds, queue, moment, segments)
        unfinished += halfway < math.inf
        first_half = min(first_half, halfway)
    return segment[:used], unfinished, first_half
