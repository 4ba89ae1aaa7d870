"""The table of what is seen: which rows a pixel refers to, and what they say."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from particlesim.core.constants import SPHERE
from particlesim.core.parallel import use_threads
from particlesim.rendering.shading.surfaces import TILE, surface_table, surfaces_of
from particlesim.rendering.visibility.geometry_tables import BALL, FACETED, ROUNDED
from particlesim.rendering.visibility.occlusion_clusters import occlusion_clusters
from particlesim.rendering.visibility.rasterise import VisibilityBuffer, rasterise
from tests.sight import KINDS, crowd, from_core, projection, rays, through

VIEW = projection((9.0, 3.0, 4.0))


def tabled(particles, view=VIEW):
    """What is seen of a crowd, its surfaces, their table, and the paint that was asked for."""
    seen = rasterise(view, *particles.scene)
    surfaces = surfaces_of(seen._replace(id=seen.id.copy()), particles.tables)
    paint = np.random.default_rng(3).uniform(size=(len(surfaces.seen), 4)).astype(np.float32)
    table = surface_table(surfaces, particles.instances, view, paint)
    return seen, surfaces, table, paint


def test_all_that_is_seen_and_nothing_else_is_in_the_table_once():
    particles = crowd(1, 160, 5.0, 0.2, 1.0)
    seen, surfaces, table, _ = tabled(particles)
    is_ball = particles.number == 0
    assert sorted(surfaces.seen) == np.unique(seen.id[seen.id >= 0]).tolist()
    shown = {
        (i, -1 if is_ball[i] else f)
        for i, f in zip(seen.id.ravel().tolist(), seen.primitive.ravel().tolist(), strict=True)
        if i >= 0
    }
    owners = surfaces.seen[surfaces.part["seen"]]
    assert len(surfaces.part) == len(shown) > 100
    assert set(zip(owners.tolist(), surfaces.part["primitive"].tolist(), strict=True)) == shown
    # One after the other, without gaps: two rows for a sphere, three and one for each edge for a face.
    faces = zip(particles.number[owners], surfaces.part["primitive"], strict=True)
    edges = [0 if f < 0 else len(KINDS[number].faces[f]) for number, f in faces]
    rows = np.where(is_ball[owners], 2, 3 + np.array(edges))
    assert np.array_equal(surfaces.part["row"], np.cumsum(rows) - rows)
    assert surfaces.rows == len(table) == rows.sum()


def test_each_pixel_refers_to_its_surface_and_each_tile_to_its_pixels():
    particles = crowd(1, 160, 5.0, 0.2, 1.0)
    seen, surfaces, _, _ = tabled(particles)
    pixel = surfaces.pixel
    rows = pixel >> 2
    owner = np.full(surfaces.rows, -1)
    face = np.full(surfaces.rows, -1)
    owner[surfaces.part["row"]] = surfaces.seen[surfaces.part["seen"]]
    face[surfaces.part["row"]] = surfaces.part["primitive"]
    assert np.array_equal(pixel == -1, seen.id < 0)
    ball, hull = (pixel >= 0) & (pixel % 4 == BALL), (pixel >= 0) & (pixel % 4 == FACETED)
    assert np.array_equal(owner[rows[ball]], seen.id[ball]) and (particles.number[seen.id[ball]] == 0).all()
    assert np.array_equal(owner[rows[hull]], seen.id[hull])
    assert np.array_equal(face[rows[hull]], seen.primitive[hull])
    for shown, tiles in ((ball, surfaces.tiles[BALL]), (hull, surfaces.tiles[FACETED])):
        expected = np.zeros_like(tiles)
        expected[tuple((np.argwhere(shown) // TILE).T)] = True
        assert np.array_equal(tiles, expected) and 0 < tiles.sum() < tiles.size


def test_rows_of_spheres_and_faces_say_where_they_are():
    particles = crowd(2, 90, 5.0, 0.4, 1.2)
    seen, surfaces, table, paint = tabled(particles)
    world = (rays(VIEW)[1] @ VIEW.axes).reshape(-1, 3)
    kinds = set()
    for number, f, row in surfaces.part.tolist():
        i = surfaces.seen[number]
        kind, size = KINDS[particles.number[i]], particles.size[i]
        centre = particles.position[i] - VIEW.eye
        assert table[row + 1] == pytest.approx(paint[number])
        kinds.add(kind.name)
        if kind.kind == SPHERE:
            assert table[row] == pytest.approx([*centre, 0.5 * size], rel=1e-6)
            continue
        here = ((seen.id == i) & (seen.primitive == f)).ravel()
        enter, _, face = through(VIEW, *rays(VIEW), VIEW.axes @ centre, kind, size, particles.orientation[i])
        assert (face.ravel()[here] == f).mean() > 0.9
        hit = here & (face.ravel() == f)
        place = world[hit] * enter.ravel()[hit][:, None]
        normal, offset = table[row, :3].astype(float), float(table[row, 3])
        assert np.linalg.norm(normal) == pytest.approx(1.0) and offset < 0.0
        assert offset / (world[hit] @ normal) == pytest.approx(enter.ravel()[hit], rel=1e-4)
        facing, depth, edges = table[row + 2, :3]
        assert facing == pytest.approx(-normal @ centre / np.linalg.norm(centre), abs=1e-5)
        assert depth == pytest.approx(centre @ VIEW.axes[2], rel=1e-6)
        # How far each of its points is from the edges, as if they were looked at from ahead.
        loop = kind.faces[f]
        assert edges == len(loop)
        corners = centre + size * rotated(particles.orientation[i], kind.vertices[list(loop)])
        along = np.roll(corners, -1, axis=0) - corners
        away = np.linalg.norm(np.cross(place[:, None] - corners, along), axis=2) / np.linalg.norm(along, axis=1)
        pixels = away / enter.ravel()[hit][:, None] * VIEW.scale
        told = world[hit] @ table[row + 3 : row + 3 + len(loop), :3].astype(float).T
        assert np.sort(told, axis=1) == pytest.approx(np.sort(pixels, axis=1), abs=2e-3)
    assert len(kinds) == 3


def test_rows_of_rounded_shapes_say_where_they_are_and_how_they_are_turned():
    particles = crowd(4, 90, 5.0, 0.6, 1.4, len(KINDS))
    seen, surfaces, table, paint = tabled(particles)
    world = (rays(VIEW)[1] @ VIEW.axes)[seen.id >= 0]
    pixel = surfaces.pixel[seen.id >= 0]
    rounded = (pixel & 3) == ROUNDED
    row, ray, i = pixel[rounded] >> 2, world[rounded], seen.id[seen.id >= 0][rounded]
    form, body = table[row].astype(float), table[row + 2].astype(float)
    place, normal = shaded(form, body, ray / np.linalg.norm(ray, axis=1, keepdims=True))
    depth = place @ VIEW.axes[2]
    assert 1.0 / depth == pytest.approx(seen.inverse_depth[seen.id >= 0][rounded], rel=1e-4)
    # The normal is the way out of the core; on an outline it is uncertain by the square root of single precision.
    for k in np.unique(i):
        kind, here = KINDS[particles.number[k]], i == k
        turn = Rotation.from_quat(np.roll(particles.orientation[k], -1)).as_matrix()
        middle = particles.position[k] - VIEW.eye
        _, outward = from_core(kind, (place[here] - middle) @ turn / particles.size[k])
        assert normal[here] == pytest.approx(outward @ turn.T, abs=2e-3)
        assert body[here, 3] == pytest.approx(middle @ VIEW.axes[2], rel=1e-6)
    assert np.array_equal(table[surfaces.part["row"] + 1], paint[surfaces.part["seen"]])
    kinds = particles.number[np.unique(i)]
    assert set(kinds) == set(range(3, len(KINDS)))
    # All three kinds of parts are there.
    straight = np.linalg.norm(body[:, :3], axis=1)
    assert ((form[:, 3] < 0.0).sum() > 100) and (straight > 0.5).sum() > 100
    assert ((form[:, 3] > 0.0) & (straight == 0.0)).sum() > 100


def shaded(form, body, ray):
    """Places and normals as shaders/rounded.frag has them, of unit ``ray`` (k, 3) from the eye."""
    plane = form[:, 3] < 0.0
    across = ray - (ray * body[:, :3]).sum(axis=1, keepdims=True) * body[:, :3]
    centre = form[:, :3] - (form[:, :3] * body[:, :3]).sum(axis=1, keepdims=True) * body[:, :3]
    square = (across**2).sum(axis=1)
    along = (centre * across).sum(axis=1) / square
    miss = centre - along[:, None] * across
    distance = along - np.sqrt(np.maximum(form[:, 3] ** 2 - (miss**2).sum(axis=1), 0.0) / square)
    distance = np.where(plane, form[:, 3] / (form[:, :3] * ray).sum(axis=1), distance)
    normal = np.where(plane[:, None], form[:, :3], (distance[:, None] * across - centre) / form[:, 3:])
    return distance[:, None] * ray, normal


def rotated(turn, vectors):
    """Vectors (k, 3) turned by a quaternion w, x, y, z."""
    w, axis = turn[0], turn[1:]
    twice = 2.0 * np.cross(axis, vectors)
    return vectors + w * twice + np.cross(axis, twice)


def test_nothing_seen_is_an_empty_table():
    _, surfaces, table, _ = tabled(crowd(0, 0, 1.0, 0.1, 0.2))
    assert table.shape == (0, 4) and surfaces.seen.shape == (0,) and not surfaces.tiles.any()
    # Not even where there are particles.
    some = crowd(1, 9, 1.0, 0.1, 0.2)
    blind = VisibilityBuffer(np.zeros((5, 7), np.float32), np.full((5, 7), -1, np.int32), np.zeros((5, 7), np.int32))
    assert surfaces_of(blind, some.tables).rows == 0


def test_hulls_of_many_faces_are_numbered_too():
    # More faces of all that is seen than there is room for at first.
    particles = crowd(6, 4000, 8.0, 0.05, 0.1)
    _, surfaces, _, _ = tabled(particles, projection((14.0, 3.0, 4.0), scale=800.0, size=(800, 700)))
    hulls = surfaces.seen[particles.number[surfaces.seen] > 0]
    assert 6 * len(hulls) > 8192
    faces = surfaces.part[surfaces.part["primitive"] >= 0]
    assert len(np.unique(faces[["seen", "primitive"]])) == len(faces)


def test_threads_fill_alike_and_cluster_alike():
    particles = crowd(5, 9000, 8.0, 0.05, 0.2)
    view = projection((14.0, 3.0, 4.0), scale=400.0, size=(400, 300))
    tables, clusters = [], []
    try:
        for count in (1, 2, 4):
            use_threads(count)
            tables.append(tabled(particles, view)[2])
            clusters.append(occlusion_clusters(particles.position, particles.tables.radius))
    finally:
        use_threads(None)
    for table, cluster in zip(tables[1:], clusters[1:], strict=True):
        assert np.array_equal(tables[0], table)
        assert all(np.array_equal(one, other) for one, other in zip(clusters[0], cluster, strict=True))


@pytest.mark.parametrize("count", [0, 1, 2, 500, 20000])
@pytest.mark.parametrize("form", ["box", "plane", "line", "point", "one far away"])
def test_clusters_hold_each_particle_once_in_a_box_about_it(count, form):
    random = np.random.default_rng(count)
    flat = {"plane": [1.0, 1.0, 0.0], "line": [0.0, 1.0, 0.0], "point": [0.0, 0.0, 0.0]}
    position = 3.0 + random.uniform(-1.0, 1.0, (count, 3)) * flat.get(form, [1.0, 1.0, 1.0])
    if form == "one far away" and count:
        position[0] = 1e7, -1e9, 3.0
    outer = random.uniform(0.01, 0.1, count)
    clusters = occlusion_clusters(position, outer)
    assert np.array_equal(np.sort(clusters.indices), np.arange(count))
    assert clusters.start[0] == 0 and clusters.start[-1] == count and (np.diff(clusters.start) > 0).all()
    assert np.array_equal(clusters.sphere, np.column_stack([position, outer])[clusters.indices])
    for c in range(len(clusters.start) - 1):
        spheres = clusters.sphere[clusters.start[c] : clusters.start[c + 1]]
        assert np.array_equal(clusters.lower[c], (spheres[:, :3] - spheres[:, 3:]).min(axis=0))
        assert np.array_equal(clusters.upper[c], (spheres[:, :3] + spheres[:, 3:]).max(axis=0))
        assert (np.diff(clusters.indices[clusters.start[c] : clusters.start[c + 1]]) > 0).all()
    if form != "point" and count == 20000:
        assert np.median(np.diff(clusters.start)) < 100
