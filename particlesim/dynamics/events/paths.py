"""Where every particle has got to within a stretch of time, and the paths it took.

A stretch is the time that is computed at once. A particle that meets nothing keeps its state of the start of the
stretch and its clock at 0. One that does has a piece of path from each of its impacts to the next: the pieces are
kept in a log, chained particle by particle, so that the paths of any two can be compared afterwards.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.core.jit import kernel
from particlesim.core.math3d import load_quat, load_vec3, store_quat, store_vec3

# What stands in place of a first piece: there is none, or it is not chained yet.
NOTHING_MET = -1
UNCHAINED = -2

# Columns of a piece: when it starts, then position, orientation, velocity, angular momentum and acceleration.
PIECE = 17


class Course(NamedTuple):
    """Of each particle within the present stretch; times count from its start."""

    clock: np.ndarray  # (n,) when the state describes it [s]
    stamp: np.ndarray  # (n,) int64, how often its path was looked into anew
    impacts: np.ndarray  # (n,) int64, impacts it has had
    head: np.ndarray  # (n,) int64, its first piece in the log, or NOTHING_MET
    tail: np.ndarray  # (n,) int64, its last piece
    island: np.ndarray  # (n,) int64, the smallest particle whose impacts hang together with its own
    ring: np.ndarray  # (n,) int64, the next particle of its island, round and round
    listed: np.ndarray  # (n,) bool, False but while particles are listed
    touched: np.ndarray  # (n,) bool, whether it has met anything, in any round
    acceleration: np.ndarray  # (n, 3) [m/s^2]


class Log(NamedTuple):
    """Pieces of path, each particle's in the order of time; the first of a particle starts at 0."""

    piece: np.ndarray  # (m, PIECE)
    particle: np.ndarray  # (m,) int64
    following: np.ndarray  # (m,) int64, the particle's next piece, -1 if there is none


def new_course(count: int, gravity: np.ndarray) -> Course:
    """Of ``count`` particles that have met nothing."""
    return Course(
        clock=np.zeros(count),
        stamp=np.zeros(count, dtype=np.int64),
        impacts=np.zeros(count, dtype=np.int64),
        head=np.full(count, NOTHING_MET, dtype=np.int64),
        tail=np.full(count, NOTHING_MET, dtype=np.int64),
        island=np.arange(count, dtype=np.int64),
        ring=np.arange(count, dtype=np.int64),
        listed=np.zeros(count, dtype=np.bool_),
        touched=np.zeros(count, dtype=np.bool_),
        acceleration=np.tile(gravity, (count, 1)),
    )


def empty_log() -> Log:
    """Without any piece."""
    return Log(np.empty((0, PIECE)), np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64))


@kernel
def write_piece(piece, index, time, state, acceleration, i):
    """Write the state of particle ``i`` as a piece that starts at ``time``."""
    piece[index, 0] = time
    for axis in range(3):
        piece[index, 1 + axis] = state.position[i, axis]
        piece[index, 8 + axis] = state.velocity[i, axis]
        piece[index, 11 + axis] = state.angular_momentum[i, axis]
        piece[index, 14 + axis] = acceleration[i, axis]
    for axis in range(4):
        piece[index, 4 + axis] = state.orientation[i, axis]


@kernel
def path_of_piece(piece, index):
    """Position, orientation, velocity, angular momentum and acceleration at the start of a piece."""
    return (
        (piece[index, 1], piece[index, 2], piece[index, 3]),
        (piece[index, 4], piece[index, 5], piece[index, 6], piece[index, 7]),
        (piece[index, 8], piece[index, 9], piece[index, 10]),
        (piece[index, 11], piece[index, 12], piece[index, 13]),
        (piece[index, 14], piece[index, 15], piece[index, 16]),
    )


@kernel
def path_of_state(state, acceleration, i):
    """Position, orientation, velocity, angular momentum and acceleration of particle ``i``."""
    return (
        load_vec3(state.position, i),
        load_quat(state.orientation, i),
        load_vec3(state.velocity, i),
        load_vec3(state.angular_momentum, i),
        load_vec3(acceleration, i),
    )


@kernel
def _chain(course, log, first):
    """Chain the pieces from ``first`` on to those of the same particle before them."""
    head, tail = course.head, course.tail
    for m in range(first, len(log.particle)):
        i = log.particle[m]
        log.following[m] = -1
        if head[i] < 0:
            head[i] = m
        else:
            log.following[tail[i]] = m
        tail[i] = m


def extended(course: Course, log: Log, pieces: list[np.ndarray], particles: list[np.ndarray]) -> Log:
    """The log with more pieces at its end, chained."""
    first = len(log.particle)
    piece = np.concatenate([log.piece, *pieces])
    particle = np.concatenate([log.particle, *particles])
    following = np.concatenate([log.following, np.empty(len(particle) - first, dtype=np.int64)])
    longer = Log(piece, particle, following)
    _chain(course, longer, first)
    return longer


@kernel
def rewind(course, log, state, particles):
    """Take particles back to the start of the stretch, as if they had met nothing."""
    for i in particles:
        course.clock[i] = 0.0
        course.stamp[i] = course.impacts[i] = 0
        if course.head[i] >= 0:
            position, turn, velocity, momentum, pull = path_of_piece(log.piece, course.head[i])
            store_vec3(state.position, i, position)
            store_quat(state.orientation, i, turn)
            store_vec3(state.velocity, i, velocity)
            store_vec3(state.angular_momentum, i, momentum)
            store_vec3(course.acceleration, i, pull)
            course.head[i] = NOTHING_MET


@kernel
def forget(course, particles):
    """Let particles have met nothing, at the start of a new stretch."""
    for i in particles:
        course.clock[i] = 0.0
        course.stamp[i] = course.impacts[i] = 0
        course.head[i] = NOTHING_MET
        course.island[i] = course.ring[i] = i
        course.touched[i] = False
