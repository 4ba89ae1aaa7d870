"""From a scene to arrays: the one gate where values are checked and types are settled."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from particlesim.broad_phase import find_pairs
from particlesim.core.constants import OPEN, PERIODIC, WALL, WALL_NAMES
from particlesim.geometry.mesh_table import stack_meshes
from particlesim.geometry.shape_table import stack_shapes
from particlesim.geometry.shapes import Shape, half_space
from particlesim.model.bodies import make_particles
from particlesim.model.domain import make_domain, make_walls, wall_normals
from particlesim.model.materials import Material, PairLaw, contact_laws
from particlesim.model.overlap import separation_of, touching_pairs, touching_surroundings
from particlesim.model.prescribed_motion import place_kinematic
from particlesim.model.system import Model, System, make_system
from particlesim.scene import Scene
from particlesim.scene.file import SceneError
from particlesim.scene.groups import FixedSize, Group
from particlesim.scene.placements import ListPlacement, RowPlacement
from particlesim.scene.surface import WALLS
from particlesim.setup.fields import fields_of
from particlesim.setup.initial_motion import random_quaternions, set_in_motion
from particlesim.setup.limits import DEFAULT_DENSITY, check_fill
from particlesim.setup.memory import check_memory
from particlesim.setup.obstacles import Obstacle, obstruct
from particlesim.setup.orientations import of_body_axes, quaternion_of
from particlesim.setup.placement import positions, unit_hint
from particlesim.setup.rows import turned_along
from particlesim.setup.scene_obstacles import drawn_shapes, material_of, obstacles_of
from particlesim.setup.shape_reading import shape_of
from particlesim.setup.space import Crowd, Space

# Particles that a list puts into each other deeper than this fraction of their sizes are refused.
_TOLERATED_OVERLAP = 1e-9

_BOUNDARIES = {"wall": WALL, "periodic": PERIODIC, "open": OPEN}


def build(scene: Scene, obstacles: Sequence[Obstacle] = ()) -> Model:
    """The model that a simulation of ``scene``, with more ``obstacles``, starts from.

    SceneError if something does not fit or cannot be read.
    """
    check_memory(scene.number)
    randoms = [np.random.default_rng([scene.seed, g]) for g in range(len(scene.groups))]
    shapes, shape_of_group = _shapes(scene)
    domain = build_domain(scene)
    particles = _particles(scene, shapes, shape_of_group, randoms)
    _check_sizes(scene, domain[0], particles)
    particles["orientation"] = _orientations(scene, shapes, particles, randoms)
    to_come = particles[particles["group"] >= len(scene.particles)]
    particles = particles[particles["group"] < len(scene.particles)]
    volume = _volumes(shapes, particles)
    check_fill(scene, float(volume.sum()) / math.prod(scene.world.size))
    own = obstacles_of(scene)
    model = assemble(shapes, particles, domain, materials_of(scene), [*own, *obstacles], pair_laws_of(scene))
    model = model._replace(obstacle_shapes=drawn_shapes(scene, own), fields=fields_of(scene))
    set_in_motion(scene, to_come, randoms)
    crowd = Crowd(
        shape=np.ascontiguousarray(particles["shape_row"]),
        group=np.ascontiguousarray(particles["group"]),
        size=np.ascontiguousarray(particles["scale"]),
        radius=np.ascontiguousarray(particles["radius"]),
        volume=volume,
    )
    particles = model.particles
    place_kinematic(model.system.body, model.system.motion, 0.0)
    table = model.system.shapes, model.system.meshes, obstacles_among(model.system)
    particles["position"] = positions(
        scene, table, space_of(domain), crowd, np.ascontiguousarray(particles["orientation"]), randoms
    )
    set_in_motion(scene, particles, randoms)
    _check_apart(scene, model.system)
    return model._replace(population=np.concatenate([particles, to_come])) if scene.is_open else model


def assemble(
    shapes: list[Shape],
    particles: np.ndarray,
    domain: np.ndarray,
    materials: list[Material],
    obstacles: Sequence[Obstacle] = (),
    pair_laws: Sequence[PairLaw] = (),
) -> Model:
    """A model of particles (n,) BODY in a domain, (1,) DOMAIN, with its walls and other obstacles.

    The first of the ``materials`` is that of the walls, the others those of the particles.
    """
    walls = [half_space(tuple(normal)) for normal in wall_normals().tolist()]
    all_shapes = [*shapes, *walls, *(obstacle.shape for obstacle in obstacles)]
    others = obstruct(obstacles, len(shapes) + len(walls), len(materials))
    materials = [*materials, *(obstacle.material for obstacle in obstacles)]
    surroundings = np.concatenate([make_walls(domain, len(shapes)), others.surroundings])
    system = make_system(
        stack_shapes(all_shapes),
        particles,
        others.bounded,
        surroundings,
        law=contact_laws(materials, pair_laws),
        motion=others.motion,
        domain=domain,
        meshes=stack_meshes(all_shapes),
    )
    return Model(tuple(shapes), np.array([material.restitution for material in materials]), system)


def materials_of(scene: Scene) -> list[Material]:
    """The material of the walls, then that of each group."""
    return [material_of(scene, said) for said in (scene.world, *scene.groups)]


def contact_laws_of(scene: Scene) -> np.ndarray:
    """The contact laws of a scene's walls, groups and obstacles, (m, m) CONTACT_LAW."""
    return contact_laws(
        [*materials_of(scene), *(material_of(scene, said) for said in scene.obstacles)], pair_laws_of(scene)
    )


def pair_laws_of(scene: Scene) -> list[PairLaw]:
    """What the scene says of contacts between two of the materials."""
    names = [*(group.name for group in scene.groups), *(obstacle.name for obstacle in scene.obstacles)]
    row = {WALLS: 0, **{name: k for k, name in enumerate(names, 1) if name is not None}}
    between = ((contact.between, contact.surface) for contact in scene.contact)
    return [PairLaw(row[a], row[b], values) for (a, b), values in between]


def build_domain(scene: Scene) -> np.ndarray:
    """The domain of a scene, (1,) DOMAIN."""
    boundary = np.array([_BOUNDARIES[name] for name in scene.world.boundary])
    gravity = np.array(scene.world.gravity, dtype=np.float64)
    return make_domain(np.array(scene.world.size), boundary, gravity)


def space_of(domain: np.ndarray) -> Space:
    """A domain as placing takes it."""
    return Space(*(domain[0][name].copy() for name in ("lower", "upper", "boundary", "period")))


def _key(scene: Scene, g: int, key: str) -> str:
    return f"{scene.key(g)}.{key}"


def _shapes(scene: Scene) -> tuple[list[Shape], list[int]]:
    """The different shapes of a scene, and which of them each group has."""
    shapes: list[Shape] = []
    numbers: dict[str, int] = {}
    of_group = []
    for g, group in enumerate(scene.groups):
        shape = shape_of(group.shape, _key(scene, g, "shape"))
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


def _particles(
    scene: Scene, shapes: list[Shape], shape_of_group: list[int], randoms: list[np.random.Generator]
) -> np.ndarray:
    """The particles of a scene, (n,) BODY, not placed yet."""
    counts = [group.number for group in scene.groups]
    group_of = np.repeat(np.arange(len(counts)), counts)
    shape = np.array(shape_of_group)[group_of]
    size = np.concatenate([_sizes(g, r) for g, r in zip(scene.groups, randoms, strict=True)])
    volume = np.array([s.volume for s in shapes])[shape] * size**3
    density = np.array([DEFAULT_DENSITY if g.density is None else g.density for g in scene.groups])[group_of]
    mass = np.array([math.nan if g.mass is None else g.mass for g in scene.groups])[group_of]
    density = np.where(np.isnan(mass), density, mass / volume)
    return make_particles(shapes, shape, group_of, size, density)


def _check_sizes(scene: Scene, domain: np.void, particles: np.ndarray) -> None:
    """Walls must leave room, and a particle must not meet itself round a periodic domain."""
    for g, group in enumerate(scene.groups):
        members = particles["group"] == g
        value = group.size.value if isinstance(group.size, FixedSize) else None
        widest = 2.0 * particles["radius"][members].max(initial=0.0)
        narrowest = 2.0 * particles["inradius"][members].max(initial=0.0)
        for axis, edge in enumerate(domain["upper"] - domain["lower"]):
            wrong = None
            if domain["boundary"][axis] == PERIODIC and widest >= 0.5 * edge:
                wrong = (
                    f"too large: particles span {widest:.4g} m; "
                    f"in a periodic world they must span less than half of it, {0.5 * edge:.4g} m"
                )
            elif domain["boundary"][axis] == WALL and narrowest > edge:
                wrong = f"too large: particles are {narrowest:.4g} m thick, between walls {edge:.4g} m apart"
            if wrong is not None:
                raise SceneError(wrong + unit_hint(group), _key(scene, g, "size"), value)


def _volumes(shapes: list[Shape], particles: np.ndarray) -> np.ndarray:
    """Volumes of particles (n,) BODY, (n,) [m^3]."""
    return np.array([s.volume for s in shapes])[particles["shape_row"]] * particles["scale"] ** 3


def _orientations(
    scene: Scene, shapes: list[Shape], particles: np.ndarray, randoms: list[np.random.Generator]
) -> np.ndarray:
    """Orientations of all particles, (n, 4)."""
    parts = [np.zeros((0, 4))]
    for g, (group, random) in enumerate(zip(scene.groups, randoms, strict=True)):
        listed = isinstance(group.placement, ListPlacement)
        if isinstance(group.placement, ListPlacement):
            q = np.array([quaternion_of(pose.orientation) for pose in group.placement.poses])
        elif group.orientation == "random":
            q = random_quaternions(random, group.number)
        else:
            q = np.tile(quaternion_of(group.orientation), (group.number, 1))
            q = turned_along(group.placement, q) if isinstance(group.placement, RowPlacement) else q
        if group.number and (listed or group.orientation != "random"):
            q = of_body_axes(q, shapes[int(particles["shape_row"][particles["group"] == g][0])])
        parts.append(q)
    return np.ascontiguousarray(np.concatenate(parts))


def _check_apart(scene: Scene, system: System) -> None:
    """No particle may start inside another, an obstacle or outside a wall; touching is allowed."""
    bounded = system.body[: system.bounded]
    reach = bounded["radius"][:, None]
    pairs = find_pairs(bounded["position"] - reach, bounded["position"] + reach, period=system.domain[0]["period"])
    pairs = pairs[pairs[:, 0] < system.particles]
    for contacts in (touching_surroundings(system), touching_pairs(system, pairs)):
        for i, j in contacts.tolist():
            separation = separation_of(system, i, j)
            if separation < -_TOLERATED_OVERLAP * system.body["radius"][i]:
                deep = f"{-separation:.3g} m"
                wall, entry = system.body["wall"][j], system.body["entry"][j]
                if wall >= 0:
                    raise _start_error(scene, system.body, i, f"sticks {deep} through the {WALL_NAMES[wall]} wall")
                if entry >= 0:
                    raise _start_error(scene, system.body, i, f"starts {deep} inside {_obstacle_name(scene, entry)}")
                g, k = _place_in_group(system.body, j)
                raise _start_error(scene, system.body, i, f"starts {deep} inside particle {k} of particles[{g}]")


def _obstacle_name(scene: Scene, k: int) -> str:
    """What to call an obstacle of a scene, or one that was added from Python."""
    name = scene.obstacles[k].name if k < len(scene.obstacles) else None
    return f"obstacles[{k}]" if name is None else f"obstacles[{k}] ({name})"


def obstacles_among(system: System) -> np.ndarray:
    """The bodies that are neither particles nor walls, (k,) BODY."""
    others = system.body[system.particles :]
    return others[others["wall"] < 0]


def _start_error(scene: Scene, body: np.ndarray, i: int, wrong: str) -> SceneError:
    """What is wrong with where particle ``i`` starts, said of what put it there."""
    g, k = _place_in_group(body, i)
    placement = scene.particles[g].placement
    if isinstance(placement, ListPlacement):
        return SceneError(wrong, _key(scene, g, f"placement.poses[{k}].position"), placement.poses[k].position)
    return SceneError(f"particle {k} {wrong}", _key(scene, g, "placement"))


def _place_in_group(body: np.ndarray, i: int) -> tuple[int, int]:
    """Group of particle ``i`` and its number there."""
    g = int(body["group"][i])
    return g, i - int(np.flatnonzero(body["group"] == g)[0])
