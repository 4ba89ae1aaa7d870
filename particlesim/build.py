"""From a scene to arrays: the one gate where values are checked and types are settled."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from particlesim.broad_phase import find_pairs
from particlesim.constants import MAX_MANIFOLD, OPEN, PERIODIC, WALL, WALL_NAMES
from particlesim.launch import initial_state, random_quaternions
from particlesim.narrow_phase.contacts import contact_now, touching_pairs, touching_walls
from particlesim.placement import positions
from particlesim.scene import Scene
from particlesim.scene.file import SceneError
from particlesim.scene.groups import FixedSize, Group, ListPlacement, MeshShape, Turn
from particlesim.shapes import CATALOGUE, Shape
from particlesim.state import Constants, ShapeTable, State, World, particle_constants, stack_shapes

# Density of particles that give neither density nor mass: water [kg/m^3].
_DEFAULT_DENSITY = 1000.0

# Particles that a list puts into each other deeper than this fraction of their sizes are refused.
_TOLERATED_OVERLAP = 1e-9

_BOUNDARIES = {"wall": WALL, "periodic": PERIODIC, "open": OPEN}


class Built(NamedTuple):
    """A scene as arrays."""

    shapes: tuple[Shape, ...]
    table: ShapeTable
    world: World
    constants: Constants
    state: State


def build(scene: Scene) -> Built:
    """The arrays a simulation of ``scene`` starts from. SceneError if something does not fit or cannot be read."""
    randoms = [np.random.default_rng([scene.seed, g]) for g in range(len(scene.particles))]
    shapes, shape_of_group = _shapes(scene)
    table = stack_shapes(shapes)
    world = build_world(scene)
    constants = _constants(scene, shapes, shape_of_group, randoms)
    _check_sizes(scene, world, constants)
    orientation = _orientations(scene, shapes, constants, randoms)
    position = positions(scene, table, world, constants, orientation, randoms)
    state = initial_state(scene, constants, position, orientation, randoms)
    _check_apart(table, world, constants, state)
    return Built(tuple(shapes), table, world, constants, state)


def build_world(scene: Scene) -> World:
    """The world of a scene as arrays."""
    half = 0.5 * np.array(scene.world.size)
    boundary = np.array([_BOUNDARIES[name] for name in scene.world.boundary])
    return World(
        lower=-half,
        upper=half,
        boundary=boundary,
        period=np.where(boundary == PERIODIC, 2.0 * half, 0.0),
        gravity=np.array(scene.world.gravity, dtype=np.float64),
        restitution=float(scene.world.restitution),
    )


def _key(group: int, key: str) -> str:
    return f"particles[{group}].{key}"


def _shapes(scene: Scene) -> tuple[list[Shape], list[int]]:
    """The different shapes of a scene, and which of them each group has."""
    shapes: list[Shape] = []
    numbers: dict[str, int] = {}
    of_group = []
    for g, group in enumerate(scene.particles):
        parameters = group.shape.model_dump(exclude={"kind"})
        if isinstance(group.shape, MeshShape):
            parameters["file"] = scene.folder / group.shape.file
        try:
            shape = CATALOGUE[group.shape.kind](**parameters)
        except (OSError, ValueError) as error:
            raise SceneError(str(error), _key(g, "shape")) from None
        if shape.inradius <= 0.0:
            raise SceneError("is too flat to be a body", _key(g, "shape"))
        name = group.shape.model_dump_json()
        if name not in numbers:
            numbers[name] = len(shapes)
            shapes.append(shape)
        of_group.append(numbers[name])
    return shapes, of_group


def _sizes(group: Group, random: np.random.Generator) -> np.ndarray:
    """Sizes of a group's particles, (count,)."""
    if isinstance(group.size, FixedSize):
        return np.full(group.number, group.size.value)
    if group.size.kind == "uniform":
        return random.uniform(group.size.low, group.size.high, group.number)
    return np.exp(random.uniform(math.log(group.size.low), math.log(group.size.high), group.number))


def _constants(
    scene: Scene, shapes: list[Shape], shape_of_group: list[int], randoms: list[np.random.Generator]
) -> Constants:
    counts = [group.number for group in scene.particles]
    group_of = np.repeat(np.arange(len(counts)), counts)
    shape = np.array(shape_of_group)[group_of]
    size = np.concatenate([_sizes(g, r) for g, r in zip(scene.particles, randoms, strict=True)])
    volume = np.array([s.volume for s in shapes])[shape] * size**3
    density = np.array([_DEFAULT_DENSITY if g.density is None else g.density for g in scene.particles])[group_of]
    mass = np.array([math.nan if g.mass is None else g.mass for g in scene.particles])[group_of]
    density = np.where(np.isnan(mass), density, mass / volume)
    usual = scene.world.restitution
    restitution = np.array([usual if g.restitution is None else g.restitution for g in scene.particles])
    return particle_constants(shapes, shape, group_of, size, density, restitution[group_of])


def _check_sizes(scene: Scene, world: World, constants: Constants) -> None:
    """Walls must leave room, and a particle must not meet itself round a periodic world."""
    for g in range(len(scene.particles)):
        members = constants.group == g
        widest = 2.0 * constants.radius[members].max(initial=0.0)
        narrowest = 2.0 * constants.inradius[members].max(initial=0.0)
        for axis, edge in enumerate(world.upper - world.lower):
            if world.boundary[axis] == PERIODIC and widest >= 0.5 * edge:
                message = f"must span less than half of the periodic world, {0.5 * edge:g} m; it spans {widest:g} m"
                raise SceneError(message, _key(g, "size"))
            if world.boundary[axis] == WALL and narrowest > edge:
                raise SceneError(
                    f"is {narrowest:g} m thick and does not fit between walls {edge:g} m apart", _key(g, "size")
                )


def _quaternion(orientation: tuple[float, ...] | Turn) -> np.ndarray:
    """A scene's orientation as a unit quaternion (w, x, y, z)."""
    if isinstance(orientation, Turn):
        axis = np.array(orientation.axis) / np.linalg.norm(orientation.axis)
        half = 0.5 * math.radians(orientation.angle)
        return np.concatenate([[math.cos(half)], math.sin(half) * axis])
    return np.array(orientation) / np.linalg.norm(orientation)


def _turned(q: np.ndarray, into: np.ndarray) -> np.ndarray:
    """Orientations (k, 4) of the described axes as orientations of the body axes that ``into`` turns into them."""
    product = Rotation.from_quat(np.roll(q, -1, axis=-1)) * Rotation.from_quat(np.roll(into, -1))
    return np.roll(product.as_quat(), 1, axis=-1)


def _orientations(
    scene: Scene, shapes: list[Shape], constants: Constants, randoms: list[np.random.Generator]
) -> np.ndarray:
    """Orientations of all particles, (n, 4)."""
    parts = [np.zeros((0, 4))]
    for g, (group, random) in enumerate(zip(scene.particles, randoms, strict=True)):
        listed = isinstance(group.placement, ListPlacement)
        if isinstance(group.placement, ListPlacement):
            q = np.array([_quaternion(pose.orientation) for pose in group.placement.poses])
        elif group.orientation == "random":
            q = random_quaternions(random, group.number)
        elif group.orientation == "aligned":
            q = np.tile([1.0, 0.0, 0.0, 0.0], (group.number, 1))
        else:
            q = np.tile(_quaternion(group.orientation), (group.number, 1))
        frame = shapes[int(constants.shape[constants.group == g][0])].orientation if group.number else None
        if frame is not None and frame[0] != 1.0 and (listed or group.orientation != "random"):
            q = _turned(q, frame)
        parts.append(q)
    return np.ascontiguousarray(np.concatenate(parts))


def _check_apart(table: ShapeTable, world: World, constants: Constants, state: State) -> None:
    """No particle may start inside another or outside a wall; touching is allowed."""
    reach = constants.radius[:, None]
    pairs = find_pairs(state.position - reach, state.position + reach, period=world.period)
    everyone = np.ones(len(constants.mass), dtype=np.bool_)
    points = np.empty((MAX_MANIFOLD, 3))
    for contacts in (
        touching_pairs(table, world, constants, state, pairs, everyone),
        touching_walls(table, world, constants, state, everyone),
    ):
        for i, j in contacts.tolist():
            separation, _, _, _ = contact_now(table, world, constants, state, i, j, points)
            if separation < -_TOLERATED_OVERLAP * constants.radius[i]:
                other = _name(constants, j) if j >= 0 else f"the {WALL_NAMES[-1 - j]} wall"
                raise SceneError(f"{_name(constants, i)} starts {-separation:.3g} m deep in {other}", "particles")


def _name(constants: Constants, i: int) -> str:
    """A particle as its scene knows it."""
    group = int(constants.group[i])
    first = int(np.searchsorted(constants.group, group))
    return f"particle {i - first} of particles[{group}]"
