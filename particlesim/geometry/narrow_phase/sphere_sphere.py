"""Sphere against sphere: the closed form."""

from particlesim.core.jit import kernel
from particlesim.core.math3d import norm, scale, store_vec3


@kernel
def sphere_sphere(radius_a, radius_b, offset, points):
    """Separation, normal from a to b and one contact point of sphere b at ``offset`` from sphere a.

    Concentric spheres have no direction of their own: they take +x.
    """
    distance = norm(offset)
    normal = scale(offset, 1.0 / distance) if distance > 0.0 else (1.0, 0.0, 0.0)
    separation = distance - (radius_a + radius_b)
    store_vec3(points, 0, scale(normal, radius_a + 0.5 * separation))
    return separation, normal, 1
