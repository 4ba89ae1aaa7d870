"""A run that goes wrong stops at the first frame that cannot be, says where, and keeps the frames before it."""

import numpy as np
import pytest

import particlesim as ps
from particlesim.simulation.simulation import Simulation
from particlesim.simulation.soundness import check_energy
from particlesim.trajectory.gsd_file import Trajectory
from tests import killed
from tests.worlds import gas, listed, scene

AT = 0.35  # when what is not wrong by itself is made wrong [s]


@pytest.fixture
def spoilt(monkeypatch):
    """Lets particles be changed by a function at the time AT."""

    def spoil(change):
        step = Simulation._step

        def spoiling(simulation, *arguments):
            step(simulation, *arguments)
            if simulation.time >= AT and len(simulation.particles.mass) > 3:  # not what is simulated to compile kernels
                change(simulation.particles)

        monkeypatch.setattr(Simulation, "_step", spoiling)

    return spoil


def not_finite(particles):
    particles.velocity[4, 1] = np.nan


def behind_a_wall(particles):
    particles.position[5, 2] = -1.75


def ever_faster(particles):
    particles.velocity[:] *= 1.5


BROKEN = [
    (not_finite, r"velocity of particle 4 \(particles\[1\] of the scene\) is not finite at 0.\d+ s; most likely for "),
    (behind_a_wall, r"particle 5 \(particles\[1\] of the scene\) is 0.5 m behind the -z wall at 0.\d+ s; most likely "),
    (ever_faster, r"the energy has grown by \S+ J, where there were \S+ J, most of it in particle \d+ \(particles\["),
]


@pytest.mark.parametrize(("change", "line"), BROKEN, ids=[change.__name__ for change, _ in BROKEN])
@pytest.mark.parametrize(("name", "colour"), [("run.gsd", "red"), ("movie.mp4", "red"), ("movie.mp4", "by_speed")])
def test_it_stops_and_keeps_what_was_before(tmp_path, spoilt, change, line, name, colour):
    spoilt(change)
    world = gas(3, duration=1.0, movie={"resolution": [64, 64], "fps": 20})
    world.particles[0].colour = colour
    make = ps.simulate if name == "run.gsd" else ps.render
    with pytest.raises(ps.SimulationError, match=line) as error:
        make(world, tmp_path / name)
    frames = int(error.value.__notes__[0].split()[0])
    assert 7 <= frames <= 9 and f"those before that, are kept in {tmp_path}" in error.value.__notes__[0]
    assert [path.name for path in tmp_path.iterdir()] == [f".{name}.partial"]
    if name == "run.gsd":
        with Trajectory(tmp_path / ".run.gsd.partial/trajectory.gsd") as trajectory:
            assert len(trajectory) == frames
            assert all(np.isfinite(frame.velocity).all() for frame in trajectory)


def test_once_the_cause_is_gone_it_goes_on_to_the_same_frames(tmp_path, spoilt, monkeypatch):
    world = gas(3, duration=1.0, movie={"resolution": [64, 64], "fps": 20})
    for name, make in (("run.gsd", ps.simulate), ("movie.mp4", ps.render)):
        with monkeypatch.context():
            spoilt(not_finite)
            with pytest.raises(ps.SimulationError):
                make(world, tmp_path / name)
        monkeypatch.undo()
        make(world, tmp_path / name, resume=True)
        make(world, tmp_path / f"straight_{name}")
        assert killed.content(tmp_path / name) == killed.content(tmp_path / f"straight_{name}")


@pytest.mark.parametrize("end", [0.5, 1.0])
@pytest.mark.parametrize(
    ("factor", "line"),
    [
        (1e15, r"particle 5 \(particles\[1\] .*\) goes at \S+e\+1\d m/s, and time steps come to no end, at 0.35 s"),
        (np.inf, r"velocity of particle 5 \(particles\[1\] of the scene\) is not finite at 0.35 s"),
    ],
)
def test_a_frame_that_would_never_come_is_not_waited_for(factor, line, end):
    simulation = ps.Simulation(gas(3))
    simulation.run(duration=AT)
    simulation.particles.velocity[5] *= factor
    with pytest.raises(ps.SimulationError, match=line):
        simulation.step_towards(end)


@pytest.mark.parametrize(
    ("settings", "key"),
    [
        ({"step": 0.01}, "solver.time_step"),
        ({"fields": [{"kind": "drag", "coefficient": 0.1}]}, r"fields\[0\]"),
        (
            {"obstacles": [{"shape": "cube", "motion": {"kind": "translate", "velocity": [0, 0, 1]}}]},
            r"obstacles\[0\].motion",
        ),
        ({}, r"particles\[0\]"),
    ],
)
def test_the_key_that_most_likely_leads_there_is_named(settings, key):
    simulation = ps.Simulation(scene(listed("sphere", {"position": (3, 0, 0)}), **settings))
    simulation.particles.position[0, 0] = np.inf
    with pytest.raises(ps.SimulationError, match=f"most likely for {key}$"):
        simulation.frame()


@pytest.mark.parametrize("boundary", ["open", "periodic"])
def test_without_walls_particles_go_where_they_go(boundary):
    simulation = ps.Simulation(
        scene(listed("sphere", {"position": (0, 0, 0), "velocity": (1e3, 0, 0)}), boundary=boundary)
    )
    simulation.run(duration=1.0)
    simulation.frame()


def test_what_falls_without_end_or_is_worked_on_is_no_runaway():
    pulled = {"fields": [{"kind": "central", "centre": [0, 0, 0], "strength": 40.0}]}
    for world in (
        scene(listed("sphere", {"position": (0, 0, -9)}), boundary="open", gravity=(0, 0, -9.81)),
        scene(listed("sphere", {"position": (5, 0, 0), "velocity": (0, 1, 0)}), boundary="open", **pulled),
    ):
        simulation = ps.Simulation(world)
        first = simulation.frame().ledger
        for _ in range(30):
            simulation.run(duration=0.1)
            check_energy(world, simulation.model, first, simulation.ledger)
        assert simulation.ledger.kinetic > 3.0 * first.kinetic
