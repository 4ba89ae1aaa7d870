"""Independent answers to the questions of the narrow phase: coal (GJK and EPA) and the Minkowski difference (Qhull)."""

from __future__ import annotations

import coal
import numpy as np
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from particlesim.core.constants import CAPSULE, POLYHEDRON, SPHERE
from particlesim.geometry import shapes

# Both searches of coal stop here [fraction of the distance, and m].
_COAL_TOLERANCE = 1e-12


def rotation(turn):
    """Rotation matrix (3, 3) of a quaternion (w, x, y, z)."""
    return Rotation.from_quat(np.roll(turn, -1)).as_matrix()


def corners(shape, size=1.0, turn=(1.0, 0.0, 0.0, 0.0), centre=(0.0, 0.0, 0.0)):
    """Vertices of a hull in world axes, (v, 3)."""
    return size * shape.vertices @ rotation(turn).T + np.asarray(centre)


def triangles(shape):
    """The faces of a hull as triangles, (t, 3)."""
    return np.array([(f[0], f[k], f[k + 1]) for f in shape.faces for k in range(1, len(f) - 1)])


def coal_geometry(shape, size=1.0):
    """A shape of the given size as coal has it; of a rounded polyhedron, its core."""
    if shape.kind == SPHERE:
        return coal.Sphere(0.5 * size)
    if shape.kind == CAPSULE:
        return coal.Capsule(0.5 * size, size * np.ptp(shape.vertices[:, 2]))
    points = coal.StdVec_Vec3s()
    points.extend(list(size * shape.vertices))
    faces = coal.StdVec_Triangle()
    faces.extend([coal.Triangle(*(int(v) for v in t)) for t in triangles(shape)])
    return coal.Convex(points, faces)


def coal_distance(geometry_a, turn_a, geometry_b, turn_b, offset):
    """Signed distance and normal from a to b by coal, b's centroid at ``offset`` from a's."""
    request = coal.DistanceRequest()
    request.gjk_tolerance = request.epa_tolerance = _COAL_TOLERANCE
    request.gjk_max_iterations = request.epa_max_iterations = 1000
    result = coal.DistanceResult()
    pose_a = coal.Transform3s(rotation(turn_a), np.zeros(3))
    pose_b = coal.Transform3s(rotation(turn_b), np.asarray(offset, dtype=np.float64))
    distance = coal.distance(geometry_a, pose_a, geometry_b, pose_b, request, result)
    return distance, np.array(result.normal)


def coal_rounding(shape, size=1.0):
    """How far the surface of a shape is outside of what coal has."""
    return size * shape.rounding if shape.kind == POLYHEDRON else 0.0


def _nearest_on_triangle(a, b, c):
    """Distance of the origin from triangles (t, 3) each: the least over the planes' feet inside and the three edges."""
    normal = np.cross(b - a, c - a)
    area2 = np.einsum("ij,ij->i", normal, normal)
    flat = area2 <= 1e-300
    foot = normal * (np.einsum("ij,ij->i", a, normal) / np.where(flat, 1.0, area2))[:, None]
    inside = ~flat
    best = np.full(len(a), np.inf)
    for p, q in ((a, b), (b, c), (c, a)):
        edge = q - p
        inside &= np.einsum("ij,ij->i", np.cross(edge, foot - p), normal) >= 0.0
        length2 = np.einsum("ij,ij->i", edge, edge)
        t = np.clip(-np.einsum("ij,ij->i", p, edge) / np.where(length2 > 0.0, length2, 1.0), 0.0, 1.0)
        best = np.minimum(best, np.linalg.norm(p + t[:, None] * edge, axis=1))
    return np.where(inside, np.minimum(best, np.linalg.norm(foot, axis=1)), best)


def difference_distance(points_a, points_b):
    """Signed distance of the hulls of two sets of points (v, 3), from the faces of the hull of all b - a."""
    differences = (points_b[None, :, :] - points_a[:, None, :]).reshape(-1, 3)
    hull = ConvexHull(differences)
    offset = hull.equations[:, 3]
    if offset.max() <= 0.0:
        return float(offset.max())
    a, b, c = (differences[hull.simplices[:, k]] for k in range(3))
    front = offset > 0.0
    return float(_nearest_on_triangle(a[front], b[front], c[front]).min())


def segment_gap(a, b, c, d):
    """The shortest vector from segment ab to segment cd: between the lines if inside of both, else from an end."""
    u, v, w = b - a, d - c, a - c
    gaps = []
    for start, along, ends, sign in ((a, u, (c, d), 1.0), (c, v, (a, b), -1.0)):
        for end in ends:
            t = np.clip((end - start) @ along / max(along @ along, 1e-300), 0.0, 1.0)
            gaps.append(sign * (end - start - t * along))
    system = np.array([[u @ u, -(u @ v)], [u @ v, -(v @ v)]])
    if abs(np.linalg.det(system)) > 1e-14 * (u @ u) * (v @ v):
        s, t = np.linalg.solve(system, -np.array([u @ w, v @ w]))
        if 0.0 <= s <= 1.0 and 0.0 <= t <= 1.0:
            gaps.append(t * v - s * u - w)
    return min(gaps, key=np.linalg.norm)


def core_distance(points_a, points_b):
    """Signed distance of two cores by their vertices (v, 3): points, segments or polyhedra."""
    if len(points_a) <= 2 and len(points_b) <= 2:
        return float(np.linalg.norm(segment_gap(points_a[0], points_a[-1], points_b[0], points_b[-1])))
    return difference_distance(points_a, points_b)


def surface_distance(point, shape, size, turn, centre):
    """Signed distance of a point from a shape's surface: negative inside."""
    local, vertices = (np.asarray(point) - np.asarray(centre)) @ rotation(turn), size * shape.vertices
    if shape.kind != POLYHEDRON:
        t = np.clip(local[2], vertices[0, 2], vertices[-1, 2])
        return float(np.linalg.norm(local - (0.0, 0.0, t))) - size * shape.rounding
    hull = ConvexHull(vertices)
    heights = hull.equations[:, :3] @ local + hull.equations[:, 3]
    if heights.max() <= 0.0:
        return float(heights.max()) - size * shape.rounding
    a, b, c = (vertices[hull.simplices[:, k]] - local for k in range(3))
    return float(_nearest_on_triangle(a, b, c).min()) - size * shape.rounding


def zoo():
    """Shapes that between them have everything that goes wrong: thin, tall, flat, round, uneven, few and many faces."""
    random = np.random.default_rng(11)
    ball = random.normal(size=(96, 3))
    return {
        "sphere": shapes.sphere(),
        "cube": shapes.cube(),
        "box": shapes.box((1.0, 2.0, 3.0)),
        "plate": shapes.box((1.0, 1.0, 0.001)),
        "rod": shapes.box((1.0, 0.001, 0.001)),
        "pyramid": shapes.pyramid(),
        "flat": shapes.pyramid(0.01),
        "tall": shapes.pyramid(50.0),
        "tetrahedron": shapes.tetrahedron(),
        "hull30": shapes.hull("hull30", random.normal(size=(30, 3))),
        "hull96": shapes.hull("hull96", ball / np.linalg.norm(ball, axis=1)[:, None]),
        "capsule": shapes.capsule(1.0),
        "needle": shapes.capsule(50.0),
        "stub": shapes.capsule(1e-3),
        "rounded cube": shapes.CATALOGUE["cube"](rounding=0.2),
        "rounded plate": shapes.box((1.0, 1.0, 0.001), rounding=0.05),
        "pebble": shapes.hull("pebble", random.normal(size=(12, 3)), rounding=1.5),
        "egg": shapes.pyramid(0.02, rounding=2.0),
    }


def unit_quaternion(random):
    """A random rotation, evenly spread, as (w, x, y, z)."""
    q = random.normal(size=4)
    return q / np.linalg.norm(q)


def direction(random):
    """A random unit vector."""
    v = random.normal(size=3)
    return v / np.linalg.norm(v)


def turned(turn, vector):
    """A vector turned by a quaternion (w, x, y, z)."""
    return rotation(turn) @ np.asarray(vector)


def product(p, q):
    """The rotation q followed by the rotation p, as (w, x, y, z)."""
    return np.roll((Rotation.from_quat(np.roll(p, -1)) * Rotation.from_quat(np.roll(q, -1))).as_quat(), 1)
