"""What is seen at each pixel, ray by ray: an independent answer to ``particlesim.rendering.visibility``."""

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from particlesim.core.constants import SPHERE
from particlesim.geometry import shapes
from particlesim.rendering.visibility.geometry_tables import geometry_tables
from particlesim.rendering.visibility.instances import Instances
from particlesim.rendering.visibility.occlusion_clusters import occlusion_clusters
from particlesim.rendering.visibility.projection import Projection
from particlesim.trajectory.frames import Header

KINDS = (
    shapes.sphere(),
    shapes.cube(),
    shapes.pyramid(),
    shapes.capsule(0.8),
    shapes.box((0.8, 0.6, 0.4), rounding=0.1),
    shapes.pyramid(0.5, rounding=0.02),
    shapes.tetrahedron(rounding=0.3),
)


class Crowd(NamedTuple):
    """Particles of KINDS: ``number`` (n,) of their kind, ``size`` (n,), ``position`` (n, 3), ``orientation`` (n, 4)."""

    number: np.ndarray
    size: np.ndarray
    position: np.ndarray
    orientation: np.ndarray

    @property
    def tables(self):
        """As the rasteriser wants them."""
        n = len(self.size)
        return geometry_tables(Header("", KINDS, self.number, self.size, self.number, np.ones(n), np.ones((n, 3))))

    @property
    def instances(self):
        """As the rasteriser wants them."""
        return Instances(self.position, self.orientation, self.tables)

    @property
    def scene(self):
        """The other arguments that ``rasterise`` wants."""
        return self.instances, occlusion_clusters(self.position, self.tables.radius)

    def only(self, indices):
        """Some of them, in the order given."""
        return Crowd(*(of_all[indices] for of_all in self))


def crowd(seed, count, edge, low, high, kinds=3):
    """Particles of sizes ``low`` to ``high`` anywhere in a cube about the origin, turned at random."""
    random = np.random.default_rng(seed)
    turn = random.normal(size=(count, 4))
    return Crowd(
        np.arange(count) % kinds,
        random.uniform(low, high, count),
        random.uniform(-0.5 * edge, 0.5 * edge, (count, 3)),
        turn / np.linalg.norm(turn, axis=1, keepdims=True),
    )


def projection(eye, target=(0.0, 0.0, 0.0), parallel=False, scale=60.0, size=(83, 61), roll=0.3):
    """A view from ``eye`` to ``target``, rolled by an angle ``roll`` [rad]."""
    away = np.subtract(target, eye) / np.linalg.norm(np.subtract(target, eye))
    right = np.cross(away, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    right = np.cos(roll) * right + np.sin(roll) * np.cross(right, away)
    return Projection(np.array([right, np.cross(right, away), away]), np.asarray(eye, float), parallel, scale, size)


def rays(view):
    """Start and way of the ray through each pixel, both (height, width, 3) along the view's axes, lowest row first."""
    width, height = view.size
    across = (np.arange(width) + 0.5 - 0.5 * width) / view.scale
    up = (np.arange(height) + 0.5 - 0.5 * height) / view.scale
    aside = np.zeros((height, width, 3))
    aside[..., 0], aside[..., 1] = np.meshgrid(across, up)
    ahead = np.broadcast_to([0.0, 0.0, 1.0], aside.shape)
    return (aside, ahead) if view.parallel else (np.zeros_like(aside), aside + ahead)


def distances(view, crowd):
    """Distance along the axis (n, height, width) at which each particle is met, inf where not; see ``rasterise``.

    Rounded shapes are met where they are: not so in the shadow map.
    """
    width, height = view.size
    middle = (crowd.position - view.eye) @ view.axes.T
    met = np.full((len(middle), height, width), np.inf)
    for i, kind in enumerate(crowd.number):
        shape, size = KINDS[kind], crowd.size[i]
        if shape.kind == SPHERE:
            met[i] = _ball(view, *rays(view), middle[i], 0.5 * size)
        elif shape.rounding > 0.0:
            met[i], _ = onto(view, *rays(view), middle[i], shape, size, crowd.orientation[i])
        else:
            enter, leave, _ = through(view, *rays(view), middle[i], shape, size, crowd.orientation[i])
            if view.parallel:
                met[i] = np.where(enter <= leave, leave, np.inf)
            else:  # before the eye, and not about it
                met[i] = np.where((enter <= leave) & (enter > 0.0), enter, np.inf)
    return met


def _ball(view, start, way, middle, radius):
    if view.parallel:  # a disc
        return np.where(((start - middle)[..., :2] ** 2).sum(axis=-1) <= radius**2, middle[2], np.inf)
    if np.linalg.norm(middle) <= radius:  # none from within
        return np.full(way.shape[:2], np.inf)
    long = np.linalg.norm(way, axis=-1)
    along = way @ middle / long
    apart = middle - (along / long)[..., None] * way
    half = radius**2 - (apart**2).sum(axis=-1)
    return np.where((half >= 0.0) & (along > 0.0), (along - np.sqrt(np.maximum(half, 0.0))) / long, np.inf)


def through(view, start, way, middle, shape, size, turn):
    """Where rays pass into a hull and out of it, and the face by which they come in, each (height, width).

    The half-spaces of its faces cut them off one by one.
    """
    enter, leave = np.full(way.shape[:2], -np.inf), np.full(way.shape[:2], np.inf)
    face = np.full(way.shape[:2], -1)
    turned = Rotation.from_quat(np.roll(turn, -1)).as_matrix()
    for number, (normal, loop) in enumerate(zip(shape.face_normals, shape.faces, strict=True)):
        outward = view.axes @ turned @ normal
        before = outward @ middle + size * (normal @ shape.vertices[loop[0]]) - start @ outward
        into = way @ outward
        with np.errstate(divide="ignore"):
            cut = before / into
        face = np.where((into < 0.0) & (cut > enter), number, face)
        enter = np.where(into < 0.0, np.maximum(enter, cut), enter)
        leave = np.where(into > 0.0, np.minimum(leave, cut), leave)
    return enter, leave, face


def onto(view, start, way, middle, shape, size, turn):
    """Where rays meet a rounded shape, inf where not or from within, and its normal there along the view's axes.

    Distance from a convex core is a convex function along a ray: Newton's method from outside never goes too far.
    """
    to_view = view.axes @ Rotation.from_quat(np.roll(turn, -1)).as_matrix()
    at, way = (start - middle) @ to_view / size, way @ to_view / size
    square = (way**2).sum(axis=-1)
    nearest = -(at * way).sum(axis=-1) / square
    half = shape.radius**2 - ((at + nearest[..., None] * way) ** 2).sum(axis=-1)
    met, normal = np.full(at.shape[:2], np.inf), np.zeros(at.shape)
    near = half >= 0.0
    at, way = at[near], way[near]
    t = nearest[near] - np.sqrt(half[near] / square[near])
    t = t if view.parallel else np.maximum(t, 0.0)
    gap, outward = from_core(shape, at + t[:, None] * way)
    going = np.flatnonzero(gap > shape.rounding - 1e-9)
    hit = np.full(len(t), False)
    for _ in range(60):
        distance, outward[going] = from_core(shape, at[going] + t[going, None] * way[going])
        gap, slope = distance - shape.rounding, (outward[going] * way[going]).sum(axis=-1)
        hit[going] = np.abs(gap) < 1e-9
        on = (np.abs(gap) > 1e-13) & (slope < 0.0)
        going, step = going[on], gap[on] / slope[on]
        t[going] -= step
    met[near], normal[near] = np.where(hit, t, np.inf), outward @ to_view.T
    return met, normal


def from_core(shape, points):
    """Distance (k,) of points (k, 3) from the core of a shape, 0 within it, and the direction away from it (k, 3)."""
    least, away = np.full(len(points), np.inf), np.zeros(points.shape)
    within = np.full(len(points), len(shape.faces) > 0)

    def nearer(arm, where):
        distance = np.where(where, np.linalg.norm(arm, axis=1), np.inf)
        away[distance < least] = (arm / np.linalg.norm(arm, axis=1, keepdims=True))[distance < least]
        np.minimum(least, distance, out=least)

    with np.errstate(invalid="ignore", divide="ignore"):
        for normal, loop in zip(shape.face_normals, shape.faces, strict=True):
            corners = shape.vertices[list(loop)]
            inward = np.cross(normal, np.roll(corners, -1, axis=0) - corners)
            high = (points - corners[0]) @ normal
            over = (points @ inward.T >= (corners * inward).sum(axis=1)).all(axis=1)
            nearer(high[:, None] * normal, over & (high > 0.0))
            within &= high <= 0.0
        for a, b, _, _ in shape.edges:
            arm, along = points - shape.vertices[a], shape.vertices[b] - shape.vertices[a]
            nearer(arm - np.clip(arm @ along / (along @ along), 0.0, 1.0)[:, None] * along, np.full(len(points), True))
    return np.where(within, 0.0, least), away
