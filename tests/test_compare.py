"""The comparison: it proves that broad phases agree, says when they do not, and writes what others can read."""

import json
import struct

import numpy as np
import pytest
from typer.testing import CliRunner

from particlesim import Simulation
from particlesim.benchmarks.broad_phase import SceneComparison, compare_frames, compare_scene, figure, sweep
from particlesim.benchmarks.broad_phase.boxes import make_boxes
from particlesim.benchmarks.broad_phase.figure import _bar_colours
from particlesim.benchmarks.broad_phase.measure import (
    Found,
    Measured,
    digest,
    duration,
    machine,
    measure_interleaved,
    peak_memory,
)
from particlesim.benchmarks.broad_phase.peers import peer_search, peers
from particlesim.benchmarks.broad_phase.runs import Result
from particlesim.benchmarks.broad_phase.stream import Stream, StreamError, read_stream, write_stream
from particlesim.benchmarks.broad_phase.sweep import Sweep, SweepError, sizes_up_to
from particlesim.broad_phase import METHODS
from particlesim.cli import main as cli
from particlesim.trajectory.frame_aabb import frame_boxes
from tests.worlds import gas, listed, scene

SCENE = """
duration = 0.1
[world]
size = [4.0, 4.0, 4.0]
boundary = ["wall", "periodic", "wall"]
[[particles]]
shape = "cube"
count = 20
size = 0.5
velocity = { kind = "maxwell", temperature = 600.0 }
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.toml").write_text(SCENE)
    return tmp_path


@pytest.fixture
def forgetful(monkeypatch):
    """A grid that loses a pair of every search."""
    whole = METHODS["grid"]

    def lose(*arguments, **parameters):
        pairs, tested = whole(*arguments, **parameters)
        return pairs[1:], tested

    monkeypatch.setitem(METHODS, "grid", lose)


def run(*arguments):
    return CliRunner().invoke(cli.app, ["compare", *arguments])


def files(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


class TestBoxes:
    def test_uniform_boxes_fill_a_fifth_of_the_cube(self):
        boxes = make_boxes("uniform", 1000)
        assert (4.0 / 3.0 * np.pi * boxes.half**3).sum() == pytest.approx(0.2)
        assert np.ptp(boxes.half) == 0.0

    def test_mixed_boxes_are_one_to_fifty(self):
        half = make_boxes("mixed", 5000).half
        assert half.max() / half.min() == pytest.approx(50.0, rel=0.02)
        assert (4.0 / 3.0 * np.pi * half**3).sum() == pytest.approx(0.2)

    def test_clustered_boxes_are_in_a_hundredth_of_the_volume(self):
        """Of a million little cells at most 1.4 % hold nine tenths of the boxes, as a cluster may lie across cells."""
        centre = make_boxes("clustered", 100_000).centre
        held = np.histogramdd(centre, bins=50, range=[(0, 1)] * 3)[0].ravel()
        crowded = np.sort(held)[::-1].cumsum()
        assert np.searchsorted(crowded, 0.88 * len(centre)) < 0.05 * held.size

    def test_the_same_seed_gives_the_same_boxes(self):
        for kind in ("uniform", "clustered", "mixed"):
            np.testing.assert_array_equal(make_boxes(kind, 100).lower, make_boxes(kind, 100).lower)

    def test_boxes_of_a_frame_by_hand(self):
        """A sphere, and a cube of edge 2 turned by 45 degrees about z, which is sqrt(2) times as wide."""
        turned = {"position": [1, 0, 0], "orientation": {"axis": [0, 0, 1], "angle": 45}}
        simulation = Simulation(
            scene(listed("sphere", {"position": [-3, 0, 1]}, size=0.5), listed("cube", turned, size=2.0))
        )
        lower, upper = frame_boxes(simulation.header, simulation.frame())
        wide = np.sqrt(2.0)
        np.testing.assert_allclose(lower, [[-3.25, -0.25, 0.75], [1 - wide, -wide, -1]], atol=1e-12)
        np.testing.assert_allclose(upper, [[-2.75, 0.25, 1.25], [1 + wide, wide, 1]], atol=1e-12)


class TestScene:
    def test_all_broad_phases_agree(self):
        seen = []
        comparison, frames = compare_scene(
            gas(10, boundary="periodic"), "gas", steps=8, limit=1e9, progress=lambda *told: seen.append(told)
        )
        assert comparison.same_pairs and comparison.same_trajectory
        assert [result.method for result in comparison.ran] == list(METHODS)
        assert len(frames) == comparison.frames == 5
        assert (comparison.boxes, comparison.steps) == (40, 8)
        assert comparison.results[0].tested == 5 * 40 * 39 // 2
        assert len({result.pairs for result in comparison.ran}) == 1
        assert all(result.memory > 0 and len(result.digests) == 5 for result in comparison.ran)
        assert {"recording", "searching", "simulating with octree"} <= {phase for phase, *_ in seen}
        json.dumps(comparison.table())

    def test_naive_is_left_out_where_it_would_take_too_long_and_says_so(self):
        comparison, _ = compare_scene(gas(5), steps=1, limit=0.0)
        assert [result.method for result in comparison.ran] == ["grid", "octree"]
        assert comparison.results[0].left_out.startswith("would take about ")
        assert comparison.same_pairs and comparison.same_trajectory

    def test_steps_are_chosen_by_the_time_they_take(self):
        comparison, _ = compare_scene(gas(2))
        assert 1 <= comparison.steps <= 200

    def test_a_lost_pair_is_noticed(self, forgetful):
        boxes = make_boxes("uniform", 200)
        comparison = compare_frames([(boxes.lower, boxes.upper)])
        assert not comparison.same_pairs

    def test_the_order_of_the_pairs_counts(self):
        pairs = np.array([[0, 1], [0, 2]])
        assert digest(Found(2, 1, pairs)) != digest(Found(2, 1, pairs[::-1]))


class TestSweep:
    def test_sizes(self):
        assert sizes_up_to(100) == [100]
        assert sizes_up_to(1000) == [100, 316, 1000]
        assert sizes_up_to(1_000_000)[-1] == 1_000_000

    @pytest.mark.parametrize("kind", ["uniform", "clustered", "mixed"])
    def test_every_method_on_every_size(self, kind):
        result = sweep(kind, largest=316)
        assert result.methods == [*METHODS, *peers(kind)]
        assert not result.disagree and not result.stopped
        tested = {row["boxes"]: row["tested"] for row in result.rows if row["method"] == "naive"}
        assert tested == {100: 4950, 316: 49770}
        assert result.exponent("naive", "seconds") is None
        json.dumps(result.table())

    def test_peers_find_as_many_pairs(self):
        boxes = make_boxes("uniform", 500)
        pairs, _ = METHODS["octree"](boxes.lower, boxes.upper, np.zeros(3))
        for name in peers("uniform"):
            assert peer_search(name, boxes)().size == len(pairs)

    def test_what_takes_too_long_stops(self):
        result = sweep("uniform", largest=1000, limit=1e-12)
        assert set(result.stopped) == set(result.methods)
        assert {row["boxes"] for row in result.rows} == {100, 316}
        assert "stops before 1,000 boxes" in result.stopped["naive"]

    def test_a_lost_pair_is_noticed(self, forgetful):
        assert sweep("mixed", largest=100).disagree == ["grid on 100 boxes"]

    def test_exponents_by_hand(self):
        result = Sweep("uniform", {}, 1.0)
        for count in (100, 10_000, 100_000, 1_000_000):
            row = {"method": "grid", "boxes": count, "seconds": 1e-9 * count**1.25, "tested": 3 * count}
            result.rows.append(row)
        assert result.exponent("grid", "seconds") == pytest.approx(1.25)
        assert result.exponent("grid", "tested") == pytest.approx(1.0)

    def test_a_kind_that_there_is_not(self):
        with pytest.raises(SweepError, match="'odd'; there are uniform, clustered, mixed"):
            sweep("odd")


class TestMeasure:
    def test_turns_are_taken(self):
        calls = []
        searches = {name: lambda name=name: calls.append(name) or Found(3, 4) for name in "ab"}
        measured = measure_interleaved(searches)
        assert calls == list("ab") * (len(calls) // 2)
        assert measured["b"].found == (3, 4, None)
        assert measured["a"].row()["repeats"] == len(calls) // 2

    def test_median_and_spread(self):
        row = Measured([3.0, 1.0, 2.0], Found(1)).row()
        assert (row["seconds"], row["fastest"], row["slowest"]) == (2.0, 1.0, 3.0)

    def test_memory_of_a_search(self):
        assert peak_memory(lambda: Found(np.ones(1_000_000).size)) == pytest.approx(8e6, rel=0.01)

    def test_durations_as_people_say_them(self):
        assert [duration(s) for s in (5.0, 90.0, 5400.0, 1e6)] == ["5 s", "1.5 min", "1.5 h", "11.6 d"]


class TestStream:
    def stream(self, frames=3, count=4):
        rng = np.random.default_rng(1)
        lower = rng.integers(0, 1000, (frames, count, 3)) / 1024.0
        return Stream("a scene", "boxes", np.array([[-1.0] * 3, [2.0] * 3]), lower, lower + 0.5)

    def test_what_is_written_is_read(self, tmp_path):
        stream = self.stream()
        write_stream(tmp_path / "a.aabb", stream)
        read = read_stream(tmp_path / "a.aabb")
        assert read[:2] == stream[:2]
        for written, found in zip(stream[2:], read[2:], strict=True):
            np.testing.assert_array_equal(written, found)
            assert found.dtype == np.float64 and found.flags.c_contiguous

    def test_layout_by_hand(self, tmp_path):
        """As a C program would read it: two strings, four integers, eight floats, and eight more for each box."""
        lower = np.array([[[1.0, 2.0, 3.0]]])
        write_stream(tmp_path / "a.aabb", Stream("s", "o", np.array([[-4.0] * 3, [5.0] * 3]), lower, lower + 1.0))
        content = (tmp_path / "a.aabb").read_bytes()
        assert len(content) == 304 + 32
        assert struct.unpack("<128s128s4i8f", content[:304]) == (
            b"s".ljust(128, b"\0"), b"o".ljust(128, b"\0"), 1, 1, 0, 0, -4, -4, -4, 0, 5, 5, 5, 0,
        )  # fmt: skip
        assert struct.unpack("<8f", content[304:]) == (1, 2, 3, 0, 2, 3, 4, 0)

    def test_boxes_that_overlap_still_do_in_float32(self, tmp_path):
        boxes = make_boxes("uniform", 2000)
        world = np.array([[0.0] * 3, [1.0] * 3])
        write_stream(tmp_path / "a.aabb", Stream("", "", world, boxes.lower[None], boxes.upper[None]))
        read = read_stream(tmp_path / "a.aabb")
        exact = {tuple(pair) for pair in METHODS["octree"](boxes.lower, boxes.upper, np.zeros(3))[0]}
        assert exact <= {tuple(pair) for pair in METHODS["octree"](read.lower[0], read.upper[0], np.zeros(3))[0]}

    @pytest.mark.parametrize(
        ("spoil", "message"),
        [
            (lambda content: content[:200], "shorter than its header of 304 bytes"),
            (lambda content: content[:-1], "383 bytes of boxes, expected 384 for 4 objects in 3 frames"),
            (lambda content: content + b"\0", "385 bytes of boxes, expected 384"),
            (lambda content: content[:256] + struct.pack("<i", 0) + content[260:], "0 objects in 3 frames"),
            (lambda content: content[:260] + struct.pack("<i", -1) + content[264:], "4 objects in -1 frames"),
            (lambda content: content[:264] + struct.pack("<i", 7) + content[268:], r"then \[7, 0\]"),
            (lambda content: b"\xff" + content[1:], "a name in it is no text"),
            (lambda content: content[:304] + struct.pack("<f", 9.0) + content[308:], "box 0 of frame 0 is"),
            (lambda content: content[:-16] + struct.pack("<f", np.nan) + content[-12:], "box 3 of frame 2 is"),
            (lambda content: bytes(range(256)) * 4, "not an AABB stream"),
        ],
    )  # fmt: skip
    def test_malformed_files_get_one_line(self, tmp_path, spoil, message):
        path = tmp_path / "a.aabb"
        write_stream(path, self.stream())
        path.write_bytes(spoil(path.read_bytes()))
        with pytest.raises(StreamError, match=message) as error:
            read_stream(path)
        assert "\n" not in str(error.value)

    def test_what_cannot_be_written_is_not(self, tmp_path):
        stream = self.stream()
        for wrong in (
            stream._replace(scene="long" * 40),
            stream._replace(lower=stream.lower[:0], upper=stream.upper[:0]),
            stream._replace(upper=stream.upper * 1e39),
        ):
            with pytest.raises(StreamError):
                write_stream(tmp_path / "a.aabb", wrong)
        assert files(tmp_path) == []


class TestCommand:
    def test_a_scene_leaves_json_and_figures(self, folder):
        result = run("scene.toml", "--steps", "3", "--stream", "frames.aabb")
        assert result.exit_code == 0
        assert "trajectory: the same, to the last bit" in result.stdout
        written = [f"renders/compare_scene.{suffix}" for suffix in ("json", "png", "svg")]
        assert files(folder) == ["frames.aabb", *written, "scene.toml"]
        table = json.loads((folder / "renders/compare_scene.json").read_text())
        assert table["same_pairs"] and table["same_trajectory"]
        assert [row["method"] for row in table["results"]] == list(METHODS)
        assert (folder / "renders/compare_scene.svg").read_text().startswith("<?xml")
        assert (folder / "renders/compare_scene.png").read_bytes().startswith(b"\x89PNG")

    def test_a_stream_is_compared_on_as_it_was_written(self, folder):
        assert run("scene.toml", "--steps", "3", "--stream", "frames.aabb", "-q").exit_code == 0
        result = run("frames.aabb", "-o", "stream.json")
        assert result.exit_code == 0
        assert "scene: 20 boxes, 4 frames" in result.stdout
        assert "trajectory" not in result.stdout

    def test_a_broad_phase_that_joins_the_registry_has_its_place(self, folder, monkeypatch):
        monkeypatch.setitem(METHODS, "fourth", METHODS["naive"])
        monkeypatch.setitem(METHODS, "fifth", METHODS["octree"])
        result = run("scene.toml", "--steps", "1")
        assert result.exit_code == 0, result.exception
        table = json.loads((folder / "renders/compare_scene.json").read_text())
        assert [row["method"] for row in table["results"]] == list(METHODS)
        figure = (folder / "renders/compare_scene.svg").read_text()
        assert "fourth" in figure and "fifth" in figure
        colours = _bar_colours(["naive", "fourth", "grid", "fifth", "octree"])
        assert len(set(colours)) == 5

    def test_a_scene_and_its_stream_do_not_overwrite_each_other(self, folder):
        assert run("scene.toml", "--steps", "1", "--stream", "scene.aabb", "-q").exit_code == 0
        before = (folder / "renders/compare_scene.json").read_bytes()
        assert run("scene.aabb", "-q").exit_code == 0
        assert (folder / "renders/compare_scene.json").read_bytes() == before
        assert {"renders/compare_scene.json", "renders/compare_scene_stream.json"} <= set(files(folder))

    def test_bars_are_in_proportion(self, folder, monkeypatch):
        """2 : 1 looks like 2 : 1, whatever the rest."""
        comparison = SceneComparison("a", 10, 1, 0, machine(), [])
        comparison.results += [
            Result("grid", search_seconds=1.1e-4, tested=2000, memory=10),
            Result("octree", search_seconds=2.2e-4, tested=1000, memory=10),
        ]
        drawn = []
        monkeypatch.setattr(figure, "save_figure", lambda shown, _: drawn.append(shown))
        figure.draw_scene(comparison, folder / "bars")
        for axes, ratio in zip(drawn[0].axes, (2.0, 0.5, 1.0), strict=True):
            first, second = (bar.get_window_extent().height for bar in axes.patches)
            assert second / first == pytest.approx(ratio)
            assert axes.get_ylim()[0] == 0.0

    def test_a_sweep(self, folder):
        result = run("--sweep", "mixed", "--largest", "316")
        assert result.exit_code == 0
        assert "pairs: the same, to the last bit" in result.stdout
        assert "mixed: particle 416 of 416" in result.stderr
        figure = (folder / "renders/compare_mixed.svg").read_text()
        assert "n (n - 1), as the paper counts naive" in figure and ">grid<" in figure and "boxing" not in figure

    def test_quiet_prints_nothing(self, folder):
        result = run("--sweep", "uniform", "--largest", "100", "-q", "-o", "here.json")
        assert (result.exit_code, result.output) == (0, "")
        assert files(folder) == ["here.json", "here.png", "here.svg", "scene.toml"]

    def test_disagreement_is_exit_code_1(self, folder, forgetful):
        result = run("--sweep", "uniform", "--largest", "100")
        assert (result.exit_code, result.stderr.splitlines()[-1]) == (1, "the broad phases do not agree")
        assert "NOT THE SAME: grid on 100 boxes" in result.stdout

    @pytest.mark.parametrize(
        ("arguments", "line"),
        [
            ([], "give a scene, a stream or --sweep, and one of them only"),
            (["scene.toml", "--sweep", "mixed"], "give a scene, a stream or --sweep, and one of them only"),
            (["--sweep", "odd"], "--sweep: unknown kind of boxes 'odd'; there are uniform, clustered, mixed"),
            (["none.toml"], "none.toml: no such file"),
            (["none.aabb"], "none.aabb: no such file"),
            (["broken.aabb"], "broken.aabb: not an AABB stream: shorter than its header of 304 bytes"),
            (["scene.toml", "-o", "figure.svg"], "figure.svg: the output must end in .json"),
            (["scene.toml", "--stream", "frames.bin"], "frames.bin: the output must end in .aabb"),
        ],
    )  # fmt: skip
    def test_wrong_input_gets_one_line_and_leaves_nothing(self, folder, arguments, line):
        (folder / "broken.aabb").write_bytes(b"of yesterday")
        result = run(*arguments, "-q")
        assert (result.exit_code, result.stderr, result.stdout) == (2, line + "\n", "")
        assert files(folder) == ["broken.aabb", "scene.toml"]
