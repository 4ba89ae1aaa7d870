"""The impacts of islands, each island's in the order of time."""

from __future__ import annotations

import heapq
import math

import numpy as np

from particlesim.core.constants import MAX_IMPACTS, MAX_SLOW_IMPACTS, SIMULTANEOUS
from particlesim.core.jit import kernel, without_refcounts
from particlesim.core.math3d import grow, load_vec3, store_quat, store_vec3
from particlesim.dynamics.ccd.pair_impact import body_of, later, pair_meets, wall_meets
from particlesim.dynamics.contact.impact import NOTHING, STRUCK, answer, let_go
from particlesim.dynamics.contact.sphere_pair import answer_two, meet_alone
from particlesim.dynamics.events.paths import NOTHING_MET, PIECE, UNCHAINED, path_of_state, write_piece
from particlesim.geometry.narrow_phase.gjk import NO_CORNERS
from particlesim.model.touching import wall_as_partner


@kernel
def _is_current(stamp, event):
    """Whether neither of its partners has been deflected since an impact was foretold."""
    _, i, j, stamps = event
    return stamp[i] + (stamp[j] if j >= 0 else 0) == stamps


@kernel
def _among(whom, size, i):
    """Whether particle ``i`` is one of the first ``size``."""
    found = False
    for k in range(size):
        found = found or whom[k] == i
    return found


@kernel(inline=True)
def _foretell(table, world, constants, state, course, lists, whom, done, soonest, duration, heap, points):
    """Put the next impacts of particle ``whom[done]`` with its island and with the walls on the heap.

    Those with ``whom[:done]`` are there already; impacts sooner than ``soonest`` [s] from now are none.
    """
    island, stamp, clock = course.island, course.stamp, course.clock
    i = whom[done]
    kind, lower, upper, boundary = table.kind, world.lower, world.upper, world.boundary
    now = clock[i]
    path = path_of_state(state, course.acceleration, i)
    body = body_of(constants, i)
    place = lists.place[i]
    for near in range(lists.start[place], lists.start[place + 1]):
        j = lists.particle[lists.other[near]]
        if island[j] != island[i] or _among(whom, done, j):
            continue
        moments = load_vec3(constants.inertia, j)
        path_j = later(path_of_state(state, course.acceleration, j), moments, now - clock[j])
        body_j = body_of(constants, j)
        one, on, two, upon = body, path, body_j, path_j
        if j < i:
            one, on, two, upon = body_j, path_j, body, path
        time = pair_meets(
            table, world, kind[one[0]], one, on, kind[two[0]], two, upon, duration - now, NO_CORNERS, points
        )
        if soonest <= time < math.inf:
            heapq.heappush(heap, (now + time, min(i, j), max(i, j), stamp[i] + stamp[j]))
    for wall in range(6):
        time = wall_meets(table, world, lower, upper, boundary, kind[body[0]], body, path, wall, duration - now, points)
        if soonest <= time < math.inf:
            heapq.heappush(heap, (now + time, i, wall_as_partner(wall), stamp[i]))


@kernel
def _joins(event, whom, size):
    """Whether an impact shares a particle with those of the moment."""
    return _among(whom, size, event[1]) or (event[2] >= 0 and _among(whom, size, event[2]))


@kernel
def _take(event, contacts, count, whom, size):
    """Add an impact to those of the moment; returns how many particles these concern."""
    contacts[count, 0], contacts[count, 1] = event[1], event[2]
    for i in event[1:3]:
        if i >= 0 and not _among(whom, size, i):
            whom[size] = i
            size += 1
    return size


@kernel
def _moment(heap, stamp, within, contacts, whom):
    """Take the earliest impact off the heap, and those ``within`` [s] of it that hang together with it.

    Returns (time, number of contacts, number of particles); there are none if nothing is left.
    """
    while len(heap) > 0 and not _is_current(stamp, heap[0]):
        heapq.heappop(heap)
    if len(heap) == 0:
        return 0.0, 0, 0
    first = heapq.heappop(heap)
    size = _take(first, contacts, 0, whom, 0)
    count = 1
    if len(heap) == 0 or heap[0][0] > first[0] + within:
        return first[0], count, size
    waiting = [first]
    waiting.pop()
    while len(heap) > 0 and heap[0][0] <= first[0] + within:
        event = heapq.heappop(heap)
        if _is_current(stamp, event):
            waiting.append(event)
    k = 0
    while k < len(waiting):
        if count < len(contacts) and _joins(waiting[k], whom, size):
            size = _take(waiting.pop(k), contacts, count, whom, size)
            count += 1
            k = 0
        else:
            k += 1
    for event in waiting:
        heapq.heappush(heap, event)
    return first[0], count, size


@kernel
def _bring(state, course, constants, i, time):
    """Bring particle ``i`` along its path to ``time``."""
    since = time - course.clock[i]
    course.clock[i] = time
    if since != 0.0:
        path = path_of_state(state, course.acceleration, i)
        position, turn, velocity, _, _ = later(path, load_vec3(constants.inertia, i), since)
        store_vec3(state.position, i, position)
        store_quat(state.orientation, i, turn)
        store_vec3(state.velocity, i, velocity)


@kernel
def _begin(met, times, first_met, stamp, members, heap):
    """Put the impacts on the paths that all members are on at the start on an empty heap."""
    for i in members:
        k = first_met[i]
        while 0 <= k < len(met) and met[k, 0] == i:
            j = met[k, 1]
            heapq.heappush(heap, (times[k], i, j, stamp[i] + (stamp[j] if j >= 0 else 0)))
            k += 1


@kernel
def _halt(state, course, constants, members, time, duration, piece, particle, pieces):
    """Let the members stand where they are at ``time`` until the end of the stretch; returns how many pieces there are.

    They keep their velocities, but nothing can get into anything else.
    """
    for i in members:
        if course.head[i] == NOTHING_MET:
            write_piece(piece, pieces, 0.0, state, course.acceleration, i)
            particle[pieces, 0] = i
            pieces += 1
            course.head[i] = UNCHAINED
        _bring(state, course, constants, i, time)
        course.clock[i] = duration
        write_piece(piece, pieces, time, state, course.acceleration, i)
        for column in range(8, PIECE):
            piece[pieces, column] = 0.0
        particle[pieces, 0] = i
        pieces += 1
    return pieces


@kernel
def run_islands(
    table,
    world,
    constants,
    state,
    course,
    lists,
    met,
    times,
    first_met,
    edges,
    member,
    duration,
    tally,
    points,
    first,
    last,
):
    """Carry out the impacts of islands ``first .. last`` within ``duration`` [s].

    The members of island ``k`` are ``member[edges[k]:edges[k + 1]]``; ``met`` (m, 2), ``times`` and ``first_met`` are
    the meetings on the paths of the start, ``lists`` those of the neighbours. Adds to the row of
    ``tally`` (n, TALLY) of each island's first member.
    Returns the pieces of path and whose they are, and how many islands were left with impacts to answer.
    """
    table, world, constants, state, course = without_refcounts((table, world, constants, state, course))
    lists, met, times, first_met = without_refcounts((lists, met, times, first_met))
    edges, member, tally, points = without_refcounts((edges, member, tally, points))
    stamp, head = course.stamp, course.head
    contacts, whom = np.empty((64, 2), dtype=np.int64), np.empty(128, dtype=np.int64)
    piece, particle = np.empty((256, PIECE)), np.empty((256, 1), dtype=np.int64)
    pieces = unfinished = 0
    heap = [(0.0, 0, 0, 0)]
    for k in range(first, last):
        heap.clear()
        members = member[edges[k] : edges[k + 1]]
        i, j = min(members[0], members[-1]), max(members[0], members[-1])
        if len(members) == 2 and meet_alone(table.kind, world, constants.shape, met, first_met, i, j):
            while pieces + 4 > len(piece):
                piece, particle = grow(piece), grow(particle)
            if answer_two(
                world, constants, state, course, i, j, times[first_met[i]], duration, tally[i], piece, particle, pieces
            ):
                pieces += 4
                continue
        _begin(met, times, first_met, stamp, members, heap)
        time = 0.0
        left, slow_left = MAX_IMPACTS * len(members), MAX_SLOW_IMPACTS * len(members)
        while left > 0:
            time, count, size = _moment(heap, stamp, SIMULTANEOUS * duration, contacts, whom)
            if count == 0:
                break
            left -= 1
            while pieces + 2 * size > len(piece):
                piece, particle = grow(piece), grow(particle)
            for m in range(size):
                i = whom[m]
                if head[i] == NOTHING_MET:
                    write_piece(piece, pieces, 0.0, state, course.acceleration, i)
                    particle[pieces, 0] = i
                    pieces += 1
                    head[i] = UNCHAINED
                _bring(state, course, constants, i, time)
            outcome = answer(
                table,
                world,
                constants,
                state,
                course.acceleration,
                contacts,
                count,
                whom,
                size,
                slow_left <= 0,
                course.impacts,
                tally[members[0]],
            )
            slow_left -= outcome != STRUCK
            if outcome == NOTHING and slow_left < 0:
                continue
            for m in range(size):
                i = whom[m]
                stamp[i] += 1
                if outcome != NOTHING:
                    let_go(world, constants, course.acceleration, i, duration - time, tally[members[0]])
                write_piece(piece, pieces, time, state, course.acceleration, i)
                particle[pieces, 0] = i
                pieces += 1
            # What touches and was found not to approach must not be foretold for this moment again.
            soonest = SIMULTANEOUS * duration if outcome == NOTHING else 0.0
            for m in range(size):
                _foretell(table, world, constants, state, course, lists, whom, m, soonest, duration, heap, points)
        if left == 0:
            unfinished += 1
            while pieces + 2 * len(members) > len(piece):
                piece, particle = grow(piece), grow(particle)
            pieces = _halt(state, course, constants, members, time, duration, piece, particle, pieces)
    return piece[:pieces], particle[:pieces, 0], unfinished
