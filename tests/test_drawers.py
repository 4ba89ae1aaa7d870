"""Pictures drawn beside each other: the same ones, in order, few at a time, and an end that leaves nothing behind."""

import itertools
import threading

import numpy as np
import pytest

import particlesim as ps
from particlesim.core.parallel import use_threads
from particlesim.jobs import drawers
from particlesim.jobs.drawers import Drawers
from particlesim.rendering import RenderError
from tests.test_render_order import tasks
from tests.worlds import gas


@pytest.fixture
def cores():
    """Sets how many cores there seem to be."""
    yield use_threads
    use_threads(None)


def running():
    """Threads that draw."""
    return [thread for thread in threading.enumerate() if thread.name.startswith("drawer")]


@pytest.mark.parametrize("count", [1, 2, 3, 9])
def test_pictures_are_the_same_and_in_order_for_any_number_of_cores(count, cores):
    look, drawn = tasks()
    cores(1)
    with Drawers(look, len(drawn)) as alone:
        expected = list(alone.draw(drawn))
    cores(count)
    with Drawers(look, len(drawn)) as together:
        pictures = list(together.draw(drawn))
        assert len(running()) == min(count, 4)
    assert len(pictures) == len(drawn) == 10
    assert all(np.array_equal(one, other) for one, other in zip(pictures, expected, strict=True))
    assert all(not np.array_equal(one, other) for one, other in itertools.pairwise(pictures))
    assert not running()


def test_one_picture_takes_one_drawer(cores):
    look, drawn = tasks()
    cores(4)
    with Drawers(look, 1) as one:
        assert len(list(one.draw(drawn[:1]))) == 1 and len(running()) == 1


def test_no_more_frames_are_taken_than_are_soon_drawn(cores):
    look, drawn = tasks()
    cores(2)
    taken = 0

    def counted():
        nonlocal taken
        for task in drawn:
            taken += 1
            yield task

    with Drawers(look, len(drawn)) as two:
        pictures = two.draw(counted())
        for number in range(3):
            next(pictures)
            assert taken == number + 5 and len(two.waiting) == 4


class Failing:
    """A renderer that cannot, from its third picture on."""

    def __init__(self, look):
        self.count, self.closed = 0, 0
        renderers.append(self)

    def draw(self, frame, history):
        self.count += 1
        if self.count > 2:
            raise RenderError("the driver is gone")
        return np.zeros((2, 2, 3), dtype=np.uint8)

    def close(self):
        self.closed += 1


renderers: list[Failing] = []


@pytest.fixture
def failing(monkeypatch):
    """Lets drawers have renderers that fail; those that were made."""
    renderers.clear()
    monkeypatch.setattr(drawers, "Renderer", Failing)
    return renderers


def test_what_fails_in_a_drawer_is_raised_where_its_picture_is_asked_for(cores, failing):
    look, drawn = tasks()
    cores(2)
    with Drawers(look, len(drawn)) as two, pytest.raises(RenderError, match=r"^the driver is gone$"):
        for number, _ in enumerate(two.draw(drawn)):
            assert number < 4
    assert [each.closed for each in failing] == [1, 1] and not running()


def test_a_machine_that_cannot_draw_says_so(cores, monkeypatch):
    def refuse(look):
        raise RenderError("no OpenGL")

    look, drawn = tasks()
    monkeypatch.setattr(drawers, "Renderer", refuse)
    with Drawers(look, len(drawn)) as none, pytest.raises(RenderError, match=r"^no OpenGL$"):
        next(none.draw(drawn))
    assert not running()


@pytest.mark.parametrize("stop", [KeyboardInterrupt, ZeroDivisionError])
def test_whatever_stops_the_work_closes_all(stop, cores, failing):
    look, drawn = tasks()
    cores(3)

    def stopping():
        yield from drawn[:4]
        raise stop

    with pytest.raises(stop), Drawers(look, len(drawn)) as three:
        list(three.draw(stopping()))
    assert [each.closed for each in failing] == [1, 1, 1] and not running()


def test_progress_counts_the_pictures_that_are_done(cores, tmp_path):
    cores(2)
    scene = gas(4, duration=0.5, movie={"fps": 20.0, "resolution": [96, 64]})
    calls = []
    summary = ps.render(scene, tmp_path / "a.mp4", progress=lambda *call: calls.append(call))
    done = [number for phase, number, _ in calls if phase == "rendering"]
    assert done == list(range(1, 12)) and calls[-1] == ("rendering", 11, 11)
    assert summary.frames == summary.drawn == 11
    assert set(summary.seconds) == {"simulating", "drawing", "encoding"}
