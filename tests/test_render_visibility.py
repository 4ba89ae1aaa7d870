"""What is seen at each pixel, against rays cast one by one; and what lies in the shadow."""

import sys

import numpy as np
import pytest

from particlesim.core.constants import SPHERE
from particlesim.core.parallel import use_threads
from particlesim.geometry.shapes import capsule, cube, hull, sphere
from particlesim.rendering.shading.lighting import key_light
from particlesim.rendering.visibility.rasterise import rasterise
from tests import sight
from tests.sight import KINDS, Crowd, crowd, distances, onto, projection, rays, through
from tests.test_render_picture import draw, edge, make_frame, make_scene

WITHOUT = projection((9.0, 3.0, 4.0))
# Amidst the crowd: spheres beside the eye, and hulls through its plane.
AMIDST = projection((0.3, 0.2, -0.1), target=(-1.0, 0.5, 0.3), scale=40.0)
ABOVE = projection((2.0, 1.0, 5.0), parallel=True, scale=9.0)


@pytest.fixture
def threads():
    """Sets the number of threads for a test."""
    yield use_threads
    use_threads(None)


def is_ball(particles):
    return np.array([kind.kind == SPHERE for kind in KINDS])[particles.number]


def faces(seen, kinds=3):
    """The faces that are seen, -1 where none is."""
    return np.where((seen.id >= 0) & (seen.id % kinds > 0), seen.primitive, -1)


def about(view, seed, kinds=3):
    """A crowd, in it two spheres that reach beside the eye that is amidst, one more before them and one behind."""
    particles = crowd(seed, 160, 5.0, 0.2, 1.0, kinds)
    beside = np.array([[0.6, 0.1, 0.3], [-0.55, 0.0, -0.1]]) @ AMIDST.axes + AMIDST.eye
    particles.position[[0, kinds]] = beside if view is AMIDST else particles.position[[0, kinds]]
    particles.size[[0, kinds]] = 0.8, 1.0
    return particles


def nearest(view, particles):
    """Number (height, width) of the particle that rays meet first, -1 for none, and how far it and the next one are."""
    met = distances(view, particles)
    first = np.argmin(met, axis=0)
    two = np.partition(met, 1, axis=0)[:2]
    return np.where(np.isfinite(two[0]), first, -1), *two


@pytest.mark.parametrize("view", [WITHOUT, AMIDST], ids=["from without", "from amidst"])
@pytest.mark.parametrize(("seed", "kinds"), [(1, 3), (2, 3), (1, len(KINDS)), (16, len(KINDS))])
def test_each_pixel_sees_what_its_ray_meets_first(view, seed, kinds):
    particles = about(view, seed, kinds)
    seen = rasterise(view, *particles.scene)
    first, near, next_to_it = nearest(view, particles)
    # Where two are as near, either is right.
    firm = (first < 0) | (next_to_it > near * (1.0 + 1e-6))
    assert firm.mean() > 0.99
    assert np.array_equal(seen.id[firm], first[firm])
    assert (np.bincount(is_ball(particles)[np.unique(first[first >= 0])].astype(int)) > 5).all()
    assert seen.inverse_depth[first >= 0] == pytest.approx(1.0 / near[first >= 0], rel=1e-6)
    assert (seen.inverse_depth[first < 0] == -np.inf).all()
    # Of a hull the face is told by which the ray comes in.
    for i in np.unique(first[first >= 0]):
        kind, here = KINDS[particles.number[i]], (seen.id == i) & firm
        if kind.rounding == 0.0:
            middle = view.axes @ (particles.position[i] - view.eye)
            face = through(view, *rays(view), middle, kind, particles.size[i], particles.orientation[i])[2]
            assert (seen.primitive[here] == face[here]).mean() > 0.99


@pytest.mark.parametrize("kind", range(len(KINDS)), ids=[f"{kind.name} {kind.rounding}" for kind in KINDS])
def test_those_beside_the_eye_are_seen_as_far_as_they_are_before_it(kind):
    beside = crowd(8 if kind < 3 else 11, 60, 2.0, 0.3, 0.9)._replace(number=np.full(60, kind))
    beside = beside._replace(position=AMIDST.eye + beside.position * [[1.0, 1.0, 0.4]] @ AMIDST.axes)
    z = (beside.position - AMIDST.eye) @ AMIDST.axes[2]
    outer = beside.tables.radius
    seen = rasterise(AMIDST, *beside.scene)
    first, _, _ = nearest(AMIDST, beside)
    assert (seen.id == first).mean() > 0.999
    met = np.unique(first[first >= 0])
    assert (np.abs(z) < outer)[met].sum() > 1
    assert (z < 0.0)[met].any()


def test_from_within_a_sphere_the_others_are_seen():
    within = crowd(4, 60, 5.0, 0.2, 0.9, kinds=1)
    within = within._replace(position=np.vstack([AMIDST.eye + 0.05, within.position[1:]]))
    first, _, _ = nearest(AMIDST, within)
    seen = rasterise(AMIDST, *within.scene)
    assert (seen.id == first).mean() > 0.999
    assert 0 not in seen.id


@pytest.mark.parametrize("kinds", [1, 3], ids=["spheres", "mixed"])
def test_a_parallel_view_is_told_how_deep_light_goes(kinds):
    particles = crowd(7, 160, 5.0, 0.2, 1.0, kinds)
    seen = rasterise(ABOVE, *particles.scene)
    true = distances(ABOVE, particles).min(axis=0)
    some = np.isfinite(true)
    assert 1000 < some.sum() < some.size
    assert np.array_equal(some, np.isfinite(seen.inverse_depth))
    assert -seen.inverse_depth[some] == pytest.approx(true[some], rel=1e-6, abs=1e-6)
    assert (seen.id == -1).all()


@pytest.mark.parametrize("kind", range(3, len(KINDS)), ids=[f"{kind.name} {kind.rounding}" for kind in KINDS[3:]])
def test_the_shadow_of_a_rounded_shape_begins_within_it_and_has_its_outline(kind):
    for seed in range(8):
        one = crowd(seed, 1, 2.0, 1.5, 3.0)._replace(number=np.array([kind]))
        buffer = rasterise(ABOVE, *one.scene)
        start, way = rays(ABOVE)
        placed = (KINDS[kind], one.size[0], one.orientation[0])
        middle = ABOVE.axes @ (one.position[0] - ABOVE.eye)
        enter, _ = onto(ABOVE, start, way, middle, *placed)
        back, _ = onto(ABOVE, start + 2.0 * middle[2] * way, -way, middle, *placed)
        leave = 2.0 * middle[2] - back
        met = np.isfinite(enter)
        assert met.sum() > 50
        assert np.array_equal(met, np.isfinite(buffer.inverse_depth))
        begins = -buffer.inverse_depth[met]
        assert (begins > enter[met] - 1e-5).all() and (begins < leave[met] + 1e-5).all()


def test_hulls_of_many_faces_are_seen_like_any_other(monkeypatch):
    points = np.random.default_rng(7).normal(size=(300, 3))
    ball = 0.5 * points / np.linalg.norm(points, axis=1)[:, None]
    ring = [(0.5 * np.cos(t), 0.5 * np.sin(t)) for t in np.arange(60) * np.pi / 30.0]
    drum = hull("drum", [(x, y, z) for z in (-0.4, 0.4) for x, y in ring])
    for module in (sight, sys.modules[__name__]):
        monkeypatch.setattr(module, "KINDS", (sphere(), hull("ball", ball), drum))
    test_each_pixel_sees_what_its_ray_meets_first(WITHOUT, 1, 3)
    test_each_pixel_sees_what_its_ray_meets_first(AMIDST, 1, 3)
    test_a_parallel_view_is_told_how_deep_light_goes(3)


def test_behind_a_wall_nothing_is_seen():
    dense = crowd(3, 4000, 4.0, 0.25, 0.45)
    wall = Crowd(np.array([1]), np.array([30.0]), np.array([[-15.0, 0.0, 0.0]]), np.array([[1.0, 0.0, 0.0, 0.0]]))
    behind = dense._replace(position=dense.position - [60.0, 0.0, 0.0])
    both = Crowd(*(np.concatenate(pair) for pair in zip(behind, wall, strict=True)))
    assert (rasterise(projection((9.0, 0.1, 0.2)), *both.scene).id == 4000).all()


@pytest.mark.parametrize("view", [WITHOUT, AMIDST, ABOVE], ids=["from without", "from amidst", "from above"])
def test_in_a_dense_crowd_of_many_groups_all_is_seen_as_one_by_one(view):
    # Few enough for rays, of very different sizes, one far away from all others.
    particles = crowd(9, 600, 3.0, 0.02, 0.5)
    particles.position[7] = -2e4, 3e4, 1e4
    met = distances(view, particles)
    seen = rasterise(view, *particles.scene)
    true = met.min(axis=0)
    close = -true if view.parallel else 1.0 / true
    assert (np.unique(seen.id).size > 25) != view.parallel
    some = np.isfinite(true)
    assert np.array_equal(some, np.isfinite(seen.inverse_depth))
    assert seen.inverse_depth[some] == pytest.approx(close[some], rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("view", [WITHOUT, AMIDST, ABOVE], ids=["from without", "from amidst", "from above"])
@pytest.mark.parametrize("kinds", [3, len(KINDS)], ids=["plain", "rounded too"])
def test_the_number_of_threads_changes_nothing(view, threads, kinds):
    # As many as are shared out between threads.
    particles = crowd(5, 5000, 5.0, 0.05, 0.3, kinds)
    buffers = []
    for count in (1, 2, 4):
        threads(count)
        buffers.append(rasterise(view, *particles.scene))
    for other in buffers[1:]:
        assert np.array_equal(buffers[0].inverse_depth, other.inverse_depth)
        assert np.array_equal(buffers[0].id, other.id)
        assert np.array_equal(faces(buffers[0], kinds), faces(other, kinds))


@pytest.mark.parametrize("view", [WITHOUT, AMIDST, ABOVE], ids=["from without", "from amidst", "from above"])
def test_the_order_of_particles_changes_nothing(view):
    particles = crowd(6, 300, 5.0, 0.2, 0.9)
    order = np.random.default_rng(8).permutation(300)
    one, other = rasterise(view, *particles.scene), rasterise(view, *particles.only(order).scene)
    assert np.array_equal(one.inverse_depth, other.inverse_depth)
    other = other._replace(id=np.where(other.id >= 0, order[other.id], -1))
    assert np.array_equal(one.id, other.id)
    assert np.array_equal(faces(one), faces(other))


@pytest.mark.parametrize("view", [WITHOUT, ABOVE], ids=["perspective", "parallel"])
def test_an_empty_world_is_looked_at(view):
    seen = rasterise(view, *crowd(0, 0, 1.0, 0.1, 0.2).scene)
    assert (seen.inverse_depth == -np.inf).all() and seen.inverse_depth.shape == (61, 83)
    assert (seen.id == -1).all()


def floor_seen(scene, eye):
    """Where the ray through each pixel's middle meets the floor, and its way, both (height, width, 3), from the top."""
    size = scene.movie.size
    view = projection(eye, scale=0.5 * size[1] / np.tan(np.radians(20.0)), size=size, roll=0.0)
    way = rays(view)[1][::-1] @ view.axes
    assert (way[..., 2] < 0.0).all()
    return view.eye + ((-0.5 * scene.world.size[2] - view.eye[2]) / way[..., 2])[..., None] * way, way


@pytest.mark.parametrize("kind", ["sphere", "cube", "capsule"])
def test_exactly_what_is_hidden_from_the_light_is_dark(kind):
    eye, middle, half = np.array([9.0, 1.0, 14.0]), np.array([0.4, -0.7, 0.0]), 1.0
    camera = {"kind": "look-at", "position": tuple(eye)}
    scene = make_scene("red", world={"boundary": "wall"}, camera=camera)
    scene = scene.model_copy(update={"movie": scene.movie.model_copy(update={"quality": "draft"})})
    shape = {"sphere": sphere(), "cube": cube(), "capsule": capsule(1.0)}[kind]
    bare = draw(scene, [shape], [2.0 * half], make_frame([(0.0, 0.0, 900.0)])).astype(int)
    image = draw(scene, [shape], [2.0 * half], make_frame([middle])).astype(int)
    place, way = floor_seen(scene, eye)
    light = key_light(scene, 100).towards

    def meets(start, way):
        """Whether the line from each place meets the particle."""
        way = np.broadcast_to(way, start.shape)
        if kind == "sphere":
            along = ((middle - start) * way).sum(axis=-1) / (way**2).sum(axis=-1)
            return np.linalg.norm(start + along[..., None] * way - middle, axis=-1) <= half
        if kind == "capsule":  # its axis is upright: the point of it that is nearest to a line
            up, square = np.array([0.0, 0.0, 1.0]), (way**2).sum(axis=-1)
            arm, axis = (
                (v - (v * way).sum(axis=-1, keepdims=True) / square[..., None] * way) for v in (middle - start, up)
            )
            high = np.clip(-(arm * axis).sum(axis=-1) / (axis**2).sum(axis=-1), -half, half)
            return np.linalg.norm(arm + high[..., None] * axis, axis=-1) <= half
        near, far = np.sort([(middle - half - start) / way, (middle + half - start) / way], axis=0)
        return near.max(axis=-1) <= far.min(axis=-1)

    blocked, covered = meets(place, light), meets(np.broadcast_to(eye, place.shape), way)
    inside = (np.abs(place[..., :2]) < 3.0).all(axis=-1)
    soft = edge(blocked)
    for _ in range(6):  # as wide as half of it is
        soft = soft | edge(soft)
    judged = inside & ~covered & ~edge(covered) & ~soft
    darker = (bare - image).max(axis=2)
    assert (judged & blocked).sum() > 100
    assert (darker[judged & blocked] > 30).all()
    assert (np.abs(darker[judged & ~blocked]) <= 1).all()
