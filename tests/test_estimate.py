"""What ``check`` says of the time that a simulation will take."""

from types import SimpleNamespace

import pytest

from particlesim.simulation import estimate


class Stepped:
    """A simulation of 100 s in steps of 0.1 s, each of which takes some seconds of a clock of its own."""

    def __init__(self, monkeypatch, walls):
        self.scene, self.time, self.clock = SimpleNamespace(duration=100.0), 0.0, 0.0
        self._walls = iter(walls)
        monkeypatch.setattr(estimate, "is_compiled", lambda _: True)
        monkeypatch.setattr(estimate.time, "perf_counter", lambda: self.clock)

    def next_time_step(self):
        return 0.1

    def step(self, _=None):
        self.clock += next(self._walls)
        self.time += 0.1


@pytest.mark.parametrize("slow", [2, 5])
def test_a_step_in_which_kernels_are_compiled_does_not_count(monkeypatch, slow):
    walls = [7.0] + [0.02] * 200  # the first loads kernels, whatever the scene
    walls[slow] = 40.0
    assert "about 20 s to simulate" in estimate._computing(Stepped(monkeypatch, walls))


def test_two_steps_that_take_long_are_enough(monkeypatch):
    said = estimate._computing(Stepped(monkeypatch, [60.0, 60.0, 60.0]))
    assert said.startswith("about 16 h 40 min to simulate")


def test_what_takes_next_to_no_time_says_so(monkeypatch):
    said = estimate._computing(Stepped(monkeypatch, [1e-4] * 1100))
    assert said.startswith("less than a second to simulate, as the first ")
