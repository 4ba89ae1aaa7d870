"""Who sees what, told ray by ray: an independent answer to ``particlesim.rendering.visibility``."""

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from particlesim.core.constants import SPHERE
from particlesim.geometry import shapes
from particlesim.rendering.visibility.geometry_tables import bodies_of
from particlesim.rendering.visibility.occlusion_clusters import grouped
from particlesim.rendering.visibility.projection import Outlook
from particlesim.trajectory.frames import Header

KINDS = shapes.sphere(), shapes.cube(), shapes.pyramid()


class Crowd(NamedTuple):
    """Particles of KINDS: ``number`` (n,) of their kind, ``size`` (n,), ``position`` (n, 3), ``orientation`` (n, 4)."""

    number: np.ndarray
    size: np.ndarray
    position: np.ndarray
    orientation: np.ndarray

    @property
    def bodies(self):
        """As ``look`` wants them."""
        n = len(self.size)
        return bodies_of(Header("", KINDS, self.number, self.size, self.number, np.ones(n), np.ones((n, 3))))

    @property
    def where(self):
        """The other arguments that ``look`` wants."""
        return self.bodies, grouped(self.position, self.bodies.outer), self.orientation

    def only(self, members):
        """Some of them, in the order given."""
        return Crowd(*(of_all[members] for of_all in self))


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


def outlook(eye, target=(0.0, 0.0, 0.0), parallel=False, scale=60.0, size=(83, 61), roll=0.3):
    """One who looks from ``eye`` to ``target``, the head aside by an angle ``roll``."""
    away = np.subtract(target, eye) / np.linalg.norm(np.subtract(target, eye))
    right = np.cross(away, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    right = np.cos(roll) * right + np.sin(roll) * np.cross(right, away)
    return Outlook(np.array([right, np.cross(right, away), away]), np.asarray(eye, float), parallel, scale, size)


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
    """Distance along the axis (n, height, width) at which each particle is met, inf where not; see ``look``."""
    width, height = view.size
    middle = (crowd.position - view.eye) @ view.axes.T
    met = np.full((len(middle), height, width), np.inf)
    for i, kind in enumerate(crowd.number):
        shape, size = KINDS[kind], crowd.size[i]
        if shape.kind == SPHERE:
            met[i] = _ball(view, *rays(view), middle[i], 0.5 * size)
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
