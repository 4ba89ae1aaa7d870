"""Path segments: where every particle has got to within a substep, and the paths it took.

A particle that nothing strikes keeps its record of the start of the substep and its clock at 0. One that is struck has
a path segment from each of its impacts to the next, chained particle by particle, so that the paths of any two can be
compared afterwards.
"""

from __future__ import annotations

from itertools import accumulate
from typing import NamedTuple

import numpy as np

from particlesim.core.jit import entry_kernel, kernel, without_refcounts
from particlesim.core.math3d import set_quat, set_vec3, to_quat, to_vec3
from particlesim.core.parallel import ThreadTeam
from particlesim.core.records import record
from particlesim.model.prescribed_motion import NO_SWING

# What stands in place of a first segment: there is none, or it is not chained yet.
UNDISTURBED = -1
UNCHAINED = -2

# Of each body within the present substep.
CLOCK = record(
    [
        ("stamp", "i4"),  # how often its impacts were predicted anew
        ("impacts", "i4"),  # impacts it has had
        ("first_segment", "i8"),  # or UNDISTURBED
        ("last_segment", "i8"),
        ("island", "i8"),  # the smallest particle whose impacts hang together with its own
        ("next_in_island", "i8"),  # the next particle of its island, round and round
        ("listed", "i4"),  # 0 but while particles are listed
        ("touched", "i4"),  # whether anything was found to strike it, in any round
    ]
)

SEGMENT = record(
    [
        ("start", "f8"),  # [s]
        ("position", "f8", (3,)),
        ("orientation", "f8", (4,)),
        ("velocity", "f8", (3,)),
        ("angular_momentum", "f8", (3,)),
        ("resting", "i8"),  # whether it does not fall
        ("particle", "i8"),
        ("next", "i8"),  # the particle's next segment, -1 if there is none
    ]
)


class Paths(NamedTuple):
    """The paths of all bodies through the present substep."""

    clock: np.ndarray  # (n,) CLOCK
    segment: np.ndarray  # (m,) SEGMENT, each particle's in the order of time; the first of a particle starts at 0


def new_clocks(count: int) -> np.ndarray:
    """Of ``count`` bodies that nothing has struck, (count,) CLOCK."""
    clock = np.zeros(count, dtype=CLOCK)
    clock["first_segment"] = clock["last_segment"] = UNDISTURBED
    clock["island"] = clock["next_in_island"] = np.arange(count)
    return clock


def no_segments() -> np.ndarray:
    """(0,) SEGMENT."""
    return np.empty(0, dtype=SEGMENT)


@kernel
def _copy_motion(source, target):
    """Copy where a record says that a particle is, and how it moves, to another."""
    set_vec3(target.position, to_vec3(source.position))
    set_quat(target.orientation, to_quat(source.orientation))
    set_vec3(target.velocity, to_vec3(source.velocity))
    set_vec3(target.angular_momentum, to_vec3(source.angular_momentum))
    target.resting = source.resting


@kernel
def write_segment(segment, b, i, start):
    """Write body record ``b`` of particle ``i`` as a segment that starts at ``start`` [s]."""
    segment.start = start
    segment.particle = i
    _copy_motion(b, segment)


@kernel
def path_of_segment(system, segment):
    """The path (see model/free_motion.py) at the start of a segment."""
    gravity = to_vec3(system.domain[0].gravity)
    return (
        to_vec3(segment.position),
        to_quat(segment.orientation),
        to_vec3(segment.velocity),
        to_vec3(segment.angular_momentum),
        gravity if segment.resting == 0 else (0.0, 0.0, 0.0),
        NO_SWING,
    )


@entry_kernel
def _append(clock, segment, part, first):
    """Write the segments of a part from row ``first`` on, chained to those of the same particle before them."""
    clock, segment, part = without_refcounts((clock, segment, part))
    for k in range(len(part)):
        m = first + k
        segment[m] = part[k]
        c = clock[segment[m].particle]
        segment[m].next = -1
        if c.first_segment < 0:
            c.first_segment = m
        else:
            segment[c.last_segment].next = m
        c.last_segment = m


def with_room(room: np.ndarray, used: int, more: int) -> np.ndarray:
    """Room (m,) SEGMENT for ``more`` segments after the ``used`` ones in ``room``: that itself if it is enough."""
    if used + more <= len(room):
        return room
    larger = np.empty(max(used + more, 2 * len(room)), dtype=SEGMENT)
    larger[:used] = room[:used]
    return larger


def extended(paths: Paths, parts: list[np.ndarray], room: np.ndarray) -> Paths:
    """The paths with more segments, chained, in ``room`` after those that they have, which are at its front already.

    No particle has segments in two of the parts.
    """
    first = list(accumulate(map(len, parts), initial=len(paths.segment)))

    def append(_: int, begin: int, end: int) -> None:
        for part in range(begin, end):
            _append(paths.clock, room, parts[part], first[part])

    ThreadTeam(first[-1] - first[0]).each(append, len(parts), len(parts))
    return Paths(paths.clock, room[: first[-1]])


@entry_kernel
def rewind(paths, body, indices):
    """Take particles back to the start of the substep, as if nothing had struck them."""
    paths, body, indices = without_refcounts((paths, body, indices))
    for i in indices:
        c = paths.clock[i]
        body[i].time, body[i].disturbed = 0.0, 0
        c.stamp = c.impacts = 0
        if c.first_segment >= 0:
            _copy_motion(paths.segment[c.first_segment], body[i])
            c.first_segment = UNDISTURBED


@entry_kernel
def forget(clock, body, indices):
    """Let particles be undisturbed, at the start of a new substep."""
    clock, body, indices = without_refcounts((clock, body, indices))
    for i in indices:
        c = clock[i]
        body[i].time, body[i].disturbed = 0.0, 0
        c.stamp = c.impacts = c.touched = 0
        c.first_segment = UNDISTURBED
        c.island = c.next_in_island = i
