"""What pixels look like, against the same light worked out anew from rays cast one by one."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from particlesim.core.constants import SPHERE
from particlesim.core.parallel import use_threads
from particlesim.rendering.shading import light as colours
from particlesim.rendering.shading.faces_in_view import faces_in_view
from particlesim.rendering.shading.lighting import Light, Lighting
from particlesim.rendering.shading.shade import Paint, seen_instances, shade
from particlesim.rendering.shading.shade_floor import Ground
from particlesim.rendering.shading.shadow import shadow_map
from particlesim.rendering.visibility.occlusion_clusters import occlusion_clusters
from particlesim.rendering.visibility.rasterise import VisibilityBuffer, rasterise
from tests.sight import KINDS, crowd, onto, projection, rays, through

VIEW = projection((9.0, 3.0, 4.0))
TOWARDS = np.array([0.5, -0.3, 0.8]) / np.linalg.norm([0.5, -0.3, 0.8])
BACKGROUND = np.array([0.2, 0.5, 0.8])
HAZE = np.array([7.0, 0.2, 0.3])
CORNER = np.array([3.0, 3.0])
NO_FLOOR = Ground(np.array([BACKGROUND] * 3), -CORNER, CORNER, -3.0, 1.0, np.zeros((0, 0), np.float32))


def lighting(closeness):
    """Light of which all or nothing arrives, as the one number on its map says."""
    zenith, shadow = np.ascontiguousarray(VIEW.axes[:, 2]), shadow_map(np.full((9, 9), closeness, np.float32))
    return Lighting(VIEW.axes @ TOWARDS, zenith, np.zeros((3, 4)), shadow)


def shaded(particles, light, ground=NO_FLOOR, view=VIEW):
    """The picture of a crowd, 0 .. 1, what is seen, and the paint, made up, of each particle."""
    paint = np.random.default_rng(3).uniform(size=(len(particles.size), 4))
    buffer = rasterise(view, *particles.scene)
    seen = seen_instances(buffer, len(particles.size))
    image = shade(view, buffer, particles.instances, Paint(seen, paint[seen.indices], HAZE), light, ground)
    assert (image[..., 3] == 255).all()
    return image[..., :3] / 255.0, buffer, paint


def met(particles, i):
    """Where rays meet particle i and its normals there, in view coordinates (height, width, 3), and the face if any."""
    kind, size, turn = KINDS[particles.number[i]], particles.size[i], particles.orientation[i]
    middle = VIEW.axes @ (particles.position[i] - VIEW.eye)
    start, way = rays(VIEW)
    if kind.kind == SPHERE:
        long = np.linalg.norm(way, axis=-1)
        along = way @ middle / long
        miss = middle - (along / long)[..., None] * way
        depth = (along - np.sqrt(np.maximum(0.25 * size**2 - (miss**2).sum(axis=-1), 0.0))) / long
        return depth[..., None] * way, (depth[..., None] * way - middle) / (0.5 * size), None
    if kind.rounding > 0.0:
        depth, normal = onto(VIEW, start, way, middle, kind, size, turn)
        return np.where(np.isfinite(depth), depth, 0.0)[..., None] * way, normal, None
    enter, _, face = through(VIEW, start, way, middle, kind, size, turn)
    normals = np.array(kind.face_normals) @ (VIEW.axes @ Rotation.from_quat(np.roll(turn, -1)).as_matrix()).T
    return np.where(np.isfinite(enter), enter, 0.0)[..., None] * way, normals[face], face


def expected(particles, i, paint, lit):
    """The colours of a particle where rays meet it, (height, width, 3) sRGB 0 .. 1, without the rims of faces."""
    _, normal, face = met(particles, i)
    middle = VIEW.axes @ (particles.position[i] - VIEW.eye)
    towards = VIEW.axes @ TOWARDS
    ray = rays(VIEW)[1] / np.linalg.norm(rays(VIEW)[1], axis=-1, keepdims=True)
    # Faces are turned to the eye as their body is.
    facing = -(normal * ray).sum(axis=-1) if face is None else -normal @ middle / np.linalg.norm(middle)
    up = normal @ VIEW.axes[:, 2]
    sky, ground, key = (np.array(c, float) for c in (colours.SKY, colours.GROUND, colours.KEY))
    even = (0.5 + 0.5 * up)[..., None]
    around = (even * sky + (1.0 - even) * ground) * (0.55 + 0.45 * np.maximum(facing, 0.0))[..., None]
    straight = np.maximum(normal @ towards, 0.0)
    gloss = 0.0
    if face is None:
        half = towards - ray
        half /= np.linalg.norm(half, axis=-1, keepdims=True)
        gloss = 0.22 * np.maximum((normal * half).sum(axis=-1), 0.0) ** 32
        step = np.clip(straight / 0.3, 0.0, 1.0)
        straight *= step**2 * (3.0 - 2.0 * step)
    light = paint[3] * paint[:3] * around + lit * (paint[:3] * key * straight[..., None] + np.expand_dims(gloss, -1))
    haze = HAZE[2] * np.clip((middle[2] - HAZE[0]) * HAZE[1], 0.0, 1.0)
    return (1.0 - haze) * np.minimum(np.sqrt(np.maximum(light, 0.0)), 1.0) + haze * BACKGROUND


def rims(particles, i):
    """How far from the edges of its face what each ray meets of a polyhedron is, as if seen from ahead [pixels]."""
    kind, size = KINDS[particles.number[i]], particles.size[i]
    place, _, face = met(particles, i)
    turn = VIEW.axes @ Rotation.from_quat(np.roll(particles.orientation[i], -1)).as_matrix()
    corners = VIEW.axes @ (particles.position[i] - VIEW.eye) + size * kind.vertices @ turn.T
    away = np.full(face.shape, np.inf)
    for number, loop in enumerate(kind.faces):
        for a, b in zip(loop, np.roll(loop, -1), strict=True):
            along = (corners[b] - corners[a]) / np.linalg.norm(corners[b] - corners[a])
            off = np.linalg.norm(np.cross(place - corners[a], along), axis=-1)
            away = np.where(face == number, np.minimum(away, off), away)
    return away / np.maximum(place[..., 2], 1e-9) * VIEW.scale


@pytest.mark.parametrize("lit", [0.0, 1.0])
def test_every_kind_of_surface_sends_the_light_that_it_should(lit):
    particles = crowd(1, 160, 5.0, 0.4, 1.2, len(KINDS))
    image, buffer, paint = shaded(particles, lighting(-np.inf if lit else np.inf))
    assert np.abs(image[buffer.id < 0] - BACKGROUND).max() <= 0.5 / 255.0 + 1e-6
    looked_at = np.zeros(len(KINDS), int)
    for i in np.unique(buffer.id[buffer.id >= 0]):
        here = buffer.id == i
        want = expected(particles, i, paint[i], lit)
        if KINDS[particles.number[i]].kind != SPHERE and KINDS[particles.number[i]].rounding == 0.0:
            away = rims(particles, i)
            want *= 1.0 - 0.2 * np.clip(1.5 - 0.75 * away, 0.0, 1.0)[..., None]
        off = np.abs(image - want)[here].max(axis=-1)
        # On an outline the normal is uncertain by the square root of single precision.
        assert (off < 1.2 / 255.0).mean() > 0.97 and off.max() < 0.05, KINDS[particles.number[i]].name
        looked_at[particles.number[i]] += here.sum()
    assert (looked_at > 50).all()


def test_faces_that_are_turned_to_the_eye_are_tabled_with_their_edges():
    particles = crowd(2, 60, 5.0, 0.4, 1.2, len(KINDS))
    indices = np.array([7, 1, 8, 2, 0, 3, 4])
    view = faces_in_view(particles.instances, indices, VIEW)
    faceted = [k for k, i in enumerate(indices) if particles.number[i] in (1, 2)]
    counts = [len(KINDS[particles.number[i]].faces) if k in faceted else 0 for k, i in enumerate(indices)]
    assert np.array_equal(view.start, np.cumsum(counts) - counts) and len(view.face) == sum(counts)
    for k in faceted:
        i = indices[k]
        kind = KINDS[particles.number[i]]
        turn = VIEW.axes @ Rotation.from_quat(np.roll(particles.orientation[i], -1)).as_matrix()
        middle = VIEW.axes @ (particles.position[i] - VIEW.eye)
        for f, loop in enumerate(kind.faces):
            normal = turn @ kind.face_normals[f]
            corners = middle + particles.size[i] * kind.vertices[list(loop)] @ turn.T
            if normal @ corners[0] >= 0.0:
                continue
            face = view.face[view.start[k] + f]
            assert face["normal"] == pytest.approx(normal, abs=1e-6)
            assert face["facing"] == pytest.approx(-normal @ middle / np.linalg.norm(middle), abs=1e-6)
            # Each corner is on two of the edges, and their middle on none but within all.
            edges = view.edge[face["first"] : face["last"], 0].astype(float)
            off = corners / corners[:, 2:] @ edges.T
            assert len(edges) == len(loop) and (np.sort(np.abs(off), axis=1)[:, :2] < 1e-2).all()
            inner = corners.mean(axis=0)
            assert (inner / inner[2] @ edges.T > 1.0).all()


def test_those_that_pixels_see_are_numbered():
    particles = crowd(1, 160, 5.0, 0.2, 1.0)
    buffer = rasterise(VIEW, *particles.scene)
    seen = seen_instances(buffer, 160)
    assert sorted(seen.indices) == np.unique(buffer.id[buffer.id >= 0]).tolist()
    assert np.array_equal(seen.number[seen.indices], np.arange(len(seen.indices)))
    assert (np.delete(seen.number, seen.indices) == -1).all()


def test_nothing_seen_is_all_background():
    for particles in (crowd(0, 0, 1.0, 0.1, 0.2), crowd(1, 9, 1.0, 0.1, 0.2)):
        blind = VisibilityBuffer(
            np.full((5, 7), -np.inf, np.float32), np.full((5, 7), -1, np.int32), np.zeros((5, 7), np.int32)
        )
        seen = seen_instances(blind, len(particles.size))
        paint = Paint(seen, np.zeros((0, 4)), HAZE)
        view = projection((9.0, 3.0, 4.0), size=(7, 5))
        image = shade(view, blind, particles.instances, paint, lighting(-np.inf), NO_FLOOR)
        assert seen.indices.shape == (0,) and (image[..., :3] == np.rint(255.0 * BACKGROUND)).all()


# ---- the floor ----------------------------------------------------------------------------------------------------


def on_floor(view, ground):
    """Where rays meet the plane of the floor, (height, width, 3) in the world, and which do."""
    way = rays(view)[1] @ view.axes
    distance = (ground.height - view.eye[2]) / way[..., 2]
    return view.eye + distance[..., None] * way, distance > 0.0


def test_the_floor_has_its_colours_and_fades_into_the_background():
    random = np.random.default_rng(5)
    sky = random.uniform(0.6, 1.0, (7, 11)).astype(np.float32)
    lower, upper, rim = np.array([-4.5, -1.5]), np.array([3.5, 2.5]), 1.5
    ground = Ground(np.array([BACKGROUND, [0.9, 0.8, 0.7], [0.5, 0.6, 0.4]]), lower, upper, -1.0, rim, sky)
    nobody = crowd(0, 0, 1.0, 0.1, 0.2)
    place, met_it = on_floor(VIEW, ground)
    past = np.maximum(np.maximum(place[..., :2] - upper, lower - place[..., :2]), 0.0) / rim
    past = np.minimum(np.hypot(past[..., 0], past[..., 1]), 1.0)
    strength = np.where(met_it, 1.0 - past**2 * (3.0 - 2.0 * past), 0.0)[..., None]
    column, row = (
        np.clip((place[..., k] - lower[k] + rim) / (upper[k] - lower[k] + 2.0 * rim) * n - 0.5, 0.0, n - 1.001)
        for k, n in ((0, 11), (1, 7))
    )
    i, j = column.astype(int), row.astype(int)
    a, b = column - i, row - j
    light = (1 - a) * (1 - b) * sky[j, i] + a * (1 - b) * sky[j, i + 1]
    light += (1 - a) * b * sky[j + 1, i] + a * b * sky[j + 1, i + 1]
    for closeness, colour in ((-np.inf, ground.colours[1]), (np.inf, ground.colours[2])):
        image = shaded(nobody, lighting(closeness), ground)[0]
        want = strength * colour * light[..., None] + (1.0 - strength) * BACKGROUND
        assert np.abs(image - want).max() < 1.2 / 255.0
        assert 0.1 < (strength == 1.0).mean() < 0.9 and (strength == 0.0).mean() > 0.05


def test_the_floor_is_seen_from_above_only():
    ground = Ground(
        np.array([BACKGROUND, [0.9] * 3, [0.4] * 3]), -CORNER, CORNER, -1.0, 1.0, np.ones((2, 2), np.float32)
    )
    balls = crowd(3, 20, 2.0, 0.4, 0.9, kinds=1)
    for height, seen in ((1.0, True), (-1.0, False), (-4.0, False)):
        view = projection((9.0, 3.0, height))
        image, buffer, _ = shaded(balls, lighting(-np.inf), ground, view)
        bare = shaded(balls, lighting(-np.inf), NO_FLOOR, view)[0]
        assert (buffer.id >= 0).any() and (np.abs(image - bare).max() > 0.1) == seen
        assert seen or np.array_equal(image, bare)


# ---- shadows ------------------------------------------------------------------------------------------------------


def sun(pixels):
    """A light whose map has ``pixels`` a side, each of 10 m / pixels."""
    right = np.cross([0.0, 0.0, 1.0], TOWARDS)
    right /= np.linalg.norm(right)
    axes = np.array([right, np.cross(TOWARDS, right), -TOWARDS])
    return Light(TOWARDS, axes, np.array([5.0, 5.0, 5.0]), (pixels, pixels))


@pytest.mark.parametrize("pixels", [800, 200])
def test_shadows_lie_where_rays_to_the_light_are_stopped_with_edges_as_soft_as_three_texels(pixels):
    balls = crowd(3, 60, 4.0, 0.4, 0.9, kinds=1)
    view = projection((9.0, 3.0, 4.0), scale=240.0, size=(332, 244))
    light, texel = sun(pixels), 10.0 / pixels
    shadow = shadow_map(rasterise(light.projection, *balls.scene).inverse_depth)
    white, black = np.ones(3), np.zeros(3)
    half = np.array([4.0, 4.0])
    ground = Ground(np.array([[0.5] * 3, white, black]), -half, half, -2.5, 0.5, np.ones((2, 2), np.float32))
    image, buffer, _ = shaded(balls, light.in_view(view, shadow), ground, view)
    place, _ = on_floor(view, ground)
    # From each place on the floor, how far the ray to the light passes inside the nearest ball.
    off = np.full(place.shape[:2], np.inf)
    for centre, size in zip(balls.position, balls.size, strict=True):
        arm = centre - place
        off = np.minimum(off, np.linalg.norm(arm - (arm @ TOWARDS)[..., None] * TOWARDS, axis=-1) - 0.5 * size)
    floor = (buffer.id < 0) & (np.abs(place[..., :2]) < half).all(axis=-1)
    lit, reach = image[..., 0], 1.5 * np.sqrt(2.0) * texel + 0.7 * texel
    assert (lit[floor & (off > reach)] > 0.99).all() and (lit[floor & (off < -reach)] < 0.01).all()
    assert (floor & (off < -reach)).sum() > 500 and (floor & (off > reach)).sum() > 500
    # Half way through the edge half of the light arrives.
    middle = lit[floor & (np.abs(off) < 0.25 * texel)]
    assert len(middle) > 30 and middle.mean() == pytest.approx(0.5, abs=0.1) and middle.std() < 0.2
    inner, outer = (lit[floor & (np.abs(off - side * 0.8 * texel) < 0.3 * texel)].mean() for side in (-1, 1))
    assert 0.05 < inner < 0.4 and 0.6 < outer < 0.95


def test_texels_looked_at_are_bounded_by_the_least_and_the_most_of_them():
    closeness = np.random.default_rng(8).normal(size=(40, 33)).astype(np.float32)
    found = shadow_map(closeness)
    around = np.lib.stride_tricks.sliding_window_view(closeness, (4, 4))
    assert np.array_equal(found.least[:-3, :-3], around.min(axis=(2, 3)))
    assert np.array_equal(found.most[:-3, :-3], around.max(axis=(2, 3)))


# ---- threads and clusters -----------------------------------------------------------------------------------------


def test_threads_shade_alike_and_cluster_alike():
    particles = crowd(5, 9000, 8.0, 0.05, 0.2)
    view = projection((14.0, 3.0, 4.0), scale=400.0, size=(400, 300))
    images, clusters = [], []
    try:
        for count in (1, 2, 4):
            use_threads(count)
            images.append(shaded(particles, lighting(-np.inf), view=view)[0])
            clusters.append(occlusion_clusters(particles.position, particles.tables.radius))
    finally:
        use_threads(None)
    for image, cluster in zip(images[1:], clusters[1:], strict=True):
        assert np.array_equal(images[0], image)
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
