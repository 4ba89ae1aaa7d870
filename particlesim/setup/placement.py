"""Where particles start: at random without overlap, on a lattice, in a row, in clusters, or where a list says."""

from __future__ import annotations

import math

import numpy as np

from particlesim.geometry.aabb import aabbs_of
from particlesim.scene import Scene
from particlesim.scene.file import SceneError
from particlesim.scene.groups import Group, MeshShape
from particlesim.scene.placements import (
    ClusterPlacement,
    LatticePlacement,
    ListPlacement,
    RandomPlacement,
    Region,
    RowPlacement,
)
from particlesim.setup.overlap_relaxation import Known, push_apart
from particlesim.setup.random_insertion import Insertion, empty_space, refile, try_in_place
from particlesim.setup.rows import on_row
from particlesim.setup.space import Crowd, Space

# Random trials a particle before it finds no room. Equal spheres jam at a fill of 0.38 (J. Feder, J. Theor. Biol. 87
# (1980) 237-254); a fill of 0.3 takes the last of 10^5 of them 6000.
_MAX_TRIALS = 30_000

# Trials a call, where few particles are left and each gets several at once.
_TRIALS_A_CALL = 4096

# A crowd is jammed if, of this many particles or more, doubling the trials finds a place for less than a sixth; looked
# at from _FIRST_LOOK trials on. At a fill of 0.33 it is a quarter, at 0.36 it is less.
_CROWD = 50
_FIRST_LOOK = 128
_PLACED_BY_DOUBLING = 1.0 / 6.0

# To say how much there is room for, particles are made smaller by this factor, again and again, down to _SMALLEST.
_SHRINKAGE, _SMALLEST = 0.97, 0.5


def unit_hint(group: Group) -> str:
    """What may be wrong where particles of a group are too large."""
    in_metres = isinstance(group.shape, MeshShape) and group.shape.unit == "m"
    return '; if the file of the mesh is in millimetres, give its shape unit = "mm"' if in_metres else ""


def positions(
    scene: Scene,
    known: Known,
    world: Space,
    crowd: Crowd,
    orientation: np.ndarray,
    randoms: list[np.random.Generator],
) -> np.ndarray:
    """Positions of all particles of a scene, (n, 3) [m]. SceneError if a group does not fit.

    Lists, rows and lattices come first; the rest is put between them at random, the largest particles first, and not
    into obstacles. What finds no room is put anywhere, and then all that is at random makes room for each other.
    """
    insertion = empty_space(crowd, world, orientation)
    position, level = insertion.body["position"], insertion.body["level"]
    below, above = aabbs_of(known[0], crowd.shape, crowd.size, orientation)
    groups = [np.flatnonzero(crowd.group == g) for g in range(len(scene.particles))]
    for g, (group, members) in enumerate(zip(scene.particles, groups, strict=True)):
        if isinstance(group.placement, ListPlacement):
            position[members] = [pose.position for pose in group.placement.poses]
        elif isinstance(group.placement, RowPlacement):
            position[members], _ = on_row(group.placement, len(members))
        elif isinstance(group.placement, LatticePlacement):
            extent = (above[members] - below[members]).max(axis=0, initial=0.0)
            position[members] = _on_lattice(g, group.placement, world, len(members), extent, randoms[g])
    inserted = {
        g: Trials(scene.key(g), group, group.placement, world, (below, above), members, randoms[g])
        for g, (group, members) in enumerate(zip(scene.particles, groups, strict=True))
        if isinstance(group.placement, RandomPlacement | ClusterPlacement) and len(members)
    }
    in_place, jammed = np.flatnonzero(~np.isin(crowd.group, list(inserted))), []
    for number in range(len(insertion.level) - 1, -1, -1):
        if (level[in_place] < number).any() or number == len(insertion.level) - 1:
            refile(insertion, in_place, number)
        for g, trials in inserted.items():
            members = groups[g][level[groups[g]] == number]
            left = _insert(known, insertion, trials, members)
            if len(left) and isinstance(scene.particles[g].placement, ClusterPlacement):
                raise _no_room_in_clusters(g, scene.particles[g], len(left))
            if len(left):
                position[left] = trials.draw(left)
                jammed.append(g)
            in_place = np.concatenate([in_place, members])
    if jammed:
        factor = _make_room(known, insertion, (below, above), [t for t in inserted.values() if not t.in_clusters])
        if factor < 1.0:
            g = jammed[0]
            raise _no_room(g, scene.particles[g], inserted[g].fill(position, crowd.volume), factor)
    return np.ascontiguousarray(position)


def _insert(known: Known, insertion: Insertion, trials: Trials, left: np.ndarray) -> np.ndarray:
    """Put the particles of ``left`` (m,) at random between those in place; those that found no room."""
    before, look, tried = len(left), _FIRST_LOOK, 0
    while len(left) and tried < _MAX_TRIALS:
        each = max(_TRIALS_A_CALL // len(left), 1)
        proposals = trials.draw(np.repeat(left, each)).reshape(len(left), each, 3)
        left = left[~try_in_place(known, insertion, left, proposals)]
        tried += each
        if tried >= look:
            if look > _FIRST_LOOK and len(left) > max(_CROWD, (1.0 - _PLACED_BY_DOUBLING) * before):
                break
            before, look = len(left), 2 * look
    return left


def _make_room(
    known: Known, insertion: Insertion, extent: tuple[np.ndarray, np.ndarray], at_random: list[Trials]
) -> float:
    """Push apart what is placed ``at_random``. By which factor on its sizes there is room: 1 at its own, 0 if none."""
    body = insertion.body
    position, movable = body["position"], np.zeros(len(body), dtype=np.bool_)
    for trials in at_random:
        movable[trials.members] = True

    def bring_back() -> None:
        for trials in at_random:
            position[trials.members] = trials.bring_back(position[trials.members])

    factor = 1.0
    while not push_apart(known, insertion, extent, movable, bring_back):
        factor *= _SHRINKAGE
        if factor < _SMALLEST:
            return 0.0
        for sizes in (body["scale"], body["radius"], *extent):
            sizes[movable] *= _SHRINKAGE
    return factor


def _no_room(g: int, group: Group, asked: float, factor: float) -> SceneError:
    reached = f"{factor**3 * asked:.2g} is reached" if factor else "next to nothing is reached"
    fills = f"they would fill {asked:.2g} of their room, where {reached}"
    message = f"no room for all of them at random: {fills}: fewer or smaller particles, or more room"
    return SceneError(message, f"particles[{g}].count", group.number)


def _no_room_in_clusters(g: int, group: Group, left: int) -> SceneError:
    none = f"no room for {left:,} of them in clusters, which are filled to about 0.3"
    return SceneError(f"{none}: fewer or smaller particles, a wider spread", f"particles[{g}].count", group.number)


def _bounds(region: Region | None, world: Space) -> tuple[np.ndarray, np.ndarray]:
    if region is None:
        return world.lower, world.upper
    return np.array(region.lower), np.array(region.upper)


def lattice_points(lower: np.ndarray, upper: np.ndarray, count: int, spacing: float | None) -> tuple[np.ndarray, float]:
    """The first ``count`` points of a simple cubic lattice centred in a box, from the bottom up, and its spacing [m].

    Without a spacing the widest is taken that has enough points. Fewer points come back if the box holds no more.
    """
    edges = upper - lower
    if spacing is None:
        # No spacing above the first holds one point across and enough in all; half of it always does.
        most = min(edges.min(), (edges / count ** (1.0 / 3.0)).prod() ** (1.0 / 3.0))
        least = 0.5 * most
        for _ in range(60):
            middle = 0.5 * (least + most)
            enough = np.floor(edges / middle + 1e-9).prod() >= count
            least, most = (middle, most) if enough else (least, middle)
        spacing = float((edges / np.floor(edges / least + 1e-9)).min())
    along = np.maximum(np.floor(np.minimum(edges / spacing + 1e-9, count)), 0).astype(np.int64)
    number = np.arange(min(count, math.prod(along.tolist())))
    x, y, z = number % along[0], number // along[0] % along[1], number // (along[0] * along[1])
    points = 0.5 * (lower + upper) + (np.column_stack([x, y, z]) - 0.5 * (along - 1)) * spacing
    return points, spacing


def _on_lattice(
    g: int,
    lattice: LatticePlacement,
    world: Space,
    count: int,
    extent: np.ndarray,
    random: np.random.Generator,
) -> np.ndarray:
    """Lattice points, jittered within the gaps that particles of extent ``extent`` (3,) leave."""
    lower, upper = _bounds(lattice.region, world)
    points, spacing = np.zeros((0, 3)), 1.0
    if count and _is_round(lattice.region):
        points, spacing = _round_lattice(lower, upper, count, lattice.spacing, extent)
    elif count:
        points, spacing = lattice_points(lower, upper, count, lattice.spacing)
    if len(points) < count and lattice.spacing is not None:
        message = f"makes a lattice of {len(points):,} points here, for {count:,} particles"
        raise SceneError(message, f"particles[{g}].placement.spacing", lattice.spacing)
    if (extent > spacing).any():
        span = f"the particles span {extent.max():.4g} m"
        if lattice.spacing is None:
            message = f"a lattice of so many points has a spacing of {spacing:.4g} m, but {span}"
            raise SceneError(message, f"particles[{g}].count", count)
        raise SceneError(f"too tight: {span}", f"particles[{g}].placement.spacing", lattice.spacing)
    moved = points + random.uniform(-0.5, 0.5, points.shape) * (lattice.jitter * (spacing - extent))
    if _is_round(lattice.region):
        outside = from_middle(moved, lower + 0.5 * extent, upper - 0.5 * extent) > 1.0
        moved[outside] = points[outside]
    return moved


def _round_lattice(
    lower: np.ndarray, upper: np.ndarray, count: int, spacing: float | None, extent: np.ndarray
) -> tuple[np.ndarray, float]:
    """As ``lattice_points``, but those nearest to the middle of an ellipsoid in a box; particles span ``extent`` (3,).

    Without a spacing, fewer come back only if the last one tried is too tight for the particles.
    """
    edges = upper - lower
    tried = spacing or float((np.pi / 6.0 * edges.prod() / count) ** (1.0 / 3.0))
    while True:
        points, _ = lattice_points(lower, upper, np.iinfo(np.int64).max, tried)
        distance = from_middle(points, lower + 0.5 * extent, upper - 0.5 * extent)
        inside = np.argsort(distance, kind="stable")[: min(count, int(np.count_nonzero(distance <= 1.0)))]
        if len(inside) == count or spacing is not None or (extent > tried).any():
            return points[np.sort(inside)], tried
        tried *= 0.995


def _is_round(region: Region | None) -> bool:
    return region is not None and region.form == "ellipsoid"


def from_middle(points: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Distance of points (m, 3) from the middle of a box, 1 on the ellipsoid that just fits into it."""
    # One of no extent has its middle only; what is off it is far away, by a number that has a square.
    half = np.maximum(0.5 * (upper - lower), 1e-100)
    return np.linalg.norm((points - 0.5 * (lower + upper)) / half, axis=-1)


def _centres(
    key: str,
    where: ClusterPlacement,
    bounds: tuple[np.ndarray, np.ndarray],
    particles: int,
    random: np.random.Generator,
) -> np.ndarray:
    """Centres of the clusters, (clusters, 3) [m], but no more than there are ``particles`` to be about them."""
    lower, upper = bounds
    is_round = _is_round(where.region)
    number = min(where.clusters or 1, particles)
    if where.centres is None and is_round:
        displacement = random.normal(size=(number, 3))
        displacement *= random.uniform(size=(number, 1)) ** (1.0 / 3.0) / np.linalg.norm(
            displacement, axis=1, keepdims=True
        )
        return 0.5 * (lower + upper) + 0.5 * (upper - lower) * displacement
    if where.centres is None:
        return random.uniform(lower, upper, (number, 3))
    for k, centre in enumerate(where.centres):
        outside = (np.array(centre) < lower).any() or (np.array(centre) > upper).any()
        if outside or (is_round and from_middle(np.array(centre), lower, upper) > 1.0):
            raise SceneError("lies outside of where its particles may be", f"{key}.placement.centres[{k}]", centre)
    return np.array(where.centres)


class Trials:
    """Random proposals for the positions of a group's particles, which stands under ``key`` of a scene.

    ``extent`` are the lower and upper corners of all particles' AABBs relative to their centroids, (n, 3) each [m];
    ``members`` (m,) the particles of the group.
    """

    def __init__(
        self,
        key: str,
        group: Group,
        where: RandomPlacement | ClusterPlacement,
        world: Space,
        extent: tuple[np.ndarray, np.ndarray],
        members: np.ndarray,
        random: np.random.Generator,
    ) -> None:
        self._where, self._random = where, random
        self.members, self.in_clusters = members, isinstance(where, ClusterPlacement)
        lower, upper = self._bounds = _bounds(where.region, world)
        # A particle stays within its region, but where a region spans a periodic world only its centre does.
        self._free = (world.period > 0.0) & (lower <= world.lower) & (upper >= world.upper)
        self._extent = extent
        self._centres = np.zeros((0, 3))
        if isinstance(where, ClusterPlacement):
            self._centres = _centres(key, where, (lower, upper), int(members.max()) + 1, random)
        self._too_large = "too large: there are particles wider than the region they are placed in" + unit_hint(group)
        self._key = f"{key}.size"

    def draw(self, indices: np.ndarray) -> np.ndarray:
        """A position for each particle of ``indices`` (m,), (m, 3)."""
        lower, upper = self._bounds_of(indices)
        if (lower > upper).any():
            raise SceneError(self._too_large, self._key)
        points = self._proposed(indices, lower, upper)
        is_round = _is_round(self._where.region)
        # What falls outside is drawn again, so that the cluster is cut off rather than piled up at the wall.
        for _ in range(100):
            outside = ((points < lower) | (points > upper)).any(axis=1)
            if is_round:
                outside |= from_middle(points, lower, upper) > 1.0
            if not outside.any():
                return points
            points[outside] = self._proposed(indices[outside], lower[outside], upper[outside])
        return self._cut_off(points, lower, upper)

    def bring_back(self, points: np.ndarray) -> np.ndarray:
        """Positions (m, 3) of the members, or the nearest to them where they may be."""
        back = self._cut_off(points, *self._bounds_of(self.members))
        return back if _is_round(self._where.region) else np.where(self._free, points, back)

    def fill(self, position: np.ndarray, volume: np.ndarray) -> float:
        """Which part of the region is filled by particles at ``position`` (n, 3) [m], of ``volume`` (n,) [m^3]."""
        lower, upper = self._bounds
        inside, room = ((position >= lower) & (position <= upper)).all(axis=1), (upper - lower).prod()
        if _is_round(self._where.region):
            inside, room = from_middle(position, lower, upper) <= 1.0, room * np.pi / 6.0
        return float(volume[inside].sum() / room)

    def _bounds_of(self, indices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Corners of the boxes that centroids of particles ``indices`` (m,) may be in, (m, 3) each [m]."""
        below, above = (np.where(self._free, 0.0, extent[indices]) for extent in self._extent)
        return self._bounds[0] - below, self._bounds[1] - above

    def _cut_off(self, points: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
        """Points (m, 3), those outside moved to where the region ends."""
        points = np.clip(points, lower, upper)
        if _is_round(self._where.region):
            middle = 0.5 * (lower + upper)
            points = middle + (points - middle) / np.maximum(from_middle(points, lower, upper), 1.0)[:, None]
        return points

    def _proposed(self, indices: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
        if isinstance(self._where, RandomPlacement):
            return self._random.uniform(lower, upper)
        centre = self._centres[indices % len(self._centres)]
        return centre + self._where.spread * self._random.normal(size=(len(indices), 3))
