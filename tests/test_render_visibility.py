"""What is seen at each pixel, against rays cast one by one; and what lies in the shadow."""

import numpy as np
import pytest

from particlesim.core.constants import SPHERE
from particlesim.core.parallel import use_threads
from particlesim.geometry.shapes import cube, sphere
from particlesim.rendering.shading.lighting import key_light
from particlesim.rendering.visibility.rasterise import look
from tests.sight import KINDS, Crowd, crowd, distances, outlook, rays, through
from tests.test_render_picture import draw, edge, make_frame, make_scene

WITHOUT = outlook((9.0, 3.0, 4.0))
# In one's hand's reach: spheres beside the eye, and hulls through its plane.
AMIDST = outlook((0.3, 0.2, -0.1), target=(-1.0, 0.5, 0.3), scale=40.0)
ABOVE = outlook((2.0, 1.0, 5.0), parallel=True, scale=9.0)


@pytest.fixture
def threads():
    """Sets the number of threads for a test."""
    yield use_threads
    use_threads(None)


def is_ball(particles):
    return np.array([kind.kind == SPHERE for kind in KINDS])[particles.number]


def faces(sight):
    """The faces that are seen, -1 where none is."""
    return np.where((sight.owner >= 0) & (sight.owner % 3 > 0), sight.face, -1)


def about(view, seed):
    """A crowd, in it two spheres that reach beside one who stands amidst, one more before them and one behind."""
    particles = crowd(seed, 160, 5.0, 0.2, 1.0)
    beside = np.array([[0.6, 0.1, 0.3], [-0.55, 0.0, -0.1]]) @ AMIDST.axes + AMIDST.eye
    particles.position[[0, 3]] = beside if view is AMIDST else particles.position[[0, 3]]
    particles.size[[0, 3]] = 0.8, 1.0
    return particles


def nearest(view, particles):
    """Number (height, width) of the particle that rays meet first, -1 for none, and how far it and the next one are."""
    met = distances(view, particles)
    first = np.argmin(met, axis=0)
    two = np.partition(met, 1, axis=0)[:2]
    return np.where(np.isfinite(two[0]), first, -1), *two


@pytest.mark.parametrize("view", [WITHOUT, AMIDST], ids=["from without", "from amidst"])
@pytest.mark.parametrize("seed", [1, 2])
def test_each_pixel_sees_what_its_ray_meets_first(view, seed):
    particles = about(view, seed)
    sight = look(view, *particles.where)
    first, near, next_to_it = nearest(view, particles)
    # Where two are as near, either is right.
    firm = (first < 0) | (next_to_it > near * (1.0 + 1e-6))
    assert firm.mean() > 0.99
    assert np.array_equal(sight.owner[firm], first[firm])
    assert (np.bincount(is_ball(particles)[np.unique(first[first >= 0])].astype(int)) > 5).all()
    assert sight.close[first >= 0] == pytest.approx(1.0 / near[first >= 0], rel=1e-6)
    assert (sight.close[first < 0] == -np.inf).all()
    # Of a hull the face is told by which the ray comes in.
    for i in np.unique(first[first >= 0]):
        kind, seen = KINDS[particles.number[i]], (sight.owner == i) & firm
        if kind.kind != SPHERE:
            middle = view.axes @ (particles.position[i] - view.eye)
            face = through(view, *rays(view), middle, kind, particles.size[i], particles.orientation[i])[2]
            assert (sight.face[seen] == face[seen]).mean() > 0.99


@pytest.mark.parametrize("kind", range(3), ids=[kind.name for kind in KINDS])
def test_those_beside_the_eye_are_seen_as_far_as_they_are_before_it(kind):
    beside = crowd(8, 60, 2.0, 0.3, 0.9)._replace(number=np.full(60, kind))
    beside = beside._replace(position=AMIDST.eye + beside.position * [[1.0, 1.0, 0.4]] @ AMIDST.axes)
    z = (beside.position - AMIDST.eye) @ AMIDST.axes[2]
    outer = beside.bodies.outer
    sight = look(AMIDST, *beside.where)
    first, _, _ = nearest(AMIDST, beside)
    assert (sight.owner == first).mean() > 0.999
    seen = np.unique(first[first >= 0])
    assert (np.abs(z) < outer)[seen].sum() > 1
    assert (z < 0.0)[seen].any()


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
    some = np.isfinite(true)
    assert 1000 < some.sum() < some.size
    assert np.array_equal(some, np.isfinite(sight.close))
    assert -sight.close[some] == pytest.approx(true[some], rel=1e-6, abs=1e-6)
    assert (sight.owner == -1).all()


def test_behind_a_wall_nothing_is_seen():
    dense = crowd(3, 4000, 4.0, 0.25, 0.45)
    wall = Crowd(np.array([1]), np.array([30.0]), np.array([[-15.0, 0.0, 0.0]]), np.array([[1.0, 0.0, 0.0, 0.0]]))
    behind = dense._replace(position=dense.position - [60.0, 0.0, 0.0])
    both = Crowd(*(np.concatenate(pair) for pair in zip(behind, wall, strict=True)))
    assert (look(outlook((9.0, 0.1, 0.2)), *both.where).owner == 4000).all()


@pytest.mark.parametrize("view", [WITHOUT, AMIDST, ABOVE], ids=["from without", "from amidst", "from above"])
def test_in_a_dense_crowd_of_many_groups_all_is_seen_as_one_by_one(view):
    # Few enough for rays, of very different sizes, one far away from all others.
    particles = crowd(9, 600, 3.0, 0.02, 0.5)
    particles.position[7] = -2e4, 3e4, 1e4
    met = distances(view, particles)
    sight = look(view, *particles.where)
    true = met.min(axis=0)
    close = -true if view.parallel else 1.0 / true
    assert (np.unique(sight.owner).size > 25) != view.parallel
    some = np.isfinite(true)
    assert np.array_equal(some, np.isfinite(sight.close))
    assert sight.close[some] == pytest.approx(close[some], rel=1e-6, abs=1e-6)


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
        assert np.array_equal(faces(sights[0]), faces(other))


@pytest.mark.parametrize("view", [WITHOUT, AMIDST, ABOVE], ids=["from without", "from amidst", "from above"])
def test_the_order_of_particles_changes_nothing(view):
    particles = crowd(6, 300, 5.0, 0.2, 0.9)
    order = np.random.default_rng(8).permutation(300)
    one, other = look(view, *particles.where), look(view, *particles.only(order).where)
    assert np.array_equal(one.close, other.close)
    other = other._replace(owner=np.where(other.owner >= 0, order[other.owner], -1))
    assert np.array_equal(one.owner, other.owner)
    assert np.array_equal(faces(one), faces(other))


@pytest.mark.parametrize("view", [WITHOUT, ABOVE], ids=["perspective", "parallel"])
def test_an_empty_world_is_looked_at(view):
    sight = look(view, *crowd(0, 0, 1.0, 0.1, 0.2).where)
    assert (sight.close == -np.inf).all() and sight.close.shape == (61, 83)
    assert (sight.owner == -1).all()


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
