"""The table of what is seen: which rows a pixel refers to, and what they say."""

import numpy as np
import pytest

from particlesim.core.constants import SPHERE
from particlesim.core.parallel import use_threads
from particlesim.rendering.shading.surfaces import TILE, surfaces_of, table_of
from particlesim.rendering.visibility.occlusion_clusters import grouped
from particlesim.rendering.visibility.rasterise import Sight, look
from tests.sight import KINDS, crowd, outlook, rays, through

VIEW = outlook((9.0, 3.0, 4.0))


def tabled(particles, view=VIEW):
    """The sight of a crowd, its surfaces, their table, and the paint that was asked for."""
    sight = look(view, *particles.where)
    surfaces = surfaces_of(sight._replace(owner=sight.owner.copy()), particles.bodies)
    paint = np.random.default_rng(3).uniform(size=(len(surfaces.seen), 4)).astype(np.float32)
    table = table_of(surfaces, particles.bodies, view, particles.position, particles.orientation, paint)
    return sight, surfaces, table, paint


def test_all_that_is_seen_and_nothing_else_is_in_the_table_once():
    particles = crowd(1, 160, 5.0, 0.2, 1.0)
    sight, surfaces, table, _ = tabled(particles)
    is_ball = particles.number == 0
    assert sorted(surfaces.seen) == np.unique(sight.owner[sight.owner >= 0]).tolist()
    shown = {
        (i, -1 if is_ball[i] else f)
        for i, f in zip(sight.owner.ravel().tolist(), sight.face.ravel().tolist(), strict=True)
        if i >= 0
    }
    owners = surfaces.seen[surfaces.parts[:, 0]]
    assert len(surfaces.parts) == len(shown) > 100
    assert set(zip(owners.tolist(), surfaces.parts[:, 1].tolist(), strict=True)) == shown
    # One after the other, without gaps: two rows for a sphere, three and one for each edge for a face.
    faces = zip(particles.number[owners], surfaces.parts[:, 1], strict=True)
    edges = [0 if f < 0 else len(KINDS[number].faces[f]) for number, f in faces]
    rows = np.where(is_ball[owners], 2, 3 + np.array(edges))
    assert np.array_equal(surfaces.parts[:, 2], np.cumsum(rows) - rows)
    assert surfaces.rows == len(table) == rows.sum()


def test_each_pixel_refers_to_its_surface_and_each_tile_to_its_pixels():
    particles = crowd(1, 160, 5.0, 0.2, 1.0)
    sight, surfaces, _, _ = tabled(particles)
    rows = surfaces.first_row
    owner = np.full(surfaces.rows, -1)
    face = np.full(surfaces.rows, -1)
    owner[surfaces.parts[:, 2]] = surfaces.seen[surfaces.parts[:, 0]]
    face[surfaces.parts[:, 2]] = surfaces.parts[:, 1]
    assert np.array_equal(rows == -1, sight.owner < 0)
    ball, hull = rows >= 0, rows <= -2
    assert np.array_equal(owner[rows[ball]], sight.owner[ball]) and (particles.number[sight.owner[ball]] == 0).all()
    assert np.array_equal(owner[-2 - rows[hull]], sight.owner[hull])
    assert np.array_equal(face[-2 - rows[hull]], sight.face[hull])
    for shown, tiles in ((ball, surfaces.balls), (hull, surfaces.hulls)):
        expected = np.zeros_like(tiles)
        expected[tuple((np.argwhere(shown) // TILE).T)] = True
        assert np.array_equal(tiles, expected) and 0 < tiles.sum() < tiles.size


def test_rows_of_spheres_and_faces_say_where_they_are():
    particles = crowd(2, 90, 5.0, 0.4, 1.2)
    sight, surfaces, table, paint = tabled(particles)
    world = (rays(VIEW)[1] @ VIEW.axes).reshape(-1, 3)
    kinds = set()
    for number, f, row in surfaces.parts.tolist():
        i = surfaces.seen[number]
        kind, size = KINDS[particles.number[i]], particles.size[i]
        centre = particles.position[i] - VIEW.eye
        assert table[row + 1] == pytest.approx(paint[number])
        kinds.add(kind.name)
        if kind.kind == SPHERE:
            assert table[row] == pytest.approx([*centre, 0.5 * size], rel=1e-6)
            continue
        seen = ((sight.owner == i) & (sight.face == f)).ravel()
        enter, _, face = through(VIEW, *rays(VIEW), VIEW.axes @ centre, kind, size, particles.orientation[i])
        assert (face.ravel()[seen] == f).mean() > 0.9
        mine = seen & (face.ravel() == f)
        place = world[mine] * enter.ravel()[mine][:, None]
        normal, offset = table[row, :3].astype(float), float(table[row, 3])
        assert np.linalg.norm(normal) == pytest.approx(1.0) and offset < 0.0
        assert offset / (world[mine] @ normal) == pytest.approx(enter.ravel()[mine], rel=1e-4)
        facing, depth, edges = table[row + 2, :3]
        assert facing == pytest.approx(-normal @ centre / np.linalg.norm(centre), abs=1e-5)
        assert depth == pytest.approx(centre @ VIEW.axes[2], rel=1e-6)
        # How far each of its points is from the edges, as if they were looked at from ahead.
        loop = kind.faces[f]
        assert edges == len(loop)
        corners = centre + size * rotated(particles.orientation[i], kind.vertices[list(loop)])
        along = np.roll(corners, -1, axis=0) - corners
        away = np.linalg.norm(np.cross(place[:, None] - corners, along), axis=2) / np.linalg.norm(along, axis=1)
        pixels = away / enter.ravel()[mine][:, None] * VIEW.scale
        told = world[mine] @ table[row + 3 : row + 3 + len(loop), :3].astype(float).T
        assert np.sort(told, axis=1) == pytest.approx(np.sort(pixels, axis=1), abs=2e-3)
    assert len(kinds) == 3


def rotated(turn, vectors):
    """Vectors (k, 3) turned by a quaternion w, x, y, z."""
    w, axis = turn[0], turn[1:]
    twice = 2.0 * np.cross(axis, vectors)
    return vectors + w * twice + np.cross(axis, twice)


def test_nothing_seen_is_an_empty_table():
    _, surfaces, table, _ = tabled(crowd(0, 0, 1.0, 0.1, 0.2))
    assert table.shape == (0, 4) and surfaces.seen.shape == (0,) and not surfaces.balls.any()
    # Not even where there are particles.
    some = crowd(1, 9, 1.0, 0.1, 0.2)
    blind = Sight(np.zeros((5, 7), np.float32), np.full((5, 7), -1, np.int32), np.zeros((5, 7), np.int32))
    assert surfaces_of(blind, some.bodies).rows == 0


def test_hulls_of_many_faces_are_numbered_too():
    # More faces of all that is seen than there is room for at first.
    particles = crowd(6, 4000, 8.0, 0.05, 0.1)
    _, surfaces, _, _ = tabled(particles, outlook((14.0, 3.0, 4.0), scale=800.0, size=(800, 700)))
    hulls = surfaces.seen[particles.number[surfaces.seen] > 0]
    assert 6 * len(hulls) > 8192
    faces = surfaces.parts[surfaces.parts[:, 1] >= 0]
    assert len(np.unique(faces[:, :2], axis=0)) == len(faces)


def test_threads_fill_alike_and_group_alike():
    particles = crowd(5, 9000, 8.0, 0.05, 0.2)
    view = outlook((14.0, 3.0, 4.0), scale=400.0, size=(400, 300))
    tables, groups = [], []
    try:
        for count in (1, 2, 4):
            use_threads(count)
            tables.append(tabled(particles, view)[2])
            groups.append(grouped(particles.position, particles.bodies.outer))
    finally:
        use_threads(None)
    for table, group in zip(tables[1:], groups[1:], strict=True):
        assert np.array_equal(tables[0], table)
        assert all(np.array_equal(one, other) for one, other in zip(groups[0], group, strict=True))


@pytest.mark.parametrize("count", [0, 1, 2, 500, 20000])
@pytest.mark.parametrize("form", ["box", "plane", "line", "point", "one far away"])
def test_groups_hold_each_particle_once_in_a_box_about_it(count, form):
    random = np.random.default_rng(count)
    flat = {"plane": [1.0, 1.0, 0.0], "line": [0.0, 1.0, 0.0], "point": [0.0, 0.0, 0.0]}
    position = 3.0 + random.uniform(-1.0, 1.0, (count, 3)) * flat.get(form, [1.0, 1.0, 1.0])
    if form == "one far away" and count:
        position[0] = 1e7, -1e9, 3.0
    outer = random.uniform(0.01, 0.1, count)
    groups = grouped(position, outer)
    assert np.array_equal(np.sort(groups.members), np.arange(count))
    assert groups.start[0] == 0 and groups.start[-1] == count and (np.diff(groups.start) > 0).all()
    assert np.array_equal(groups.balls, np.column_stack([position, outer])[groups.members])
    for group in range(len(groups.start) - 1):
        balls = groups.balls[groups.start[group] : groups.start[group + 1]]
        assert np.array_equal(groups.lower[group], (balls[:, :3] - balls[:, 3:]).min(axis=0))
        assert np.array_equal(groups.upper[group], (balls[:, :3] + balls[:, 3:]).max(axis=0))
        assert (np.diff(groups.members[groups.start[group] : groups.start[group + 1]]) > 0).all()
    if form != "point" and count == 20000:
        assert np.median(np.diff(groups.start)) < 100
