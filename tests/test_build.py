"""From a scene to arrays: where particles start, and how."""

import math

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation
from scipy.stats import kstest

import particlesim as ps
from particlesim.model.materials import Material, contact_laws
from particlesim.setup.build import build
from particlesim.setup.placement import lattice_points

BOX = {"size": [4.0, 4.0, 4.0]}


def built(*groups, world=None, **keys):
    return build(ps.Scene(world={**BOX, **(world or {})}, particles=list(groups), **keys))


def spheres(count=500, size=0.1, **keys):
    return {"shape": "sphere", "count": count, "size": size, **keys}


def turns(quaternions):
    return Rotation.from_quat(np.roll(quaternions, -1, axis=1))


def deepest_overlap_of_spheres(position, diameter, period=None):
    """The largest overlap of any two spheres [m], by a k-d tree."""
    box = None if period is None else np.array(period)
    shift = 0.0 if box is None else 0.5 * box
    tree = cKDTree((position + shift) % box if box is not None else position, boxsize=box)
    pairs = tree.query_pairs(diameter.max(), output_type="ndarray")
    apart = position[pairs[:, 0]] - position[pairs[:, 1]]
    if box is not None:
        apart -= box * np.round(apart / box)
    return (0.5 * (diameter[pairs[:, 0]] + diameter[pairs[:, 1]]) - np.linalg.norm(apart, axis=1)).max(initial=0.0)


# ---- what particles are -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("shape", "volume"),
    [
        ("sphere", math.pi / 6.0),
        ("cube", 1.0),
        ("tetrahedron", 1.0 / (6.0 * math.sqrt(2.0))),
        ("pyramid", 1.0 / 3.0),
        ({"kind": "pyramid", "height": 1.5}, 0.5),
        ({"kind": "box", "edges": [1.0, 2.0, 3.0]}, 6.0),
    ],
)
def test_masses_follow_from_the_density_or_are_given(shape, volume):
    group = {"shape": shape, "count": 2, "size": 0.2}
    made = built(group, {**group, "density": 500.0}, {**group, "mass": 3.0})
    expected = [1000.0 * volume * 0.008] * 2 + [500.0 * volume * 0.008] * 2 + [3.0] * 2
    assert made.particles["mass"] == pytest.approx(expected, rel=1e-12)
    assert len(made.shapes) == 1


def test_inertia_of_a_box_is_that_of_the_book():
    made = built({"shape": {"kind": "box", "edges": [1.0, 2.0, 3.0]}, "count": 1, "size": 0.3, "mass": 2.0})
    a, b, c = 0.3, 0.6, 0.9
    book = [2.0 / 12.0 * (b * b + c * c), 2.0 / 12.0 * (a * a + c * c), 2.0 / 12.0 * (a * a + b * b)]
    assert sorted(made.particles["principal_inertia"][0]) == pytest.approx(sorted(book), rel=1e-12)


def test_sizes_follow_their_law():
    law = {"low": 0.02, "high": 0.08}
    made = built(
        spheres(2000, {"kind": "uniform", **law}),
        spheres(2000, {"kind": "log-uniform", **law}),
        world={"size": [9] * 3},
    )
    uniform, logarithmic = made.particles["scale"][:2000], made.particles["scale"][2000:]
    assert kstest(uniform, "uniform", args=(0.02, 0.06)).pvalue > 0.01
    assert kstest(np.log(logarithmic / 0.02) / np.log(4.0), "uniform").pvalue > 0.01


def test_restitution_is_the_groups_or_the_worlds():
    made = built(spheres(1), spheres(1, restitution=0.5), world={"restitution": 0.9})
    assert made.restitution[made.particles["material"]].tolist() == [0.9, 0.5]
    assert made.restitution[made.system.body["material"][made.system.bounded :]].tolist() == [0.9] * 6
    laws = made.system.law["restitution"]
    assert laws.tolist() == [[0.9, 0.9, 0.5], [0.9, 0.9, 0.5], [0.5, 0.5, 0.5]]


def test_a_surface_is_the_groups_or_the_worlds_and_a_pair_takes_the_smaller_value():
    smooth = {"friction": 0.1, "rolling_friction": 0.002}
    rough = {"friction": 0.7, "static_friction": 0.9, "tangential_restitution": 0.5}
    walls = {"friction": 0.4, "tangential_restitution": -0.5, "rolling_friction": 0.001}
    laws = built(spheres(1), spheres(1, **smooth), spheres(1, **rough), world=walls).system.law
    assert laws["friction"][0].tolist() == [0.4, 0.4, 0.1, 0.4]
    assert laws["friction"][3].tolist() == [0.4, 0.4, 0.1, 0.7]
    assert laws["static_friction"][3].tolist() == [0.4, 0.4, 0.1, 0.9]
    assert laws["rolling_friction"][2].tolist() == [0.001, 0.001, 0.002, 0.001]
    assert laws["tangential_restitution"][3].tolist() == [-0.5, -0.5, -0.5, 0.5]
    for name in laws.dtype.names:
        assert np.array_equal(laws[name], laws[name].T)


def test_contacts_between_groups_override_what_their_surfaces_say():
    groups = spheres(1, name="a", friction=0.2), spheres(1, name="b", restitution=0.5), spheres(1)
    contacts = [
        {"between": ["a", "b"], "restitution": 0.9, "friction": 0.8},
        {"between": ["walls", "b"], "static_friction": 0.9},
        {"between": ["b", "b"], "tangential_restitution": 1.0},
    ]
    laws = built(*groups, world={"friction": 0.3}, contact=contacts).system.law
    assert laws["restitution"].tolist() == [[1, 1, 0.5, 1], [1, 1, 0.9, 1], [0.5, 0.9, 0.5, 0.5], [1, 1, 0.5, 1]]
    assert laws["friction"].tolist() == [
        [0.3, 0.2, 0.3, 0.3],
        [0.2, 0.2, 0.8, 0.2],
        [0.3, 0.8, 0.3, 0.3],
        [0.3, 0.2, 0.3, 0.3],
    ]
    assert laws["static_friction"][2].tolist() == [0.9, 0.8, 0.3, 0.3]
    assert laws["tangential_restitution"][2].tolist() == [0, 0, 1, 0]


@pytest.mark.parametrize(
    ("name", "value", "allowed"),
    [
        ("restitution", 1.5, "0 to 1"),
        ("friction", -1.0, r"0 to 1e\+30"),
        ("tangential_restitution", math.nan, "-1 to 1"),
    ],
)
def test_materials_from_python_are_checked(name, value, allowed):
    with pytest.raises(ValueError, match=f"{name} of a material must be a number from {allowed}, not {value:g}"):
        contact_laws([Material(), Material(**{name: value})])


def test_boundaries_are_set_axis_by_axis():
    world = built(spheres(1), world={"size": [4, 5, 6], "boundary": ["wall", "periodic", "open"]}).system.domain[0]
    assert world["period"].tolist() == [0.0, 5.0, 0.0]
    assert (world["lower"].tolist(), world["upper"].tolist()) == ([-2.0, -2.5, -3.0], [2.0, 2.5, 3.0])
    assert len(set(world["boundary"].tolist())) == 3


# ---- where they start ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("boundary", ["wall", "periodic"])
@pytest.mark.parametrize(
    "group",
    [
        spheres(3000, (0.3 * 64.0 * 6.0 / math.pi / 3000) ** (1.0 / 3.0)),
        spheres(3000, {"kind": "log-uniform", "low": 0.01, "high": 0.5}),
        spheres(400, 0.2, placement={"kind": "cluster", "clusters": 3, "spread": 0.8}),
        spheres(400, 0.2, placement={"kind": "lattice", "jitter": 1.0}),
    ],
    ids=["a third full", "sizes 1 to 50", "clusters", "lattice"],
)
def test_spheres_start_apart_and_inside(group, boundary):
    made = built(group, world={"boundary": boundary}, seed=3)
    period = [4.0] * 3 if boundary == "periodic" else None
    position, size = made.particles["position"], made.particles["scale"]
    assert deepest_overlap_of_spheres(position, size, period) < 1e-12
    reach = 0.5 * size[:, None] if boundary == "wall" else 0.0
    assert (np.abs(position) + reach <= 2.0 + 1e-12).all()


def test_hulls_start_apart_and_inside():
    kinds = ["cube", "tetrahedron", "pyramid", {"kind": "box", "edges": [1, 2, 0.5]}, "sphere"]
    made = built(*({"shape": kind, "count": 40, "size": 0.3} for kind in kinds))
    position, radius = made.particles["position"], made.particles["radius"]
    poses = list(zip(position, made.particles["orientation"], made.particles["scale"], strict=True))
    shapes = [made.shapes[k] for k in made.particles["shape_row"]]
    near = [
        (i, j) for i, j in cKDTree(position).query_pairs(2.0 * radius.max()) if _within_reach(position, radius, i, j)
    ]
    assert len(near) > 30
    for i, j in near:
        assert ps.separation(shapes[i], poses[i], shapes[j], poses[j]).distance >= 0.0
    for k, shape in enumerate(made.particles["shape_row"]):
        corners = turns(made.particles["orientation"][[k]]).apply(
            made.shapes[shape].vertices * made.particles["scale"][k]
        )
        assert (np.abs(corners + made.particles["position"][k]) <= 2.0 + 1e-12).all()


def _within_reach(position, radius, i, j):
    return np.linalg.norm(position[i] - position[j]) < radius[i] + radius[j]


def test_random_particles_stay_in_their_region():
    region = {"lower": [-1.0, 0.0, 0.5], "upper": [0.0, 1.5, 1.0]}
    position = built(spheres(50, 0.1, placement={"kind": "random", "region": region})).particles["position"]
    assert (position - 0.05 >= region["lower"]).all()
    assert (position + 0.05 <= region["upper"]).all()


LOWER, UPPER = np.array([-1.8, -0.5, -1.0]), np.array([0.2, 1.5, 0.0])
ROUND = {"lower": LOWER.tolist(), "upper": UPPER.tolist(), "form": "ellipsoid"}


@pytest.mark.parametrize("shape", ["sphere", "cube"])
@pytest.mark.parametrize(
    "placement",
    [
        {"kind": "random"},
        {"kind": "lattice"},
        {"kind": "lattice", "jitter": 1.0},
        {"kind": "lattice", "spacing": 0.19, "jitter": 1.0},
        {"kind": "cluster", "spread": 0.3, "clusters": 20},
        {"kind": "cluster", "spread": 0.05, "centres": [[-0.8, 0.5, -0.5], [-0.8, 0.5, -0.005]]},
    ],
)
def test_particles_keep_to_an_ellipsoid(shape, placement):
    count, size = (150, 0.1) if placement["kind"] != "cluster" else (60, 0.02)
    group = {"shape": shape, "count": count, "size": size, "placement": {**placement, "region": ROUND}}
    made, again = built(group, seed=4), built(group, seed=4)
    assert made.particles["position"].tobytes() == again.particles["position"].tobytes()
    # Their middles keep to one that is smaller by what is the least from a middle to a face.
    smaller = 0.5 * (UPPER - LOWER - size)
    assert made.particles["position"].shape == (count, 3)
    distance = np.linalg.norm((made.particles["position"] - 0.5 * (LOWER + UPPER)) / smaller, axis=1)
    assert distance.max() <= 1.0 + 1e-12
    # They fill it, and not the middle of it alone.
    assert placement["kind"] == "cluster" or distance.max() > 0.85
    assert shape == "cube" or deepest_overlap_of_spheres(made.particles["position"], made.particles["scale"]) < 1e-12


def test_few_particles_are_spread_evenly_in_an_ellipsoid():
    group = spheres(3000, 1e-4, placement={"kind": "random", "region": ROUND})
    inside = (built(group).particles["position"] - 0.5 * (LOWER + UPPER)) / (0.5 * (UPPER - LOWER))
    assert kstest(np.linalg.norm(inside, axis=1) ** 3, "uniform").pvalue > 0.01
    assert np.abs(inside.mean(axis=0)).max() < 5.0 * math.sqrt(0.2 / 3000.0)


def test_few_random_particles_are_spread_evenly():
    position = built(spheres(4000, 1e-4)).particles["position"]
    for axis in range(3):
        assert kstest(position[:, axis], "uniform", args=(-2.0, 4.0)).pvalue > 0.01


WIDE_SIZES = {
    "two sizes": [spheres(20, 0.3), spheres(5, 0.001)],
    "log-uniform": [spheres(1000, {"kind": "log-uniform", "low": 1e-4, "high": 0.4})],
    "twelve digits": [spheres(1000, {"kind": "log-uniform", "low": 1e-12, "high": 0.4})],
    "between fine ones": [spheres(4000, 0.002, placement="lattice"), spheres(50, 0.1), spheres(50, 0.01)],
}


@pytest.mark.parametrize("boundary", ["wall", "periodic"])
@pytest.mark.parametrize("groups", WIDE_SIZES.values(), ids=WIDE_SIZES)
def test_sizes_may_differ_as_widely_as_they_like(groups, boundary):
    """What is looked into follows the particles: cells of the finest size would be 10^11 to 10^38."""
    made = built(*groups, world={"boundary": boundary}, seed=8)
    position, size = made.particles["position"], made.particles["scale"]
    apart = position[:, None] - position[None]
    if boundary == "periodic":
        apart -= 4.0 * np.round(apart / 4.0)
    gap = np.linalg.norm(apart, axis=2) - 0.5 * (size[:, None] + size[None])
    assert gap[np.triu_indices(len(size), 1)].min() > 0.0


def test_clusters_are_as_many_as_they_say_whatever_the_sizes():
    """Particles of every size are about the same centres; of more clusters than particles the rest is not made."""
    placement = {"kind": "cluster", "clusters": 3, "spread": 1e-3}
    sizes = {"kind": "log-uniform", "low": 1e-6, "high": 1e-4}
    position = built(spheres(300, sizes, placement=placement), world={"size": [20] * 3}, seed=2).particles["position"]
    centres = np.array([position[k::3].mean(axis=0) for k in range(3)])
    for k in range(3):
        assert np.linalg.norm(position[k::3] - centres[k], axis=1).max() < 6e-3
    alone = {"kind": "cluster", "clusters": 10**8, "spread": 1e-3}
    assert len(np.unique(np.round(built(spheres(20, 1e-3, placement=alone)).particles["position"], 1), axis=0)) == 20


def test_a_lattice_is_simple_cubic_and_centred():
    position = built(spheres(27, 0.2, placement={"kind": "lattice", "spacing": 0.5})).particles["position"]
    steps = np.unique(np.round(position / 0.5, 9), axis=0)
    # Eight points to an edge of 4 m; 27 of them fill the bottom layer from its corner.
    assert steps.min(axis=0).tolist() == [-3.5, -3.5, -3.5]
    assert np.allclose(steps % 1.0, 0.5)
    assert position[:, 2].max() == pytest.approx(-1.75)


@pytest.mark.parametrize("edges", [(4.0, 4.0, 4.0), (1.0, 2.0, 7.3), (0.01, 5.0, 300.0)])
@pytest.mark.parametrize("count", [1, 2, 7, 8, 1000])
def test_a_lattice_without_a_spacing_takes_the_widest(edges, count):
    upper = 0.5 * np.array(edges)
    points, spacing = lattice_points(-upper, upper, count, None)
    assert len(points) == count == len(np.unique(points, axis=0))
    assert (np.abs(points) <= upper).all()
    # Anything wider that divides an edge holds fewer.
    fewer = np.floor(2.0 * upper / (spacing * (1.0 + 1e-6)) + 1e-9).prod()
    assert fewer < count


def test_a_row_is_as_far_apart_all_along_and_turns_with_its_curve():
    """Points of a circle: so many of them that the curve through them is the circle to a part in a thousand."""
    angles = np.linspace(0.0, 1.5 * np.pi, 25)
    circle = np.column_stack([1.5 * np.cos(angles), 1.5 * np.sin(angles), np.full(25, -0.3)])
    row = {"kind": "row", "through": circle.tolist()}
    dominoes = {**spheres(61, 1.0), "shape": {"kind": "box", "edges": [0.01, 0.03, 0.05]}, "orientation": "aligned"}
    particles = built({**dominoes, "placement": row}).particles
    expected = np.linspace(0.0, 1.5 * np.pi, 61)
    position = 1.5 * np.column_stack([np.cos(expected), np.sin(expected)])
    assert np.abs(particles["position"][:, :2] - position).max() < 1e-3
    assert np.allclose(particles["position"][:, 2], -0.3)
    apart = np.linalg.norm(np.diff(particles["position"], axis=0), axis=1)
    assert apart == pytest.approx(apart.mean(), rel=1e-4)
    # One of the body axes, that of the thin edge, has the direction of the circle.
    along = np.column_stack([-np.sin(expected), np.cos(expected), np.zeros(61)])
    in_body = np.abs(turns(particles["orientation"]).inv().apply(along))
    assert in_body.max(axis=1) == pytest.approx(1.0, abs=1e-5)
    assert (in_body.argmax(axis=1) == particles["principal_inertia"].argmax(axis=1)).all()


def test_a_row_between_two_points_is_straight_and_may_stand_upright():
    upright = {"kind": "row", "through": [[0.5, 0.2, -1.0], [0.5, 0.2, 1.0]]}
    particles = built({**spheres(5, 0.1), "placement": upright, "orientation": "aligned"}).particles
    expected = np.column_stack([np.full(5, 0.5), np.full(5, 0.2), np.linspace(-1.0, 1.0, 5)])
    assert np.allclose(particles["position"], expected, atol=1e-12)
    assert np.allclose(particles["orientation"], (1.0, 0.0, 0.0, 0.0))


def test_clusters_have_their_spread_and_centres():
    centres = [[-2.0, 0.0, 0.0], [3.0, 1.0, 0.0]]
    placement = {"kind": "cluster", "spread": 0.5, "centres": centres}
    position = built(spheres(4000, 1e-3, placement=placement), world={"size": [20] * 3}).particles["position"]
    near = np.linalg.norm(position - centres[0], axis=1) < np.linalg.norm(position - centres[1], axis=1)
    for members, centre in ((position[near], centres[0]), (position[~near], centres[1])):
        assert len(members) == 2000
        assert np.abs(members.mean(axis=0) - centre).max() < 5.0 * 0.5 / math.sqrt(2000.0)
        assert members.std() == pytest.approx(0.5 * math.hypot(1.0, members.mean(axis=0).std() / 0.5), rel=0.05)


def test_a_list_puts_particles_where_it_says():
    half = math.sqrt(0.5)
    poses = [
        {"position": [1, 0, 0], "orientation": [2, 0, 0, 2]},
        {"position": [-1, 0, 0], "orientation": {"axis": [0, 0, 3], "angle": 90}, "velocity": [0, 1, 0]},
        {"position": [0, 1, 0], "spin": [0, 0, 2]},
    ]
    group = {"shape": "cube", "size": 0.5, "placement": {"kind": "list", "poses": poses}, "velocity": [5, 0, 0]}
    made = built(group)
    assert made.particles["position"].tolist() == [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    assert made.particles["orientation"][0] == pytest.approx([half, 0.0, 0.0, half])
    assert made.particles["orientation"][1] == pytest.approx([half, 0.0, 0.0, half])
    assert made.particles["velocity"].tolist() == [[5.0, 0.0, 0.0], [0.0, 1.0, 0.0], [5.0, 0.0, 0.0]]
    momenta = made.particles["angular_momentum"]
    assert momenta[2] == pytest.approx(made.particles["principal_inertia"][2] * [0.0, 0.0, 2.0])
    assert not momenta[:2].any()


def test_particles_of_a_list_may_touch_each_other_and_walls():
    poses = [{"position": [x, 0, -1.75]} for x in (-1.75, -1.25, -0.75)]
    built({"shape": "cube", "size": 0.5, "placement": {"kind": "list", "poses": poses}})


def test_random_particles_go_between_those_of_a_list():
    listed = {"shape": "sphere", "size": 2.0, "placement": {"kind": "list", "poses": [{"position": [0, 0, 0]}]}}
    made = built(spheres(300, 0.2), listed)
    assert deepest_overlap_of_spheres(made.particles["position"], made.particles["scale"]) < 1e-12


def test_a_list_may_lie_across_a_periodic_boundary():
    poses = [{"position": [1.99, 0, 0]}, {"position": [-1.99, 0.3, 0]}]
    group = {"shape": "sphere", "size": 0.2, "placement": {"kind": "list", "poses": poses}}
    built(group, world={"boundary": "periodic"})
    poses[1]["position"] = [-1.99, 0.1, 0]
    with pytest.raises(ps.SceneError, match="inside particle 1"):
        built(group, world={"boundary": "periodic"})


def test_an_empty_scene_is_a_scene():
    made = built(
        spheres(0), spheres(0, placement="lattice"), {**spheres(0), "placement": {"kind": "cluster", "spread": 1}}
    )
    assert made.particles["position"].shape == (0, 3)


# ---- seeds --------------------------------------------------------------------------------------------------------


def test_a_seed_settles_everything():
    groups = (
        {"shape": "cube", "count": 50, "size": 0.2, "velocity": {"kind": "maxwell", "temperature": 1.0}},
        spheres(50, {"kind": "uniform", "low": 0.1, "high": 0.2}, placement={"kind": "cluster", "spread": 1.0}),
    )
    one, again, other = (built(*groups, seed=seed) for seed in (1, 1, 2))
    for name in ("position", "orientation", "velocity", "angular_momentum", "image"):
        a, b, c = (made.particles[name] for made in (one, again, other))
        assert a.tobytes() == b.tobytes()
        assert not a.any() or a.tobytes() != c.tobytes()


def test_groups_draw_from_randoms_of_their_own():
    first = spheres(5, {"kind": "uniform", "low": 0.1, "high": 0.2})
    few, many = (built(spheres(count, 0.01), first).particles for count in (3, 30))
    assert few["scale"][-5:].tolist() == many["scale"][-5:].tolist()
