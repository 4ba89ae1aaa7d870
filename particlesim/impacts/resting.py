"""Resting contacts: what gravity presses together does not fall, sink or tremble.

A ball that bounces with restitution below 1 makes infinitely many bounces in a finite time. They end here. Contact
points at which bodies hardly approach or part, on a wall that gravity pulls to or on what rests on one, are taken
together, and gravity acts for a whole stretch of time at once. Impulses, none of which pulls, then leave none of the
points closing (J. J. Moreau, Unilateral contact and dry friction in finite freedom dynamics, 1988); they are found by
going round the points (M. Jean, Computer Methods in Applied Mechanics and Engineering 177 (1999) 235-257). What is
pressed moves on steadily for the stretch, or until an impact sends it flying; what is not falls as ever.

The new velocities are the nearest, by their kinetic energy, to those with gravity that close no point. So the energy,
with what the bodies lose of their height, falls by the kinetic energy of the change in velocity, and never rises.
"""

from __future__ import annotations

import numpy as np

from particlesim.constants import (
    HULL,
    MAX_MANIFOLD,
    RESTING_DROP,
    RESTING_TILT,
    STILL,
    WALL,
)
from particlesim.impacts.neighbours import Neighbours
from particlesim.impacts.response import approach, restitution_of
from particlesim.impacts.sieve import grown
from particlesim.jit import borrowed, kernel
from particlesim.motion import spin_of, spins
from particlesim.narrow_phase.contacts import wall_as_partner, wall_of_partner
from particlesim.narrow_phase.hull_hull import tilted_patch
from particlesim.narrow_phase.pair import nearest_image, pair_contact
from particlesim.narrow_phase.walls import wall_normal
from particlesim.state import Constants, ShapeTable, State, World
from particlesim.vec import add, along, apply, cross, dot, matrix_of, put, row, row4, scaled, sub

# Rounds over all contact points. Piles that lie still need one or two, as they start from the forces of before.
_MAX_SWEEPS = 100

# Sweeps end when no normal velocity changes by more than this fraction of what gravity adds in the stretch.
_CONVERGED = 1e-9

# Contacts that have sunk deeper than this fraction of the inscribed radius are lifted again, by a tenth at a time.
DEEP = 2e-4

# Columns of a contact point: normal, arms from the two centroids, what a unit impulse does to the two spins, by
# how much it may close, effective mass.
NORMAL, ARM_I, ARM_J, TWIST_I, TWIST_J = 0, 3, 6, 9, 12
CLOSING, MASS = 15, 16
COLUMNS = 17


@kernel
def _column(array, k, first):
    return array[k, first], array[k, first + 1], array[k, first + 2]


@kernel
def _put_column(array, k, first, v):
    array[k, first], array[k, first + 1], array[k, first + 2] = v


@kernel(inline=True)
def _wall_points(table, world, constants, state, i, wall, band, points, gaps):
    """Corners of particle ``i`` within ``band`` of a wall, and their distances; returns how many."""
    axis, sign = wall // 2, 2.0 * (wall % 2) - 1.0
    room = sign * ((world.upper[axis] if wall % 2 else world.lower[axis]) - state.position[i, axis])
    normal = wall_normal(wall)
    shape, size = constants.shape[i], constants.size[i]
    count = 0
    if table.kind[shape] == HULL:
        matrix = matrix_of(row4(state.orientation, i))
        vertex = table.vertex
        for v in range(table.vertex_start[shape], table.vertex_start[shape + 1]):
            corner = apply(matrix, scaled(row(vertex, v), size))
            gap = room - dot(normal, corner)
            if gap <= band and count < MAX_MANIFOLD:
                put(points, count, corner)
                gaps[count] = gap
                count += 1
    elif room - constants.radius[i] <= band:
        put(points, 0, scaled(normal, constants.radius[i]))
        gaps[0] = room - constants.radius[i]
        count = 1
    return normal, (0.0, 0.0, 0.0), count


@kernel(inline=True)
def _pair_points(table, world, constants, state, i, j, band, points, gaps):
    """Contact points of two particles within ``band``, and the gaps there: (normal, offset, how many)."""
    offset = nearest_image(sub(row(state.position, j), row(state.position, i)), world.period)
    reach = constants.radius[i] + constants.radius[j] + band
    normal, count = (0.0, 0.0, 0.0), 0
    if dot(offset, offset) <= reach * reach:
        shape_i, size_i, turn_i = constants.shape[i], constants.size[i], row4(state.orientation, i)
        shape_j, size_j, turn_j = constants.shape[j], constants.size[j], row4(state.orientation, j)
        if table.kind[shape_i] == HULL and table.kind[shape_j] == HULL:
            separation, normal, count = tilted_patch(
                table, shape_i, size_i, turn_i, shape_j, size_j, turn_j, offset, RESTING_TILT, points, gaps
            )
        else:
            separation, normal, count = pair_contact(
                table, shape_i, size_i, turn_i, shape_j, size_j, turn_j, offset, points
            )
            gaps[0] = separation
        if separation > band:
            count = 0
    return normal, offset, count


@kernel(inline=True)
def _twist(constants, state, i, arm, normal):
    """The spin that a unit impulse along ``normal`` at ``arm`` gives particle ``i``."""
    return spin_of(row4(state.orientation, i), cross(arm, normal), row(constants.inertia, i))


@kernel
def _may_close(gap, inradius):
    """By how much a contact point with this gap may close in one stretch; what has sunk deep is lifted a little."""
    if gap >= 0.0:
        return gap
    return 0.1 * gap if gap < -DEEP * inradius else 0.0


@kernel
def _add_contact(table, world, constants, state, i, j, points, gaps, partner, point, size):
    """Add the points of a contact if it is slow at all of them; returns how many there are then.

    ``points`` and ``gaps`` are room to work in; ``partner`` and ``point`` must have room for MAX_MANIFOLD more.
    """
    restitution, resting = restitution_of(world, constants, i, j)
    # What rebounds in full rests only if it lies quite still.
    slow = resting if restitution < 1.0 else STILL * resting
    inradius = constants.inradius[i] if j < 0 else min(constants.inradius[i], constants.inradius[j])
    band = RESTING_DROP * inradius if restitution < 1.0 else STILL * RESTING_DROP * inradius
    if j < 0:
        normal, offset, count = _wall_points(table, world, constants, state, i, wall_of_partner(j), band, points, gaps)
    else:
        normal, offset, count = _pair_points(table, world, constants, state, i, j, band, points, gaps)
    for k in range(count):
        arm = row(points, k)
        arm_j = sub(arm, offset)
        before, _ = approach(world.still, constants, state, i, j, arm, offset, normal)
        if abs(before) > slow:
            return size
        m = size + k
        partner[m, 0], partner[m, 1] = i, j
        _put_column(point, m, NORMAL, normal)
        _put_column(point, m, ARM_I, arm)
        _put_column(point, m, ARM_J, arm_j)
        twist = _twist(constants, state, i, arm, normal)
        _put_column(point, m, TWIST_I, twist)
        inverse_mass = 1.0 / constants.mass[i] + dot(cross(arm, normal), twist)
        if j >= 0:
            twist = _twist(constants, state, j, arm_j, normal)
            _put_column(point, m, TWIST_J, twist)
            inverse_mass += 1.0 / constants.mass[j] + dot(cross(arm_j, normal), twist)
        point[m, CLOSING], point[m, MASS] = _may_close(gaps[k], inradius), 1.0 / inverse_mass
    return size + count


@kernel
def _pressed_walls(world):
    """Which walls gravity presses against."""
    pressed = np.zeros(6, dtype=np.bool_)
    for wall in range(6):
        normal = wall_normal(wall)
        pull = normal[0] * world.gravity[0] + normal[1] * world.gravity[1] + normal[2] * world.gravity[2]
        pressed[wall] = world.boundary[wall // 2] == WALL and pull > 0.0
    return pressed


@kernel
def find_resting(table, world, constants, state, lists):
    """Contact points that may rest, and their partners (m, 2): on walls, and all that hangs together with these."""
    table, world, constants, state = borrowed((table, world, constants, state))
    position, radius = state.position, constants.radius
    particle, place, start, other = lists
    count = len(radius)
    points, gaps = np.empty((MAX_MANIFOLD, 3)), np.empty(MAX_MANIFOLD)
    partner, point = np.empty((64, 2), dtype=np.int64), np.empty((64, COLUMNS))
    pressed = _pressed_walls(world)
    reached = np.zeros(count, dtype=np.int64)  # 1 when it waits, 2 when its contacts have been gathered
    waiting = np.empty(count, dtype=np.int64)
    found = size = 0
    for i in range(count):
        for wall in range(6):
            if not pressed[wall] or reached[i]:
                continue
            axis = wall // 2
            room = world.upper[axis] - position[i, axis] if wall % 2 else position[i, axis] - world.lower[axis]
            if room <= radius[i] * (1.0 + RESTING_DROP):
                trial = _add_contact(
                    table, world, constants, state, i, wall_as_partner(wall), points, gaps, partner, point, 0
                )
                if trial > 0:
                    reached[i] = 1
                    waiting[found] = i
                    found += 1
    next_one = 0
    while next_one < found:
        i = waiting[next_one]
        next_one += 1
        reached[i] = 2
        here = place[i]
        while size + MAX_MANIFOLD * (6 + start[here + 1] - start[here]) > len(partner):
            partner, point = grown(partner), grown(point)
        for wall in range(6):
            if world.boundary[wall // 2] == WALL:
                size = _add_contact(
                    table, world, constants, state, i, wall_as_partner(wall), points, gaps, partner, point, size
                )
        for near in range(start[here], start[here + 1]):
            j = particle[other[near]]
            if reached[j] == 2:
                continue
            more = _add_contact(
                table, world, constants, state, min(i, j), max(i, j), points, gaps, partner, point, size
            )
            if more > size and reached[j] == 0:
                reached[j] = 1
                waiting[found] = j
                found += 1
            size = more
    return partner[:size], point[:size]


@kernel(inline=True)
def _push(velocity, spin, mass, i, j, point, k, impulse):
    """Give the impulse of a contact point to the velocities and spins of its two partners."""
    normal = _column(point, k, NORMAL)
    put(velocity, i, along(row(velocity, i), normal, -impulse / mass[i]))
    put(spin, i, along(row(spin, i), _column(point, k, TWIST_I), -impulse))
    if j >= 0:
        put(velocity, j, along(row(velocity, j), normal, impulse / mass[j]))
        put(spin, j, along(row(spin, j), _column(point, k, TWIST_J), impulse))


@kernel(inline=True)
def _parting_now(velocity, spin, i, j, point, k):
    """Speed at which the partners part at a contact point."""
    normal, arm = _column(point, k, NORMAL), _column(point, k, ARM_I)
    parting = -dot(normal, add(row(velocity, i), cross(row(spin, i), arm)))
    if j >= 0:
        arm = _column(point, k, ARM_J)
        parting += dot(normal, add(row(velocity, j), cross(row(spin, j), arm)))
    return parting


@kernel
def press(partner, point, mass, velocity, spin, duration, small, impulse):
    """Find the impulses (m,) at contact points that leave none closing its gap within ``duration`` [s].

    Starts from ``impulse`` and leaves ``velocity`` and ``spin`` (n, 3), which gravity has been added to, as the
    impulses make them. Ends when no normal velocity changes by more than ``small`` [m/s].
    """
    for k in range(len(partner)):
        _push(velocity, spin, mass, partner[k, 0], partner[k, 1], point, k, impulse[k])
    for _ in range(_MAX_SWEEPS):
        change = 0.0
        for k in range(len(partner)):
            i, j = partner[k, 0], partner[k, 1]
            closing = point[k, CLOSING] / duration + _parting_now(velocity, spin, i, j, point, k)
            total = max(0.0, impulse[k] - closing * point[k, MASS])
            _push(velocity, spin, mass, i, j, point, k, total - impulse[k])
            change = max(change, abs(total - impulse[k]) / point[k, MASS])
            impulse[k] = total
        if change <= small:
            break


@kernel
def hold_pressed(partner, point, impulse, velocity, state, acceleration):
    """Give the bodies of pressed contact points their ``velocity`` (n, 3) for the stretch, and what turns them."""
    for k in range(len(partner)):
        if impulse[k] > 0.0:
            push = scaled(_column(point, k, NORMAL), impulse[k])
            i, j = partner[k, 0], partner[k, 1]
            put(state.velocity, i, row(velocity, i))
            put(acceleration, i, (0.0, 0.0, 0.0))
            twist = cross(_column(point, k, ARM_I), push)
            put(state.angular_momentum, i, sub(row(state.angular_momentum, i), twist))
            if j >= 0:
                put(state.velocity, j, row(velocity, j))
                put(acceleration, j, (0.0, 0.0, 0.0))
                twist = cross(_column(point, k, ARM_J), push)
                put(state.angular_momentum, j, add(row(state.angular_momentum, j), twist))


class Resting:
    """Holds what rests, one stretch of time after the other."""

    def __init__(self, table: ShapeTable, world: World, constants: Constants, state: State) -> None:
        self._table, self._world, self._constants, self._state = table, world, constants, state
        self._gravity = float(np.linalg.norm(world.gravity))
        self._keys, self._forces = np.empty(0, dtype=np.int64), np.empty(0)
        self.longest_stretch = self._longest_stretch()
        self._held = np.empty(0, dtype=np.int64)
        self.wall_impulse: np.ndarray = np.zeros(6)  # of the last stretch [N s]
        self.virial = 0.0  # of the last stretch [J s]
        self._before: tuple[np.ndarray, np.ndarray] | None = None

    def _longest_stretch(self) -> float:
        """What bounces to rest has done so after this time [s], in which it must be looked at; inf if nothing does."""
        restitution = np.append(self._constants.restitution, self._world.restitution)
        if self._gravity == 0.0 or restitution.min() == 1.0 or not len(self._constants.mass):
            return np.inf
        return 0.5 * float(np.sqrt(2.0 * RESTING_DROP * self._constants.inradius.mean() / self._gravity))

    def hold(self, neighbours: Neighbours, acceleration: np.ndarray, duration: float) -> None:
        """Hold what rests for a stretch of ``duration`` [s]: its velocity changes and its acceleration (n, 3) is 0."""
        if self._gravity == 0.0:
            return
        constants, state = self._constants, self._state
        acceleration[self._held] = self._world.gravity
        partner, point = find_resting(self._table, self._world, constants, state, neighbours.lists)
        self._held = np.unique(partner[partner >= 0])
        self._before = state.velocity[self._held], state.angular_momentum[self._held]
        self.wall_impulse, self.virial = np.zeros(6), 0.0
        if not len(partner):
            return
        keys = self._keys_of(partner)
        impulse = self._forces_of(keys) * duration
        velocity = state.velocity + self._world.gravity * duration
        small = _CONVERGED * self._gravity * duration
        press(partner, point, constants.mass, velocity, spins(constants, state), duration, small, impulse)
        hold_pressed(partner, point, impulse, velocity, state, acceleration)
        self._keys, self._forces = keys, impulse / duration
        on_wall = partner[:, 1] < 0
        self.wall_impulse = np.bincount(-1 - partner[on_wall, 1], impulse[on_wall], minlength=6)
        offset = point[:, ARM_I : ARM_I + 3] - point[:, ARM_J : ARM_J + 3]
        along_normal = (offset * point[:, NORMAL : NORMAL + 3]).sum(axis=1)
        self.virial = float((impulse * along_normal)[~on_wall].sum())

    def release(self) -> None:
        """Undo what the last ``hold`` did to the state."""
        if self._before is not None:
            self._state.velocity[self._held], self._state.angular_momentum[self._held] = self._before

    def _keys_of(self, partner: np.ndarray) -> np.ndarray:
        """A number for each contact point that stays the same from stretch to stretch."""
        count = len(self._constants.mass) + 6
        contact = partner[:, 0] * count + partner[:, 1] + 6
        starts = np.flatnonzero(np.diff(contact, prepend=-1))
        within = np.arange(len(contact)) - np.repeat(starts, np.diff(starts, append=len(contact)))
        return contact * MAX_MANIFOLD + within

    def _forces_of(self, keys: np.ndarray) -> np.ndarray:
        """The forces [N] that these contact points had in the stretch before; 0 for new ones."""
        if not len(self._keys):
            return np.zeros(len(keys))
        order = np.argsort(self._keys)
        place = np.minimum(np.searchsorted(self._keys, keys, sorter=order), len(order) - 1)
        known = self._keys[order[place]] == keys
        return np.where(known, self._forces[order[place]], 0.0)
