"""Where particles start: at random without overlap, on a lattice, in clusters, or where a list says."""

from __future__ import annotations

import math

import numpy as np

from particlesim.insertion import empty_space, extents, put_in_place, try_in_place
from particlesim.scene import Scene
from particlesim.scene.file import SceneError
from particlesim.scene.groups import (
    ClusterPlacement,
    LatticePlacement,
    ListPlacement,
    RandomPlacement,
    Region,
)
from particlesim.state import Constants, ShapeTable, World

# Rounds of random trials, one a particle, after which those without a place are said not to fit.  Equal spheres jam
# at a fill of 0.38 (J. Feder, J. Theor. Biol. 87 (1980) 237-254); short of 0.3 a handful of rounds is enough.
_MAX_ROUNDS = 3000


def positions(
    scene: Scene,
    table: ShapeTable,
    world: World,
    constants: Constants,
    orientation: np.ndarray,
    randoms: list[np.random.Generator],
) -> np.ndarray:
    """Positions of all particles of a scene, (n, 3) [m]. SceneError if a group does not fit.

    Lists and lattices come first; the rest is put between them at random, the largest particles first.
    """
    placed = empty_space(constants, world, len(constants.mass))
    placed.orientation[:] = orientation
    below, above = extents(table, constants, orientation)
    groups = [np.flatnonzero(constants.group == g) for g in range(len(scene.particles))]
    for g, (group, members) in enumerate(zip(scene.particles, groups, strict=True)):
        if isinstance(group.placement, ListPlacement):
            placed.position[members] = [pose.position for pose in group.placement.poses]
        elif isinstance(group.placement, LatticePlacement):
            room = (above[members] - below[members]).max(axis=0, initial=0.0)
            placed.position[members] = _on_lattice(g, group.placement, world, len(members), room, randoms[g])
        else:
            continue
        for i in members:
            put_in_place(world, placed, i)
    for level in range(int(placed.level.max(initial=-1)), -1, -1):
        for g, (group, members) in enumerate(zip(scene.particles, groups, strict=True)):
            if isinstance(group.placement, RandomPlacement | ClusterPlacement):
                left = members[placed.level[members] == level]
                trials = _Trials(g, group.placement, world, below, above, randoms[g])
                for _ in range(_MAX_ROUNDS):
                    if not len(left):
                        break
                    fits = try_in_place(table, world, constants, placed, left, trials.draw(left))
                    left = left[~fits]
                if len(left):
                    raise _no_room(g, len(members), len(left))
    return placed.position


def _no_room(g: int, wanted: int, left: int) -> SceneError:
    return SceneError(
        f"no room for {left} of them at random: fewer or smaller particles, a larger world, or a lattice",
        f"particles[{g}].count",
        wanted,
    )


def _bounds(region: Region | None, world: World) -> tuple[np.ndarray, np.ndarray]:
    if region is None:
        return world.lower, world.upper
    return np.array(region.lower), np.array(region.upper)


def lattice_points(lower: np.ndarray, upper: np.ndarray, count: int, spacing: float | None) -> tuple[np.ndarray, float]:
    """The first ``count`` points of a simple cubic lattice centred in a box, from the bottom up, and its spacing [m].

    Without a spacing the widest is taken that has enough points. Fewer points come back if the box holds no more.
    """
    edges = upper - lower
    if spacing is None:
        # The widest spacing divides one of the edges; no axis needs more points than a line of them all.
        most = math.ceil((count * edges.max() ** 3 / edges.prod()) ** (1.0 / 3.0)) + 1
        candidates = np.unique(np.outer(edges, 1.0 / np.arange(1, most + 1)))[::-1]
        fits = np.floor(edges / candidates[:, None] + 1e-9).prod(axis=1) >= count
        spacing = float(candidates[np.argmax(fits)])
    along = np.maximum(np.floor(edges / spacing + 1e-9).astype(int), 0)
    lines = [(np.arange(k) - 0.5 * (k - 1)) * spacing for k in along]
    z, y, x = (a.ravel() for a in np.meshgrid(lines[2], lines[1], lines[0], indexing="ij"))
    points = 0.5 * (lower + upper) + np.column_stack([x, y, z])
    return points[:count], spacing


def _on_lattice(
    g: int,
    lattice: LatticePlacement,
    world: World,
    count: int,
    room: np.ndarray,
    random: np.random.Generator,
) -> np.ndarray:
    """Lattice points, jittered within the gaps that particles of extent ``room`` (3,) leave."""
    lower, upper = _bounds(lattice.region, world)
    points, spacing = lattice_points(lower, upper, count, lattice.spacing)
    key = f"particles[{g}].placement"
    if len(points) < count:
        raise SceneError(f"a lattice of this spacing has {len(points)} points for {count} particles", key)
    if (room > spacing).any():
        raise SceneError(f"the lattice has a spacing of {spacing:g} m, the particles span {room.max():g} m", key)
    return points + random.uniform(-0.5, 0.5, points.shape) * (lattice.jitter * (spacing - room))


class _Trials:
    """Random proposals for the positions of a group's particles."""

    def __init__(
        self,
        g: int,
        where: RandomPlacement | ClusterPlacement,
        world: World,
        below: np.ndarray,
        above: np.ndarray,
        random: np.random.Generator,
    ) -> None:
        self._where, self._random = where, random
        lower, upper = _bounds(where.region, world)
        # A particle stays within its region, but where a region spans a periodic world only its centre does.
        free = (world.period > 0.0) & (lower <= world.lower) & (upper >= world.upper)
        self._lower = lower - np.where(free, 0.0, below)
        self._upper = upper - np.where(free, 0.0, above)
        self._centres = np.zeros((0, 3))
        if isinstance(where, ClusterPlacement):
            given = where.centres
            self._centres = random.uniform(lower, upper, (where.clusters, 3)) if given is None else np.array(given)
        self._key = f"particles[{g}].size"

    def draw(self, who: np.ndarray) -> np.ndarray:
        """A position for each particle of ``who`` (m,), (m, 3)."""
        lower, upper = self._lower[who], self._upper[who]
        if (lower > upper).any():
            raise SceneError("a particle is larger than the region it is placed in", self._key)
        if isinstance(self._where, RandomPlacement):
            return self._random.uniform(lower, upper)
        around = self._centres[who % len(self._centres)]
        points = around + self._where.spread * self._random.normal(size=(len(who), 3))
        # What falls outside is drawn again, so that the blob is cut off rather than piled up at the wall.
        for _ in range(100):
            outside = ((points < lower) | (points > upper)).any(axis=1)
            if not outside.any():
                break
            again = around[outside] + self._where.spread * self._random.normal(size=(outside.sum(), 3))
            points[outside] = again
        return np.clip(points, lower, upper)
