"""Any convex shape against a mesh: its triangles near the shape, and the normals that it has where they are touched.

Each triangle is a shape by itself (see flat_prisms.py), but its edges and vertices are inner ones where other triangles
go on: a ball that rolls over a flat floor touches the edge of the next triangle before it is above it, with a normal
that leans back. The floor has no such normal. A mesh has a normal at a vertex, or on an edge, if nothing of it reaches
farther that way from there: none of the triangles there leans over to where the normal points.
"""

from particlesim.core.jit import kernel
from particlesim.core.math3d import dot, inverse_rotate, load_vec3, norm, scale, sub, to_vec3
from particlesim.geometry.tolerances import NORMAL_SINE
from particlesim.geometry.triangle_tree import next_leaf, triangles_of


@kernel
def box_about(placed, start, end, reach):
    """The box, in the axes of a placed mesh at size 1, of what is within ``reach`` [m] of a segment.

    ``start`` and ``end`` are from the mesh's position, in world axes [m].
    """
    _, size, orientation = placed
    p, q = inverse_rotate(orientation, start), inverse_rotate(orientation, end)
    lower = min(p[0], q[0]) - reach, min(p[1], q[1]) - reach, min(p[2], q[2]) - reach
    upper = max(p[0], q[0]) + reach, max(p[1], q[1]) + reach, max(p[2], q[2]) + reach
    return scale(lower, 1.0 / size), scale(upper, 1.0 / size)


@kernel
def next_triangle(table, meshes, mesh, place, box):
    """The next triangle of a mesh whose box meets a ``box`` (lower, upper): its place in the search, and its row.

    ``mesh`` is a row of the shape table; a place is (leaf, triangle), and the search begins at (0, 0). Row -1: no more.
    """
    tree = meshes.tree[mesh]
    lower, upper = box
    leaf, triangle = place
    past = triangles_of(leaf, tree.leaves, tree.count)[1] if leaf > 0 else 0
    while True:
        while triangle < past:
            row = tree.first + triangle
            triangle += 1
            if _is_near(table, row, lower, upper):
                return (leaf, triangle), row
        leaf = next_leaf(meshes.box, (tree.begin, tree.leaves), leaf, lower, upper)
        if leaf == 0:
            return (0, 0), -1
        triangle, past = triangles_of(leaf, tree.leaves, tree.count)


@kernel
def _is_near(table, row, lower, upper):
    """Whether the box of a triangle meets a box."""
    v = table.shape[row].first_vertex
    p, q, r = load_vec3(table.vertex, v), load_vec3(table.vertex, v + 1), load_vec3(table.vertex, v + 2)
    return (
        min(p[0], q[0], r[0]) <= upper[0]
        and lower[0] <= max(p[0], q[0], r[0])
        and min(p[1], q[1], r[1]) <= upper[1]
        and lower[1] <= max(p[1], q[1], r[1])
        and min(p[2], q[2], r[2]) <= upper[2]
        and lower[2] <= max(p[2], q[2], r[2])
    )


@kernel
def _reaches_farther(direction, start, end):
    """Whether an end is farther than a start along a unit direction, by more than rounding."""
    way = sub(end, start)
    return dot(direction, way) > NORMAL_SINE * norm(way)


@kernel
def _is_level(direction, p, q):
    """Whether two points are as far along a unit direction."""
    way = sub(q, p)
    return abs(dot(direction, way)) <= NORMAL_SINE * norm(way)


@kernel
def _farthest_corner(table, v, direction):
    """Which of the vertices v, v + 1 and v + 2 is farthest along a direction: 0, 1 or 2."""
    best = 0
    for k in range(1, 3):
        if dot(sub(load_vec3(table.vertex, v + k), load_vec3(table.vertex, v + best)), direction) > 0.0:
            best = k
    return best


@kernel
def has_normal(table, meshes, row, direction):
    """Whether a mesh has a normal where its triangle in a ``row`` of the shape table is farthest along it.

    ``direction`` is the normal, out of the mesh to what touches it: unit, in the mesh's axes.
    """
    triangle, v = row - len(meshes.tree), table.shape[row].first_vertex
    top = _farthest_corner(table, v, direction)
    here = load_vec3(table.vertex, v + top)
    after, before = (top + 1) % 3, (top + 2) % 3
    level_after = _is_level(direction, here, load_vec3(table.vertex, v + after))
    level_before = _is_level(direction, here, load_vec3(table.vertex, v + before))
    if level_after and level_before:
        return True
    if level_after or level_before:
        beyond = meshes.beyond[triangle, top if level_after else before]
        return beyond < 0 or not _reaches_farther(direction, here, load_vec3(table.vertex, beyond))
    corner = meshes.corner[triangle, top]
    for k in range(meshes.ring_start[corner], meshes.ring_start[corner + 1]):
        if _reaches_farther(direction, here, load_vec3(table.vertex, meshes.ring[k])):
            return False
    return True


@kernel
def face_towards(table, row, direction):
    """The unit normal of the triangle in a ``row`` of the shape table, on the side that ``direction`` points to."""
    normal = to_vec3(table.face[table.shape[row].first_face].normal)
    return normal if dot(normal, direction) >= 0.0 else scale(normal, -1.0)


@kernel
def is_any_near(table, meshes, b, start, end, reach):
    """Whether the box of any triangle of a placed mesh is within ``reach`` of a segment (see ``box_about``)."""
    _, row = next_triangle(table, meshes, b[0], (0, 0), box_about(b, start, end, reach))
    return row >= 0
