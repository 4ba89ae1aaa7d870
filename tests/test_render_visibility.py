"""What is seen at each pixel, against rays cast one by one; and what lies in the shadow."""

import numpy as np
import pytest

from particlesim.constants import SPHERE
from particlesim.crew import use_threads
from particlesim.rendering.lighting import key_light
from particlesim.rendering.sphere_tracing import TILE
from particlesim.rendering.visibility import look, renumber
from particlesim.shapes import cube, sphere
from tests.sight import KINDS, Crowd, crowd, distances, outlook, rays
from tests.test_render_picture import draw, edge, make_frame, make_scene

WITHOUT = outlook((9.0, 3.0, 4.0))
# In one's hand's reach: spheres beside the eye, and hulls through its plane.
AMIDST = outlook((0.3, 0.2, -0.1), target=(-1.0, 0.5, 0.3), scale=40.0)
ABOVE = outlook((2.0, 1.0, 5.0), parallel=True, scale=9.0)

# OpenGL draws hulls aside by at most the first of these [pixels]; past the other all agree whether a hull is there.
DRAWN, FIRM = 1.0 / 256.0, 1.0 / 64.0
CORNERS = [(x, y) for x in (-1.0, 1.0) for y in (-1.0, 1.0)]


@pytest.fixture
def threads():
    """Sets the number of threads for a test."""
    yield use_threads
    use_threads(None)


def is_ball(particles):
    return np.array([kind.kind == SPHERE for kind in KINDS])[particles.number]


def about(view, seed):
    """A crowd, in it two spheres that reach beside one who stands amidst, one more before them and one behind."""
    particles = crowd(seed, 160, 5.0, 0.2, 1.0)
    beside = np.array([[0.6, 0.1, 0.3], [-0.55, 0.0, -0.1]]) @ AMIDST.axes + AMIDST.eye
    particles.position[[0, 3]] = beside if view is AMIDST else particles.position[[0, 3]]
    particles.size[[0, 3]] = 0.8, 1.0
    return particles


def nearest(view, particles, moved=(0.0, 0.0)):
    """Number (height, width) of the particle that rays meet first, -1 for none, and how far it and the next one are."""
    met = distances(view, particles, moved)
    first = np.argmin(met, axis=0)
    two = np.partition(met, 1, axis=0)[:2]
    return np.where(np.isfinite(two[0]), first, -1), *two


@pytest.mark.parametrize("view", [WITHOUT, AMIDST], ids=["from without", "from amidst"])
@pytest.mark.parametrize("seed", [1, 2])
def test_each_pixel_sees_what_its_ray_meets_first(view, seed):
    particles = about(view, seed)
    sight = look(view, *particles.where)
    ball = is_ball(particles)
    far, little = ([nearest(view, particles, (s * x, s * y))[0] for x, y in CORNERS] for s in (FIRM, DRAWN))
    first, near, next_to_it = nearest(view, particles)
    # Where something else is seen once hulls are a little aside, as at their outlines, either is right.
    firm = np.all([one == first for one in far], axis=0) & ((first < 0) | (next_to_it > near * (1.0 + 1e-5)))
    assert firm.mean() > 0.98
    expected = np.where((first >= 0) & ball[first], first, -1)
    assert len(np.unique(expected)) > 5
    assert np.array_equal(sight.owner[firm], expected[firm])
    seen = firm & (expected >= 0)
    assert sight.close[seen] == pytest.approx(1.0 / near[seen], rel=1e-5)
    nothing = firm & (first < 0)
    assert (sight.close[nothing] == -np.inf).all()
    # A hull hides what it hides wherever in its pixel's hundredth it is drawn: it counts for a little less.
    hull = firm & (first >= 0) & ~ball[first]
    assert hull.sum() > 100
    assert (sight.close[hull] <= (1.0 + 1e-5) / near[hull]).all()
    assert np.median(sight.close[hull] * near[hull]) == pytest.approx(1.0, abs=2e-3)
    # None of the hulls that are seen is left out.
    shown = {i for i in np.unique([first, *little]).tolist() if i >= 0 and not ball[i]}
    assert len(shown) > 10
    assert shown <= set(sight.hulls.tolist())
    assert not ball[sight.hulls].any()
    # Squares of the picture with spheres are told, at least.
    for row, column in np.argwhere(sight.owner >= 0) // TILE:
        assert sight.tiles[row, column]


def test_those_beside_the_eye_are_among_the_seen():
    particles = about(AMIDST, 1)
    z = (particles.position - AMIDST.eye) @ AMIDST.axes[2]
    outer, ball = particles.bodies.outer, is_ball(particles)
    beside = np.abs(z) < outer
    sight = look(AMIDST, *particles.where)
    assert beside[[0, 3]].all() and np.isin([0, 3], sight.owner).all()
    assert (beside & ~ball).sum() > 3
    assert set(np.flatnonzero(beside & ~ball).tolist()) <= set(sight.hulls.tolist())
    # What is behind the eye altogether is neither seen nor drawn.
    assert not np.isin(np.flatnonzero(z < -outer), np.append(sight.hulls, sight.owner)).any()


def test_from_within_a_sphere_the_others_are_seen():
    within = crowd(4, 60, 5.0, 0.2, 0.9, kinds=1)
    within = within._replace(position=np.vstack([AMIDST.eye + 0.05, within.position[1:]]))
    first, _, _ = nearest(AMIDST, within)
    sight = look(AMIDST, *within.where)
    assert (sight.owner == first).mean() > 0.999
    assert 0 not in sight.owner


@pytest.mark.parametrize("kinds", [1, 3], ids=["spheres", "mixed"])
def test_a_parallel_view_is_told_how_deep_light_goes(kinds):
    particles = crowd(7, 160, 5.0, 0.2, 1.0, kinds)
    sight = look(ABOVE, *particles.where)
    true = distances(ABOVE, particles).min(axis=0)
    deep = np.array([distances(ABOVE, particles, (FIRM * x, FIRM * y)).min(axis=0) for x, y in CORNERS])
    # Not so where hulls a little aside let the light in, or stop it, elsewhere.
    with np.errstate(invalid="ignore"):
        firm = ((np.abs(deep - true) < 0.05) | (deep == true)).all(axis=0)
    assert firm.mean() > 0.9
    true, found = true[firm], -sight.close[firm].astype(float)
    assert np.array_equal(np.isfinite(true), np.isfinite(found))
    some = np.isfinite(true)
    assert some.sum() > 1000
    assert found[some] == pytest.approx(true[some], rel=1e-5, abs=1e-5)
    assert not len(sight.hulls) and (sight.owner == -1).all()


def test_hidden_hulls_are_mostly_left_out():
    dense = crowd(3, 4000, 4.0, 0.25, 0.45)
    sight = look(WITHOUT, *dense.where)
    hulls = np.count_nonzero(~is_ball(dense))
    assert 0 < len(sight.hulls) < 0.4 * hulls
    # Behind a wall, nothing is left.
    wall = Crowd(np.array([1]), np.array([30.0]), np.array([[-25.0, 0.0, 0.0]]), np.array([[1.0, 0.0, 0.0, 0.0]]))
    behind = dense.only(slice(0, 200))._replace(position=dense.position[:200] - [60.0, 0.0, 0.0])
    both = Crowd(*(np.concatenate(pair) for pair in zip(wall, behind, strict=True)))
    assert look(outlook((9.0, 0.1, 0.2)), *both.where).hulls.tolist() == [0]


@pytest.mark.parametrize("view", [WITHOUT, AMIDST, ABOVE], ids=["from without", "from amidst", "from above"])
def test_the_number_of_threads_changes_nothing(view, threads):
    # As many as are shared out between threads.
    particles = crowd(5, 5000, 5.0, 0.05, 0.3)
    sights = []
    for count in (1, 2, 4):
        threads(count)
        sights.append(look(view, *particles.where))
    for other in sights[1:]:
        assert np.array_equal(sights[0].close, other.close)
        assert np.array_equal(sights[0].owner, other.owner)
        assert np.array_equal(sights[0].tiles, other.tiles)
    # Other strips hide other hulls from one another, and those that are seen are in all of them.
    if not view.parallel:
        few = particles.only(slice(0, 300))
        first, _, _ = nearest(view, few)
        seen = set(np.unique(first[first >= 0]).tolist()) - set(np.flatnonzero(is_ball(few)).tolist())
        for count in (1, 2, 4):
            threads(count)
            assert seen <= set(look(view, *few.where).hulls.tolist())


@pytest.mark.parametrize("view", [WITHOUT, AMIDST, ABOVE], ids=["from without", "from amidst", "from above"])
def test_the_order_of_particles_changes_nothing(view):
    particles = crowd(6, 300, 5.0, 0.2, 0.9)
    order = np.random.default_rng(8).permutation(300)
    one, other = look(view, *particles.where), look(view, *particles.only(order).where)
    assert np.array_equal(one.close, other.close)
    assert np.array_equal(one.owner, np.where(other.owner >= 0, order[other.owner], -1))
    assert sorted(one.hulls.tolist()) == sorted(order[other.hulls].tolist())


def test_spheres_that_are_seen_get_numbers_in_the_order_they_occur():
    owner = np.array([[-1, 7, 7], [2, -1, 7], [5, 2, 0]], dtype=np.int32)
    assert renumber(owner, 9).tolist() == [7, 2, 5, 0]
    assert owner.tolist() == [[-1, 0, 0], [1, -1, 0], [2, 1, 3]]
    nobody = np.full((2, 2), -1, dtype=np.int32)
    assert renumber(nobody, 0).shape == (0,)
    assert (nobody == -1).all()


@pytest.mark.parametrize("view", [WITHOUT, ABOVE], ids=["perspective", "parallel"])
def test_an_empty_world_is_looked_at(view):
    sight = look(view, *crowd(0, 0, 1.0, 0.1, 0.2).where)
    assert (sight.close == -np.inf).all() and sight.close.shape == (61, 83)
    assert (sight.owner == -1).all() and not sight.tiles.any() and not len(sight.hulls)


def floor_seen(scene, eye):
    """Where the ray through each pixel's middle meets the floor, and its way, both (height, width, 3), from the top."""
    size = scene.movie.size
    view = outlook(eye, scale=0.5 * size[1] / np.tan(np.radians(20.0)), size=size, roll=0.0)
    way = rays(view)[1][::-1] @ view.axes
    assert (way[..., 2] < 0.0).all()
    return view.eye + ((-0.5 * scene.world.size[2] - view.eye[2]) / way[..., 2])[..., None] * way, way


@pytest.mark.parametrize("kind", ["sphere", "cube"])
def test_exactly_what_is_hidden_from_the_light_is_dark(kind):
    eye, middle, half = np.array([9.0, 1.0, 14.0]), np.array([0.4, -0.7, 0.0]), 0.8
    camera = {"kind": "look-at", "position": tuple(eye)}
    scene = make_scene("red", world={"boundary": "wall"}, camera=camera)
    scene = scene.model_copy(update={"movie": scene.movie.model_copy(update={"quality": "draft"})})
    shape = sphere() if kind == "sphere" else cube()
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
        near, far = np.sort([(middle - half - start) / way, (middle + half - start) / way], axis=0)
        return near.max(axis=-1) <= far.min(axis=-1)

    blocked, covered = meets(place, light), meets(np.broadcast_to(eye, place.shape), way)
    inside = (np.abs(place[..., :2]) < 3.0).all(axis=-1)
    band = edge(blocked) | edge(covered)
    for _ in range(2):  # as wide as the shadow map is coarse
        band = band | edge(band)
    judged = inside & ~covered & ~band
    darker = (bare - image).max(axis=2)
    assert (judged & blocked).sum() > 200
    assert (darker[judged & blocked] > 30).all()
    assert (np.abs(darker[judged & ~blocked]) <= 1).all()
