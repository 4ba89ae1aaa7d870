"""A gear that coacd has split into convex parts rolls from tooth to tooth as a rimless wheel does.

The wheel turns about the tip that it stands on until the next one strikes, and then about that: T. McGeer, "Passive
Dynamic Walking", Int. J. Robotics Research 9 (1990) 62. With n tips at a distance l, half the angle between two of them
a = pi / n, a slope of s and moment of inertia I about the axle,

    in an impact      w falls to eta w,       eta = (I + m l^2 cos 2a) / (I + m l^2)
    between two       w^2 grows by            4 m g l sin a sin s / (I + m l^2)
"""

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

import particlesim as ps
from tests.worlds import listed, scene

TEETH, TIP, ROOT, THICK = 8, 0.5, 0.3, 0.3
HALF, SLOPE, GRAVITY = np.pi / TEETH, np.radians(10.0), 9.81
STEP = 1.0 / 960.0  # with four times as much, what turns about a tip loses 5 % of its energy a second


def gear():
    """A star about z, with pointed teeth."""
    number = 2 * TEETH
    angle = np.arange(number) * np.pi / TEETH
    reach = np.where(np.arange(number) % 2 == 0, TIP, ROOT)
    ring = np.column_stack([reach * np.cos(angle), reach * np.sin(angle)])
    points = [(*corner, z) for z in (-0.5 * THICK, 0.5 * THICK) for corner in (*ring, (0.0, 0.0))]
    faces, top = [], number + 1
    for k in range(number):
        after = (k + 1) % number
        faces += [(number, after, k), (top + number, top + k, top + after)]
        faces += [(k, after, top + after), (k, top + after, top + k)]
    return trimesh.Trimesh(points, faces, process=False)


def test_a_gear_rolls_as_a_rimless_wheel(tmp_path):
    solid = gear()
    assert solid.is_watertight
    solid.export(tmp_path / "gear.stl")
    # On two tips, turning about the one ahead. The axle is along y; what is down the slope is along x.
    start = 2.4
    away = TIP * np.array([np.cos(HALF), 0.0, np.sin(HALF)])
    turn = Rotation.from_rotvec([0.0, HALF, 0.0]) * Rotation.from_rotvec([-0.5 * np.pi, 0.0, 0.0])
    pose = {
        "position": (0.0, 0.0, TIP * np.cos(HALF) + 5e-4),
        "orientation": np.roll(turn.as_quat(), 1).tolist(),
        "velocity": (start * away).tolist(),
        "spin": (0.0, start, 0.0),
    }
    split = {"kind": "mesh", "file": str(tmp_path / "gear.stl"), "decompose": True}
    rolling = scene(
        listed(split, pose),
        gravity=(GRAVITY * np.sin(SLOPE), 0.0, -GRAVITY * np.cos(SLOPE)),
        obstacles=[{"shape": "plane"}],
        **{"boundary": "open", "friction": 2.0, "restitution": 0.0, "step": STEP},
    )
    sim = ps.Simulation(rolling)
    mass, inertia = sim.particles.mass[0], sim.particles.inertia[0].max()
    assert inertia / mass == pytest.approx(solid.moment_inertia[2, 2] / solid.volume, rel=0.01)
    rates, energies, lost = [], [], []
    for _ in range(round(1.8 / STEP)):
        sim.run(duration=STEP)
        rates.append(sim.particles.angular_velocity[0])
        energies.append(sim.ledger.energy)
        lost.append(sim.ledger.dissipated.sum())
    about = inertia + mass * TIP**2
    eta = (inertia + mass * TIP**2 * np.cos(2.0 * HALF)) / about
    gained = 4.0 * mass * GRAVITY * TIP * np.sin(HALF) * np.sin(SLOPE) / about
    rate = np.array(rates)[:, 1]
    strikes = [k for k in range(50, len(rate) - 50) if rate[k] == rate[k - 50 : k + 50].max()]
    before, after = rate[strikes], rate[np.add(strikes, 3)]
    assert len(strikes) == 5
    assert after / before == pytest.approx(eta, rel=0.006)
    # On the way to the next impact a hundredth of the energy is lost at most.
    assert before[1:] ** 2 == pytest.approx(eta**2 * before[:-1] ** 2 + gained, rel=0.015)
    # It goes straight, and nothing is gained.
    assert np.abs(np.array(rates)[:, [0, 2]]).max() < 0.01
    assert sim.particles.position[0, 0] == pytest.approx((2 * len(strikes) + 1) * TIP * np.sin(HALF), abs=TIP)
    assert np.diff(energies).max() <= 1e-9 * mass
    assert np.add(energies, lost) == pytest.approx(energies[0] + lost[0], rel=1e-9)
