"""Kernels on vectors, quaternions and rotation matrices held as tuples.

A vector is ``(x, y, z)``, a quaternion ``(w, x, y, z)`` of unit length, a rotation matrix nine numbers by rows.
Tuples live in registers: no kernel allocates an array for a vector.
"""

import math

import numpy as np

from particlesim.core.jit import entry_kernel, kernel


@kernel
def load_vec3(array, index):
    """Vector number ``index`` of an (n, 3) array."""
    return array[index, 0], array[index, 1], array[index, 2]


@kernel
def to_vec3(array):
    """A (3,) array as a vector."""
    return array[0], array[1], array[2]


@kernel
def to_quat(array):
    """A (4,) array as a quaternion."""
    return array[0], array[1], array[2], array[3]


@kernel
def set_vec3(array, v):
    """Write vector ``v`` into a (3,) array."""
    array[0], array[1], array[2] = v[0], v[1], v[2]


@kernel
def set_quat(array, q):
    """Write quaternion ``q`` into a (4,) array."""
    array[0], array[1], array[2], array[3] = q[0], q[1], q[2], q[3]


@kernel
def load_quat(array, index):
    """Quaternion number ``index`` of an (n, 4) array."""
    return array[index, 0], array[index, 1], array[index, 2], array[index, 3]


@kernel
def store_vec3(array, index, v):
    """Write vector ``v`` as row ``index`` of an (n, 3) array."""
    array[index, 0] = v[0]
    array[index, 1] = v[1]
    array[index, 2] = v[2]


@kernel
def grow(array):
    """An array with the rows of this one and room for as many again."""
    longer = np.empty((2 * array.shape[0], array.shape[1]), dtype=array.dtype)
    for k in range(array.shape[0]):
        for column in range(array.shape[1]):
            longer[k, column] = array[k, column]
    return longer


@kernel
def grow_records(array):
    """An array (n,) of records with those of this one and room for as many again."""
    longer = np.empty(2 * len(array), dtype=array.dtype)
    for k in range(len(array)):
        longer[k] = array[k]
    return longer


@kernel
def add(a, b):
    """a + b"""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@kernel
def sub(a, b):
    """a - b"""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@kernel
def scale(a, factor):
    """factor * a"""
    return a[0] * factor, a[1] * factor, a[2] * factor


@kernel
def axpy(a, b, factor):
    """a + factor * b"""
    return a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]


@kernel
def dot(a, b):
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel
def cross(a, b):
    """Vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@kernel
def norm(a):
    """Length."""
    return math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


@entry_kernel
def quat_multiply(p, q):
    """The rotation q followed by the rotation p."""
    return (
        p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
        p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
        p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1],
        p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0],
    )


@kernel
def conjugate(q):
    """The inverse rotation."""
    return q[0], -q[1], -q[2], -q[3]


@entry_kernel
def quat_normalize(q):
    """q divided by its length."""
    s = 1.0 / math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return q[0] * s, q[1] * s, q[2] * s, q[3] * s


@kernel
def quat_from_rotvec(rotation_vector):
    """Quaternion of the rotation by |rotation_vector| [rad] about its direction."""
    angle = norm(rotation_vector)
    # Below 1e-4 the series of sin(x/2)/x is exact to the last bit.
    s = 0.5 - angle * angle / 48.0 if angle < 1e-4 else math.sin(0.5 * angle) / angle
    return (
        math.cos(0.5 * angle),
        rotation_vector[0] * s,
        rotation_vector[1] * s,
        rotation_vector[2] * s,
    )


@kernel
def rotate(q, v):
    """Vector v in body axes, seen in world axes.

    Divided by |q|^2: a quaternion is of unit length only to rounding, which would stretch v a little each time.
    """
    length2 = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]
    t = scale(cross((q[1], q[2], q[3]), v), 2.0 / length2)
    return axpy(add(v, cross((q[1], q[2], q[3]), t)), t, q[0])


@kernel
def inverse_rotate(q, v):
    """Vector v in world axes, seen in body axes."""
    return rotate(conjugate(q), v)


@kernel
def quat_to_matrix(q):
    """Rotation matrix of a unit quaternion, nine numbers by rows."""
    w, x, y, z = q
    return (
        1.0 - 2.0 * (y * y + z * z),
        2.0 * (x * y - w * z),
        2.0 * (x * z + w * y),
        2.0 * (x * y + w * z),
        1.0 - 2.0 * (x * x + z * z),
        2.0 * (y * z - w * x),
        2.0 * (x * z - w * y),
        2.0 * (y * z + w * x),
        1.0 - 2.0 * (x * x + y * y),
    )


@kernel
def mat_vec(m, v):
    """Matrix m times vector v."""
    return (
        m[0] * v[0] + m[1] * v[1] + m[2] * v[2],
        m[3] * v[0] + m[4] * v[1] + m[5] * v[2],
        m[6] * v[0] + m[7] * v[1] + m[8] * v[2],
    )


@kernel
def mat_transposed_vec(m, v):
    """The transpose of matrix m times vector v."""
    return (
        m[0] * v[0] + m[3] * v[1] + m[6] * v[2],
        m[1] * v[0] + m[4] * v[1] + m[7] * v[2],
        m[2] * v[0] + m[5] * v[1] + m[8] * v[2],
    )
