"""The benchmark's shape: what it runs, prints and writes. How fast it is, no test can say."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from particlesim.benchmarks import steps as bench
from particlesim.cli import main as cli
from particlesim.simulation.simulation import Simulation


def run(*arguments):
    return CliRunner().invoke(cli.app, ["bench", *arguments])


@pytest.mark.parametrize(("gas", "fill"), [(bench.GASES[0], 0.2), (bench.GASES[1], 0.1)], ids=["spheres", "mixed"])
def test_a_gas_is_what_it_says(gas, fill):
    sim = Simulation(gas.scene(400))
    particles = sim.particles
    volumes = np.array([shape.volume for shape in sim.model.shapes])[particles.shape] * particles.size**3
    assert volumes.sum() / np.prod(sim.scene.world.size) == pytest.approx(fill, rel=1e-12)
    assert sorted(np.bincount(particles.shape)) == sorted([400] if len(gas.volumes) == 1 else [133, 133, 134])
    # Means of some hundreds: a few standard errors, of 42 and 82 % of one speed and energy.
    way = np.linalg.norm(particles.velocity, axis=1).mean() * sim.time_step
    assert way == pytest.approx(0.05 * 0.5, rel=4 * 0.42 / 20)
    assert sim.ledger.kinetic_translational == pytest.approx(1.5 * 400, rel=4 * 0.82 / 20)
    assert sim.ledger.kinetic_rotational == pytest.approx(1.5 * 400, rel=4 * 0.82 / 20)


def test_a_measurement_has_its_figures(monkeypatch):
    monkeypatch.setattr(bench, "_FEWEST_WEIGHED", 1)
    told = []
    speed = bench.measured((bench.GASES[1], 60, 1, 0.0), told.append)
    assert told == [1, 2, 3, 4, 5]
    assert (speed.gas, speed.particles, len(speed.rates)) == ("mixed", 60, 5)
    assert min(speed.rates) <= speed.rate <= max(speed.rates)
    assert list(speed.milliseconds) == ["pairs", "contacts", "respond", "advance"]
    assert speed.impacts >= 0.0
    assert speed.bytes >= 0.0
    # All phases are part of the step.
    whole = [1e3 * 1e-6 * 60 / rate for rate in speed.rates]
    assert sum(speed.milliseconds.values()) < sum(whole) / len(whole)


def test_the_command_prints_a_table_and_writes_the_figures(tmp_path, monkeypatch):
    speed = bench.Speed("spheres", 1000, 20, [1.0, 2.0, 1.5], dict.fromkeys(("pairs", "respond"), 0.5), 0.04, 812.3)
    few = bench.Speed("spheres", 10, 20, [0.5], dict.fromkeys(("pairs", "respond"), 0.5), 0.04, None)
    asked = []

    def measure(counts, threads, progress):
        asked.append((counts, threads))
        if progress is not None:
            progress("spheres, 1,000 particles", 0, 3)
        return iter([few, speed])

    monkeypatch.setattr("particlesim.benchmarks.steps.run", measure)
    result = run("--threads", "2", "--json", str(tmp_path / "speed.json"))
    assert result.exit_code == 0
    assert result.stderr == "spheres, 1,000 particles 3 measurements\n"
    assert [line.split() for line in result.stdout.splitlines()[1:4]] == [
        ["gas", "particles", "M/s", "spread", "pairs", "respond", "impacts", "bytes"],
        ["spheres", "10", "0.50", "0%", "0.5", "0.5", "0.040"],
        ["spheres", "1,000", "1.50", "67%", "0.5", "0.5", "0.040", "812"],
    ]
    written = json.loads((tmp_path / "speed.json").read_text())
    assert [gas["rate"] for gas in written["gases"]] == [0.5, 1.5]
    assert written["gases"][1]["rates"] == [1.0, 2.0, 1.5]
    assert [path.name for path in tmp_path.iterdir()] == ["speed.json"]
    assert run("--large", "--quiet").output == ""
    assert asked == [((1_000, 10_000, 100_000), 2), ((1_000, 10_000, 100_000, 1_000_000), None)]


def test_every_gas_is_measured_in_a_process_of_its_own(monkeypatch):
    monkeypatch.setattr(bench, "GASES", bench.GASES[:1])
    calls = []
    (speed,) = bench.run((20,), 1, lambda *call: calls.append(call), 0.0)
    assert (speed.gas, speed.particles) == ("spheres", 20)
    assert calls == [("spheres, 20 particles", k, 5) for k in range(6)]
    assert speed.bytes is None


def test_a_process_that_dies_is_one_line(monkeypatch):
    monkeypatch.setattr(bench, "_work", len)  # wants one argument and gets two
    monkeypatch.setattr(bench, "COUNTS", (20,))
    result = run("--quiet")
    assert (result.exit_code, result.output) == (1, "the measurement of spheres, 20 particles, has failed\n")


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["--json", "none/speed.json"], "none/speed.json: there is no folder none"),
        (["--json", "speed.txt"], "speed.txt: the output must end in .json"),
    ],
)
def test_wrong_input_is_one_line(arguments, line, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = run(*arguments)
    assert (result.exit_code, result.output) == (2, f"{line}\n")


def test_too_many_particles_are_refused_at_once(monkeypatch):
    monkeypatch.setattr("particlesim.setup.memory._memory", lambda: 1e6)
    result = run("--quiet")
    assert result.exit_code == 2
    assert "100,000 particles need about" in result.output
    assert "Traceback" not in result.output


def test_the_number_of_threads_must_be_one_or_more():
    assert run("--threads", "0").exit_code == 2
