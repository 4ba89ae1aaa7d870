"""Curves that grow with a movie: true to their values, on a panel that holds still, the same however it is drawn."""

import json

import numpy as np
import pytest

import particlesim as ps
from particlesim.jobs import partial_run
from particlesim.rendering.hud.curve import curve_panel
from particlesim.rendering.hud.history import History
from particlesim.rendering.hud.panel import Style
from particlesim.rendering.shading.colour_maps import encoded
from tests.worlds import gas, ledger

STYLE = Style((1280, 720), dark=False)
BLUE = 255.0 * encoded("#0072B2")


def of_impacts(*moments, duration=10.0):
    """The panel of impacts at some times, as it lies on black, (h, w, 3)."""
    passed = [ledger(time=float(t), impacts=impacts) for t, impacts in moments]
    panel = curve_panel(gas(1, duration=duration, show={"plot": "impacts"}), passed, STYLE)
    image = np.zeros((*panel.size, 3), dtype=np.uint8)
    panel.lay(image, 0, 0)
    return image


def drawn(image):
    """Columns and mean rows of what is blue."""
    blue = np.abs(image - BLUE).max(axis=2) < 60.0
    columns = np.flatnonzero(blue.any(axis=0))
    return columns, np.array([np.flatnonzero(blue[:, column]).mean() for column in columns])


def test_a_curve_is_where_its_values_are():
    whole = [(t, 100 * t) for t in range(11)]  # up to the end of the axis, 1,000
    columns, rows = drawn(of_impacts(*whole))
    slope, start = np.polyfit(columns, rows, 1)
    assert (
        slope < 0.0 and np.abs(rows - (slope * columns + start)).max() < 1.5
    )  # pixels: ends are drawn within the panel
    width, height = np.ptp(columns), np.ptp(rows)
    half_columns, half_rows = drawn(of_impacts(*whole[:6]))  # with the axis up to 500
    assert np.ptp(half_columns) == pytest.approx(0.5 * width, abs=2)
    assert np.ptp(half_rows) == pytest.approx(height, abs=2)
    _, low = drawn(of_impacts(*whole[:6], (5.0, 1000)))
    assert low[5] == pytest.approx(rows.max(), abs=3)  # it has begun where it did
    bent_columns, bent = drawn(of_impacts((0, 0), (5, 200), (10, 800)))
    middle = bent[np.argmin(np.abs(bent_columns - bent_columns.min() - 0.5 * width))]
    assert middle == pytest.approx(rows.max() - 0.25 * height, abs=2)


@pytest.mark.parametrize("what", ["energy", "momentum", "impacts"])
@pytest.mark.parametrize("gravity", [(0.0, 0.0, 0.0), (0.0, 0.0, -9.81)])
def test_a_panel_holds_still(what, gravity):
    some = gas(1, gravity=gravity, show={"plot": what})
    large = {"kinetic_translational": 1e12, "potential": -3e-9, "momentum": np.full(3, -7e8), "impacts": 10**9}
    nothing, first, later = (ledger(time=t, **known) for t, known in ((0.0, {}), (0.0, large), (5.0, large)))
    sizes = {curve_panel(some, passed, STYLE).size for passed in ([nothing], [first], [nothing, later])}
    assert len(sizes) == 1


def test_a_history_keeps_points_of_the_whole_run_few_enough_to_draw():
    history = History.of_movie(range(1000), ledger(time=0.0), True)
    for k in range(1000):
        history = history.then(ledger(time=float(k)))
    assert [point.time for point in history.curve] == [4.0 * k for k in range(250)]
    assert [point.time for point in history.curve_to(ledger(time=9.5))] == [0.0, 4.0, 8.0, 9.5]
    assert History.of_movie(range(1000), ledger(), False).then(ledger(time=1.0)).curve == ()
    # Before frame 10 nothing is known.
    begun = History.of_movie(range(10, 20), ledger(time=0.0), True)
    assert [point.time for point in begun.then(ledger(time=1.0)).curve] == [1.0]


def test_a_history_that_was_kept_goes_on():
    history = History.of_movie(range(600), ledger(time=0.0), True)
    for k in range(100):
        history = history.then(ledger(time=float(k)))
    again = History.of_table(json.loads(json.dumps(history.table())))
    assert [point.time for point in again.then(ledger(time=100.0)).curve] == [3.0 * k for k in range(34)]
    assert (again.passed, again.every, len(again.ledgers)) == (100, 3, len(history.ledgers))


def test_it_is_the_same_at_once_in_parts_and_after_it_was_left(tmp_path, monkeypatch):
    shown = {"readout": ["pressure"], "plot": "energy"}
    some = gas(1, duration=5.0, movie={"resolution": [400, 300], "fps": 25, "quality": "draft"}, show=shown)
    ps.simulate(some, tmp_path / "run.gsd")
    ps.render(tmp_path / "run.gsd", tmp_path / "once.mp4")
    for k in (1, 2):
        ps.render(tmp_path / "run.gsd", tmp_path / f"{k}.mp4", shard=(k, 2))
    ps.join([tmp_path / "1.mp4", tmp_path / "2.mp4"], tmp_path / "joined.mp4")
    for name, value in (("INTERVAL", 0.0), ("_SPARE", 0.0), ("_sync", lambda path: None)):
        monkeypatch.setattr(partial_run, name, value)

    def stop(phase, done, total):
        if done == 80:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        ps.render(tmp_path / "run.gsd", tmp_path / "left.mp4", progress=stop)
    ps.render(tmp_path / "run.gsd", tmp_path / "left.mp4", resume=True)
    once = (tmp_path / "once.mp4").read_bytes()
    assert (tmp_path / "joined.mp4").read_bytes() == once and (tmp_path / "left.mp4").read_bytes() == once


def test_a_still_has_no_curve(tmp_path):
    settings = {"duration": 0.2, "movie": {"resolution": [400, 300], "quality": "draft"}}
    ps.still(gas(1, **settings, show={"plot": "energy"}), tmp_path / "a.png", 0.1)
    ps.still(gas(1, **settings), tmp_path / "b.png", 0.1)
    ps.render(gas(1, **settings, show={"plot": "energy"}), tmp_path / "c.mp4")
    a, b, c = ((tmp_path / f"{name}.png").stat().st_size for name in "abc")
    assert abs(a - b) < 0.02 * b < abs(c - b)
