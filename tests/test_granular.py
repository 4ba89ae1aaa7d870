"""What many spheres do together: what a silo bears and lets through, how steep a heap is, what shaking sorts."""

import numpy as np
import pytest
from scipy.optimize import brentq

from particlesim.simulation.simulation import Simulation
from tests.worlds import listed, scene

pytestmark = pytest.mark.slow

GRAVITY = (0.0, 0.0, -9.81)

# ---- silos ---------------------------------------------------------------------------------------------------------

# A silo [m]: the mean diameter of its spheres, and how wide it is.
GRAIN, WIDTH = 0.1, 0.4

# When its floor begins to go down [s], and how fast [m/s]: the walls then hold what they can, as Janssen assumed.
SETTLED, SINKING = 1.0, 0.05


def silo(count):
    """Spheres in a square silo with rough walls, on a floor that sinks slowly from ``SETTLED`` on."""
    half, height = 0.5 * WIDTH, GRAIN * (4.0 + 0.0935 * count)
    floor = -0.5 * height + GRAIN
    region = {"lower": [-half, -half, floor], "upper": [half, half, 0.5 * height]}
    grains = {
        "shape": "sphere",
        "count": count,
        "size": {"kind": "uniform", "low": 0.9 * GRAIN, "high": 1.1 * GRAIN},
        "placement": {"kind": "random", "region": region},
    }
    slab = {
        "shape": {"kind": "box", "edges": [WIDTH, WIDTH, GRAIN]},
        "position": [0.0, 0.0, floor - 0.5 * GRAIN],
        "motion": {"kind": "translate", "velocity": [0.0, 0.0, -SINKING], "from": SETTLED},
    }
    return scene(grains, size=(WIDTH, WIDTH, height), gravity=GRAVITY, restitution=0.0, friction=0.5, obstacles=[slab])


def borne(count, duration=0.75):
    """What floor and walls bear, as parts of the weight, the weight [N], and how high the spheres stand [m]."""
    sim = Simulation(silo(count))
    sim.run(duration=SETTLED + 0.25)
    before = sim.ledger
    sim.run(duration=duration)
    after = sim.ledger
    weight = -GRAVITY[2] * sim.particles.mass.sum()
    floor = -(after.work - before.work) / (SINKING * duration * weight)  # its work is the force times the way
    walls = -(after.wall_shear - before.wall_shear)[:4, 2].sum() / (duration * weight)
    return floor, walls, weight, np.ptp(sim.particles.position[:, 2]) + GRAIN


def of_the_weight(depth):
    """The part of its weight that the floor of a silo bears; ``depth`` in lengths width / (4 K mu).

    H. A. Janssen, Z. Ver. Dtsch. Ing. 39 (1895) 1045; M. Sperl, Granular Matter 8 (2006) 59 has it in English.
    """
    return (1.0 - np.exp(-depth)) / depth


def test_the_load_on_the_floor_of_a_silo_follows_janssens_law():
    """One length is fitted, to the highest filling; half and a quarter of it then bear what the law says."""
    found = [borne(count) for count in (75, 150, 300)]
    for floor, walls, _, _ in found:
        assert floor + walls == pytest.approx(1.0, abs=0.03)
    part, _, weight, height = found[-1]
    depth = brentq(lambda d: of_the_weight(d) - part, 0.1, 50.0)
    for floor, _, _, h in found[:-1]:  # found: 9 % and 0.4 % off
        assert floor == pytest.approx(of_the_weight(depth * h / height), rel=0.15)
    # Twice as much in the silo is hardly more on its floor.
    assert part * weight < 1.35 * found[1][0] * found[1][2]


# ---- heaps ---------------------------------------------------------------------------------------------------------

# The mean diameter [m] of the spheres of a heap.
PEBBLE = 0.02


def column(friction, rolling):
    """300 spheres in a column on a plate, which nothing holds; ``rolling`` is the rolling friction in diameters."""
    region = {"lower": [-3.0 * PEBBLE, -3.0 * PEBBLE, -0.5], "upper": [3.0 * PEBBLE, 3.0 * PEBBLE, -0.275]}
    pebbles = {
        "shape": "sphere",
        "count": 300,
        "size": {"kind": "uniform", "low": 0.9 * PEBBLE, "high": 1.1 * PEBBLE},
        "placement": {"kind": "random", "region": region},
    }
    return scene(
        pebbles,
        size=(2.0, 2.0, 1.0),
        boundary=("open", "open", "wall"),
        gravity=GRAVITY,
        restitution=0.0,
        friction=friction,
        rolling_friction=rolling * PEBBLE,
    )


def angle_of_repose(friction, rolling):
    """The angle [degrees] of the cone that a column leaves, 0 of a single layer.

    Of a cone the middle is a quarter of its height up, and half of it is within half its radius.
    """
    sim = Simulation(column(friction, rolling))
    sim.run(duration=1.0)
    position = sim.particles.position
    out = np.linalg.norm(position[:, :2] - np.median(position[:, :2], axis=0), axis=1)
    up = position[:, 2] + 0.5 - 0.5 * PEBBLE
    return np.degrees(np.arctan(4.0 * up.mean() / (2.0 * np.median(out))))


def test_heaps_are_the_steeper_the_more_friction_and_rolling_friction_there_is():
    """As Y. C. Zhou et al., Physica A 269 (1999) 536, have it of sandpiles of spheres."""
    angles = np.array([[angle_of_repose(mu, rolling) for mu in (0.15, 0.3, 0.6)] for rolling in (0.05, 0.1)])
    assert (np.diff(angles, axis=1) > 1.0).all()
    assert (np.diff(angles, axis=0)[0, 1:] > 1.0).all()  # with little friction all of them slide away


# ---- flow through a slot --------------------------------------------------------------------------------------------

# The mean diameter [m] of the spheres that flow, how many of it the silo is wide and deep, and when its gate falls [s].
BEAD, ACROSS, DEEP, OPENED = 0.01, 20, 4, 0.4


def slotted_silo(slot, count):
    """Spheres between smooth walls above a slot of so many diameters, which a gate closes at first."""
    height, thickness = 0.6, 2.0 * BEAD
    floor = -0.5 * height + 0.1
    beads = {
        "shape": "sphere",
        "count": count,
        "friction": 0.5,
        "size": {"kind": "uniform", "low": 0.9 * BEAD, "high": 1.1 * BEAD},
        "placement": {
            "kind": "random",
            "region": {
                "lower": [-0.5 * ACROSS * BEAD, -0.5 * DEEP * BEAD, floor],
                "upper": [0.5 * ACROSS * BEAD, 0.5 * DEEP * BEAD, 0.5 * height],
            },
        },
    }
    shelf = 0.5 * (ACROSS - slot) * BEAD
    falling = {"motion": {"kind": "translate", "velocity": [0.0, 0.0, -5.0], "from": OPENED}}
    slabs = [
        {
            "shape": {"kind": "box", "edges": [wide, 2.0 * DEEP * BEAD, thickness]},
            "position": [x, 0.0, floor - 0.5 * thickness],
            "friction": 0.5,
            **motion,
        }
        for wide, x, motion in (
            (shelf, -0.5 * (slot * BEAD + shelf), {}),
            (shelf, 0.5 * (slot * BEAD + shelf), {}),
            (slot * BEAD, 0.0, falling),
        )
    ]
    sink = {"region": {"lower": [-1.0, -1.0, -1.0], "upper": [1.0, 1.0, floor - 3.0 * BEAD]}}
    size = (ACROSS * BEAD, DEEP * BEAD, height)
    return scene(beads, size=size, gravity=GRAVITY, restitution=0.3, friction=0.0, obstacles=slabs, sinks=[sink])


def flow(slot, count=1500):
    """Spheres a second through the slot while the silo goes from 0.9 to 0.7, and from 0.7 to 0.5, of its filling."""
    sim = Simulation(slotted_silo(slot, count))
    sim.run(duration=OPENED)
    passed = [0]
    while passed[-1] < 0.5 * count:
        sim.run(duration=0.005)
        passed.append(int(sim.removed[0]))
    at = np.interp([0.1 * count, 0.3 * count, 0.5 * count], passed, 0.005 * np.arange(len(passed)))
    return 0.2 * count / np.diff(at)


def test_the_flow_through_a_slot_follows_beverloos_law():
    """Spheres a second: C f (6 / pi) (depth / d) sqrt(g / d) (D / d - k)^(3/2), however much is above.

    W. A. Beverloo et al., Chem. Eng. Sci. 15 (1961) 260, for round holes (power 5/2), where k is 1.4; of slots
    R. M. Nedderman et al., Chem. Eng. Sci. 37 (1982) 1597 say that C is 1.03. The fill f of what flows is about 0.58.
    """
    slots = np.array([5.0, 7.0, 9.0])
    rates = np.array([flow(slot) for slot in slots])
    assert rates[:, 1] == pytest.approx(rates[:, 0], rel=0.15)  # found: 0.5 % less to 10 % more
    mean = rates.mean(axis=1)
    slope, offset = np.polyfit(slots, mean ** (2.0 / 3.0), 1)
    assert (slope * slots + offset) ** 1.5 == pytest.approx(mean, rel=0.03)  # found: 0.3 % off
    assert 1.0 < -offset / slope < 2.5  # found: 1.8
    of_slots = 0.58 * 6.0 / np.pi * DEEP * np.sqrt(9.81 / BEAD)
    assert slope**1.5 / of_slots == pytest.approx(1.03, rel=0.25)  # found: 0.87


# ---- shaking --------------------------------------------------------------------------------------------------------


def test_a_brazil_nut_rises():
    """Shaken up and down with three times gravity at 8 Hz, a sphere of three diameters comes to the top.

    A. Rosato et al., Phys. Rev. Lett. 58 (1987) 1038.
    """
    grain, width, height, frequency = 0.01, 0.07, 0.3, 8.0
    floor = -0.5 * height + 0.03
    nut = listed("sphere", {"position": (0.0, 0.0, floor + 1.5 * grain + 1e-6)}, size=3.0 * grain)
    region = {"lower": [-0.5 * width, -0.5 * width, floor], "upper": [0.5 * width, 0.5 * width, floor + 0.13]}
    grains = {
        "shape": "sphere",
        "count": 450,
        "size": {"kind": "uniform", "low": 0.9 * grain, "high": 1.1 * grain},
        "placement": {"kind": "random", "region": region},
    }
    shaken = {
        "shape": {"kind": "box", "edges": [2.0 * width, 2.0 * width, 0.02]},
        "position": [0.0, 0.0, floor - 0.01],
        "motion": {
            "kind": "vibrate",
            "direction": [0, 0, 1],
            "amplitude": 3.0 * 9.81 / (2.0 * np.pi * frequency) ** 2,
            "frequency": frequency,
            "from": 0.3,
        },
    }
    sim = Simulation(
        scene(
            nut,
            grains,
            size=(width, width, height),
            gravity=GRAVITY,
            restitution=0.6,
            friction=0.3,
            obstacles=[shaken],
        )
    )
    sim.run(duration=0.3)
    above = [np.mean(sim.particles.position[1:, 2] > sim.particles.position[0, 2])]
    for _ in range(6):
        sim.run(duration=1.0)
        above.append(np.mean(sim.particles.position[1:, 2] > sim.particles.position[0, 2]))
    assert above[0] > 0.75
    assert np.mean(above[-2:]) < 0.15
