"""Pictures of known particles, pixel by pixel."""

import numpy as np
import pytest

from particlesim.core.constants import SPHERE
from particlesim.geometry import shapes
from particlesim.rendering import Renderer
from particlesim.rendering.look import look_of
from particlesim.rendering.shading.lighting import towards_light
from particlesim.scene import Scene
from particlesim.trajectory.frames import Frame, Header

WIDTH, HEIGHT = 320, 240
EYE = np.array([10.0, 0.0, 0.0])
SLOPE = np.tan(np.radians(20.0))  # of the upper edge of a picture with a field of view of 40 degrees
WHITE = "#ffffff"


def make_scene(*colours, world=None, background=WHITE, camera=None, **show):
    return Scene(
        world={"size": (6.0, 6.0, 6.0), "boundary": "open", **(world or {})},
        particles=[{"shape": "sphere", "count": 1, "colour": colour} for colour in colours],
        movie={"resolution": (WIDTH, HEIGHT), "background": background},
        camera=camera or {"kind": "look-at", "position": tuple(EYE)},
        show={"box": False, "readout": False, **show},
    )


def make_frame(position, orientation=None):
    position = np.asarray(position, dtype=float)
    turn = np.tile([1.0, 0.0, 0.0, 0.0], (len(position), 1)) if orientation is None else np.asarray(orientation)
    still = np.zeros_like(position)
    return Frame(0.0, position, turn, still, still, still.astype(int), np.zeros(len(position), int))


def make_header(shape_list, number, size):
    """Particles whose shape and group have the same ``number`` (n,)."""
    size = np.asarray(size, dtype=float)
    return Header("", tuple(shape_list), number, size, number, np.ones(len(size)), np.ones((len(size), 3)))


def draw(scene, shape_list, size, frame):
    """The picture of one particle a group, each of its own shape."""
    header = make_header(shape_list, np.arange(len(size)), size)
    with Renderer(look_of(scene, header, frame)) as renderer:
        return renderer.draw(frame)


def covered(image, background=(255, 255, 255)):
    return np.abs(image.astype(int) - background).max(axis=2) > 40


def rays():
    """Direction of the ray through the middle of each pixel, (height, width, 3), for the camera at EYE."""
    across = (2.0 * (np.arange(WIDTH) + 0.5) / WIDTH - 1.0) * SLOPE * WIDTH / HEIGHT
    up = (1.0 - 2.0 * (np.arange(HEIGHT) + 0.5) / HEIGHT) * SLOPE
    # The camera looks along -x with z up: its right is +y.
    return np.stack(np.broadcast_arrays(-1.0, across[None, :], up[:, None]), axis=-1)


def seen(centre, radius):
    """Which pixels' middles a sphere covers, by the geometry of rays."""
    direction = rays() / np.linalg.norm(rays(), axis=2, keepdims=True)
    arm = np.asarray(centre) - EYE
    along = direction @ arm
    return (arm @ arm - along**2 <= radius**2) & (along > 0.0)


def edge(mask):
    """Pixels of the mask or outside it that touch its outline."""
    padded = np.pad(mask, 1, mode="edge")
    h, w = mask.shape
    around = [padded[1 + dy : 1 + dy + h, 1 + dx : 1 + dx + w] for dy in (-1, 0, 1) for dx in (-1, 0, 1)]
    return np.any(around, axis=0) & ~np.all(around, axis=0)


@pytest.mark.parametrize(
    ("centre", "radius"),
    [
        ((0.0, 0.0, 0.0), 1.0),
        ((0.0, 2.5, -1.5), 0.8),  # off the axis, where the outline is an ellipse
        ((-30.0, 3.0, 2.0), 0.4),  # a few pixels wide
        ((2.0, 5.0, 0.0), 2.5),  # its centre outside the picture
        ((4.0, 0.0, 4.0), 3.0),  # larger than the picture is high
        ((7.0, 1.0, -2.5), 2.4),  # close to the camera
    ],
)
def test_sphere_covers_exactly_the_pixels_whose_rays_meet_it(centre, radius):
    scene = make_scene("red")
    image = draw(scene, [shapes.sphere()], [2.0 * radius], make_frame([centre]))
    expected = seen(centre, radius)
    wrong = (covered(image) != expected) & ~edge(expected)
    assert expected.any() and not wrong.any()


def test_sphere_has_its_colour_and_soft_edges():
    image = draw(make_scene("#c02020"), [shapes.sphere()], [2.0], make_frame([(0.0, 0.0, 0.0)])).astype(int)
    middle = image[HEIGHT // 2, WIDTH // 2]
    assert middle[0] > 2 * middle[1] and middle[0] > 2 * middle[2]
    outline = image[edge(seen((0.0, 0.0, 0.0), 1.0))]
    assert len(np.unique(outline[:, 1])) > 10


def test_area_of_a_sphere_is_right_to_a_fraction_of_a_pixel():
    # All pixels alike but for the edge: a black sphere's darkness adds up to its area.
    scene = make_scene("black", camera={"kind": "look-at", "position": (60.0, 0.0, 0.0)})
    radius = 2.0
    image = draw(scene, [shapes.sphere()], [2.0 * radius], make_frame([(0.0, 0.0, 0.0)])).astype(float)
    darkness = np.where(image[..., 2] < 140, 1.0, (255.0 - image[..., 2]) / 255.0).sum()
    pixels = np.tan(np.arcsin(radius / 60.0)) / SLOPE * HEIGHT / 2.0
    assert darkness == pytest.approx(np.pi * pixels**2, rel=0.03)


def test_nearer_particle_hides_the_farther_whatever_their_order():
    for front, back in (("red", "lime"), ("lime", "red")):
        scene = make_scene(back, front)
        frame = make_frame([(-2.0, 0.0, 0.0), (2.0, 0.0, 0.0)])
        image = draw(scene, [shapes.sphere(), shapes.cube()], [1.6, 0.8], frame).astype(int)
        middle = image[HEIGHT // 2, WIDTH // 2]
        assert np.argmax(middle) == (0 if front == "red" else 1)


@pytest.mark.parametrize("size", [(64, 48), (66, 50), (72, 56), (74, 58), (78, 46), (16, 14)])
@pytest.mark.parametrize("shape", [shapes.sphere(), shapes.cube()], ids=["sphere", "cube"])
def test_a_picture_full_of_one_particle_is_full_to_its_rims(size, shape):
    # Whatever is left of tiles there.
    scene = make_scene("black")
    scene = scene.model_copy(update={"movie": scene.movie.model_copy(update={"resolution": size})})
    image = draw(scene, [shape], [60.0], make_frame([(-40.0, 0.0, 0.0)]))
    assert image.shape == (size[1], size[0], 3)
    assert (image < 200).all()


def test_touching_spheres_and_cubes_hide_each_other_by_their_true_surface():
    # The cube's front face lies before the sphere's centre but behind its foremost point.
    scene = make_scene("red", "blue")
    frame = make_frame([(0.0, 0.0, 0.0), (-0.3, 0.0, 0.0)])
    image = draw(scene, [shapes.sphere(), shapes.cube()], [2.0, 2.0], frame).astype(int)
    assert np.argmax(image[HEIGHT // 2, WIDTH // 2]) == 0
    corner = round(0.9 / 9.3 / SLOPE * HEIGHT / 2.0)
    assert np.argmax(image[HEIGHT // 2 + corner, WIDTH // 2 + corner]) == 2


def test_cube_has_the_outline_of_its_front_face():
    image = draw(make_scene("navy"), [shapes.cube()], [2.0], make_frame([(0.0, 0.0, 0.0)]))
    rows, columns = np.nonzero(covered(image))
    half = 1.0 / 9.0 / SLOPE * HEIGHT / 2.0
    assert rows.min() == pytest.approx(HEIGHT / 2 - half, abs=1.0)
    assert rows.max() + 1 == pytest.approx(HEIGHT / 2 + half, abs=1.0)
    assert columns.min() == pytest.approx(WIDTH / 2 - half, abs=1.0)
    assert columns.max() + 1 == pytest.approx(WIDTH / 2 + half, abs=1.0)
    assert covered(image).sum() == pytest.approx(4.0 * half**2, rel=0.05)


def test_pyramid_turns_as_its_quaternion_says():
    # A quarter turn about x takes the top from +z to -y, which is on the picture's left.
    turn = [[np.cos(np.pi / 4), np.sin(np.pi / 4), 0.0, 0.0]]
    upright = covered(draw(make_scene("navy"), [shapes.pyramid()], [3.0], make_frame(np.zeros((1, 3)))))
    lying = covered(draw(make_scene("navy"), [shapes.pyramid()], [3.0], make_frame(np.zeros((1, 3)), turn)))
    rows, columns = upright.sum(axis=1), lying.sum(axis=0)
    height, width = np.flatnonzero(rows), np.flatnonzero(columns)
    assert rows[height[3]] < 10 < rows[height[-4]]
    assert columns[width[3]] < 10 < columns[width[-4]]


def test_impostor_and_fine_mesh_have_the_same_outline():
    # Points spread evenly over a sphere along a spiral of golden angles.
    number = np.arange(1500) + 0.5
    z = 1.0 - 2.0 * number / len(number)
    turn = np.pi * (1.0 + np.sqrt(5.0)) * number
    points = np.column_stack([np.sqrt(1.0 - z * z) * np.cos(turn), np.sqrt(1.0 - z * z) * np.sin(turn), z])
    fine = shapes.hull("ball", 0.5 * points)
    frame = make_frame([(1.0, 1.2, -0.7)])
    exact, faceted = (covered(draw(make_scene("navy"), [s], [2.4], frame)) for s in (shapes.sphere(), fine))
    different = exact != faceted
    assert not (different & ~edge(exact)).any()
    assert different.sum() < 0.25 * edge(exact).sum()


@pytest.mark.parametrize(
    "shape",
    [shapes.capsule(1e-4), shapes.hull("grain", 1e-4 * shapes.cube().vertices, rounding=0.5)],
    ids=["capsule", "polyhedron"],
)
def test_a_rounded_shape_of_hardly_any_core_is_shaded_as_a_sphere(shape):
    frame = make_frame([(2.0, 1.2, -0.7)], [[0.5, 0.5, -0.1, 0.7]])
    scene = make_scene("#c08020", world={"boundary": "wall"})
    ball, rounded = (draw(scene, [kind], [2.4], frame).astype(int) for kind in (shapes.sphere(), shape))
    # Along their outlines pixels differ by what is covered of them.
    differ = np.abs(ball - rounded).max(axis=2)
    assert (differ <= 1).mean() > 0.995
    assert (differ[~(edge(seen((2.0, 1.2, -0.7), 1.2)))] <= 3).mean() > 0.999


def test_lit_faces_have_no_shadow_of_their_own():
    turn = np.array([[0.8, 0.1, 0.5, 0.3]])
    turn /= np.linalg.norm(turn)
    image = draw(make_scene("white", background="#000000"), [shapes.cube()], [3.0], make_frame(np.zeros((1, 3)), turn))
    colours, counts = np.unique(image.reshape(-1, 3), axis=0, return_counts=True)
    # The background and three faces, each of one colour; the rest is edges.
    assert np.sort(counts)[-4:].sum() > 0.93 * image.shape[0] * image.shape[1]
    assert np.sort(counts)[-4] > 300
    assert len(colours) < 2000


def test_particles_cast_shadows_on_the_floor_which_only_a_wall_has():
    camera = {"kind": "look-at", "position": (14.0, 0.0, 9.0)}
    nothing = make_frame([(0.0, 0.0, 500.0)])
    ball = make_frame([(0.0, 0.0, -1.5)])
    pictures = {}
    for boundary in ("wall", "periodic"):
        scene = make_scene("red", world={"boundary": boundary}, camera=camera)
        pictures[boundary] = [draw(scene, [shapes.sphere()], [2.0], frame).astype(int) for frame in (nothing, ball)]
    assert np.all(pictures["periodic"][0] == 255)
    empty, with_ball = pictures["wall"]
    assert np.any(empty < 255) and empty.min() > 230
    grey = (np.ptp(with_ball, axis=2) < 12) & (with_ball.max(axis=2) < 220)
    assert grey.sum() > 300
    assert not np.any(with_ball[:3] < 255)


def pixel_of(point, position, target=(0.0, 0.0, 0.0)):
    """Row and column, not whole, where a camera at a position sees a point."""
    back = np.subtract(position, target) / np.linalg.norm(np.subtract(position, target))
    right = np.cross((0.0, 0.0, 1.0), back)
    right /= np.linalg.norm(right)
    x, y, z = np.subtract(point, position) @ np.column_stack([right, np.cross(back, right), -back])
    per = 0.5 * HEIGHT / SLOPE
    return 0.5 * HEIGHT - per * y / z - 0.5, 0.5 * WIDTH + per * x / z - 0.5


@pytest.mark.parametrize("height", [1.0, 4.0])
def test_edges_that_lie_on_the_floor_are_whole_lines(height):
    eye = (10.0, 4.0, height - 3.0)
    scene = make_scene("red", world={"boundary": "wall"}, box=True, camera={"kind": "look-at", "position": eye})
    image = draw(scene, [shapes.sphere()], [0.1], make_frame([(0.0, 0.0, 2.0)]))[..., 1].astype(int)
    for start, end in (((3, -3), (3, 3)), ((-3, 3), (3, 3)), ((-3, -3), (-3, 3)), ((-3, -3), (3, -3))):
        shares = np.linspace(0.05, 0.95, 61)
        places = [pixel_of((*(np.multiply(1 - s, start) + np.multiply(s, end)), -3.0), eye) for s in shares]
        inside = [(round(r), round(c)) for r, c in places if 2 <= r < HEIGHT - 3 and 2 <= c < WIDTH - 3]
        dark = np.array([image[r - 1 : r + 2, c - 1 : c + 2].min() for r, c in inside])
        assert len(dark) > 10 and dark.max() < image[2, 2] - 30 and np.ptp(dark) < 70


def test_the_floor_bears_whole_shadows_beside_a_tall_world():
    eye, ball = (12.0, 6.0, 6.0), (0.0, 0.0, 2.4)
    camera = {"kind": "look-at", "position": eye, "target": (0.0, 0.0, -3.0)}
    scene = make_scene("red", world={"size": (2.0, 2.0, 6.0), "boundary": "wall"}, camera=camera)
    image = draw(scene, [shapes.sphere()], [1.0], make_frame([ball]))[..., 1].astype(int)
    towards = towards_light(scene)
    foot = np.subtract(ball, 5.4 / towards[2] * towards)
    assert np.abs(foot[:2]).max() > 2.0  # well beside the world
    row, column = (round(float(k)) for k in pixel_of(foot, eye, (0.0, 0.0, -3.0)))
    assert image[row, column] == pytest.approx(0.97 * 0.78 * 255, abs=3)


def test_box_edges_and_cells_are_drawn_over_nothing_but_background():
    plain = make_scene("red")
    frame = make_frame([(0.0, 0.0, 0.0)])
    bare = draw(plain, [shapes.sphere()], [1.0], frame).astype(int)
    boxed = draw(make_scene("red", box=True), [shapes.sphere()], [1.0], frame).astype(int)
    celled = draw(make_scene("red", cells=True), [shapes.sphere()], [1.0], frame).astype(int)
    for image in (boxed, celled):
        changed = np.any(image != bare, axis=2)
        assert 200 < changed.sum() < 0.1 * changed.size
        assert not changed[HEIGHT // 2 - 20 : HEIGHT // 2 + 20, WIDTH // 2 - 20 : WIDTH // 2 + 20].any()


def test_frames_follow_the_particles_and_repeat_to_the_bit():
    rng = np.random.default_rng(3)
    kinds = [shapes.sphere(), shapes.cube(), shapes.pyramid()]
    number = np.arange(60) % 3
    header = make_header(kinds, number, rng.uniform(0.3, 0.6, 60))
    scene = make_scene("red", "green", "blue", world={"boundary": "wall"}, box=True, readout=True)
    frames = [make_frame(rng.uniform(-2.5, 2.5, (60, 3))) for _ in range(2)]
    look = look_of(scene, header, frames[0])
    with Renderer(look) as renderer, Renderer(look) as other:
        first, second, again = (renderer.draw(frame) for frame in (*frames, frames[0]))
        assert first.shape == (HEIGHT, WIDTH, 3) and first.dtype == np.uint8
        assert np.array_equal(first, again) and not np.array_equal(first, second)
        assert np.array_equal(first, other.draw(frames[0]))
        other.close()
        assert np.array_equal(second, renderer.draw(frames[1]))


def test_a_world_without_particles_in_sight_is_background():
    image = draw(make_scene("red", background="#203040"), [shapes.sphere()], [1.0], make_frame([(100.0, 0.0, 0.0)]))
    assert np.all(image == (0x20, 0x30, 0x40))


def test_all_shapes_of_the_catalogue_are_drawn():
    arguments = {"capsule": {"length": 1.0}}
    kinds = [make(**arguments.get(name, {})) for name, make in shapes.CATALOGUE.items() if name != "mesh"]
    assert any(kind.kind == SPHERE for kind in kinds)
    scene = make_scene(*["by_shape"] * len(kinds))
    places = [(0.0, y, 0.0) for y in np.linspace(-3.4, 3.4, len(kinds))]
    mask = covered(draw(scene, kinds, [0.6] * len(kinds), make_frame(places)))
    runs = np.count_nonzero(np.diff(mask.any(axis=0).astype(int)) == 1)
    assert runs == len(kinds)
