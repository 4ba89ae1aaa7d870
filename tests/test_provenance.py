"""Movies, pictures and trajectories say where they come from, and trajectories can be put to the test."""

import hashlib
import json

import gsd.fl
import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

import particlesim as ps
from particlesim.cli import main as cli
from particlesim.jobs.provenance import ProvenanceError, read_provenance, scene_of
from tests.worlds import gas

TITLE = 'Two; kinds = "of" #bodies\\ and ü'


@pytest.fixture(scope="module")
def scene():
    return gas(3, title=TITLE, seed=7, duration=0.5, movie={"resolution": [64, 64], "fps": 20})


@pytest.fixture(scope="module")
def files(scene, tmp_path_factory):
    folder = tmp_path_factory.mktemp("files")
    ps.simulate(scene, folder / "run.gsd")
    ps.render(scene, folder / "movie.mp4", frames=range(2, 9, 3))
    ps.still(folder / "run.gsd", folder / "still.png", time=0.25)
    return folder


@pytest.mark.parametrize(
    ("name", "frames"),
    [("run.gsd", [0, 11, 1]), ("movie.mp4", [2, 9, 3]), ("movie.png", [2, 9, 3]), ("still.png", [5, 6, 1])],
)
def test_each_kind_of_file_says_what_it_is_of(files, scene, name, frames):
    found = read_provenance(files / name)
    assert found["scene"] == hashlib.sha256(scene.model_dump_json().encode()).hexdigest()
    assert (found["title"], found["seed"], found["frames"]) == (TITLE, 7, frames)
    assert found["keys"] == json.loads(scene.model_dump_json())
    assert found["version"] == "0.1.0" and 0.0 <= found["energy_drift"] < 1e-12
    shown = CliRunner().invoke(cli.app, ["info", str(files / name), "--json"])
    assert json.loads(shown.output) == found
    assert found["scene"][:20] in CliRunner().invoke(cli.app, ["info", str(files / name)]).output


def test_a_table_says_it_in_words(files):
    for name, words in (("run.gsd", "0 to 10 "), ("movie.mp4", "2 to 8, one in 3"), ("still.png", " 5 ")):
        shown = CliRunner().invoke(cli.app, ["info", str(files / name)]).output
        assert words in shown and "restitution" not in shown  # the keys of the scene are a page


def test_a_scene_of_many_keys_does_not_go_along(tmp_path):
    poses = [{"position": [k / 100, 0, 0]} for k in range(-450, 450)]
    row = {"shape": "sphere", "size": 0.005, "placement": {"kind": "list", "poses": poses}}
    many = ps.Scene(world={"size": [10, 1, 1]}, particles=[row], duration=0.1, movie={"resolution": [64, 64]})
    ps.render(many, tmp_path / "movie.mp4", frames=range(1))
    assert len(many.model_dump_json()) > 60_000 and "keys" not in read_provenance(tmp_path / "movie.mp4")
    with pytest.raises(ProvenanceError, match="does not hold its scene"):
        scene_of(tmp_path / "movie.mp4")


def test_where_particles_come_and_go_no_drift_is_told(tmp_path):
    region = {"lower": [-0.5, -0.5, 0.5], "upper": [0.5, 0.5, 0.9]}
    emitter = {"shape": "sphere", "size": 0.2, "rate": 20.0, "count": 3, "region": region, "velocity": [0, 0, -1]}
    summary = ps.simulate(ps.Scene(world={"size": [2, 2, 2]}, emitters=[emitter], duration=0.5), tmp_path / "run.gsd")
    assert summary.flow[0] == 3 and "energy change" not in repr(summary)
    assert read_provenance(tmp_path / "run.gsd")["energy_drift"] is None
    assert "particles come and go" in CliRunner().invoke(cli.app, ["info", str(tmp_path / "run.gsd")]).output


def test_a_frame_is_what_its_scene_gives(files, scene):
    for more in ([], ["--frame", "4"]):
        shown = CliRunner().invoke(cli.app, ["info", "--verify", str(files / "run.gsd"), "--json", "-q", *more])
        found = json.loads(shown.output)
        assert shown.exit_code == 0 and found["same"] and found["hash"] == found["replayed"]


def test_a_changed_number_is_found_out(files, tmp_path):
    with gsd.fl.open(str(files / "run.gsd"), "r") as file:
        place = file.read_chunk(10, "particles/position").astype(np.float32)[5].tobytes()
    data = (files / "run.gsd").read_bytes()
    assert data.count(place) == 1
    other = np.frombuffer(place, np.float32) * np.float32(1.0 + 1e-6)
    (tmp_path / "run.gsd").write_bytes(data.replace(place, other.tobytes()))
    shown = CliRunner().invoke(cli.app, ["info", "--verify", str(tmp_path / "run.gsd"), "-q"])
    assert shown.exit_code == 1 and shown.output.endswith("frame 10 is not what its scene gives\n")
    same = CliRunner().invoke(cli.app, ["info", "--verify", str(tmp_path / "run.gsd"), "-q", "--frame", "9"])
    assert same.exit_code == 0


@pytest.mark.parametrize("ending", [".mp4", ".webm", ".gif", ".png"])
def test_what_is_not_whole_is_refused_though_it_may_say_what_it_is_of(files, scene, tmp_path, ending):
    whole = files / f"movie{ending}"
    if not whole.exists():
        ps.render(scene, whole, frames=range(2, 9, 3))
    data, cut = whole.read_bytes(), tmp_path / whole.name
    for size in (len(data) * 2 // 3, len(data) - 1):
        cut.write_bytes(data[:size])
        shown = CliRunner().invoke(cli.app, ["info", str(cut)])
        assert shown.exit_code == 2
        assert shown.output == f"{cut}: not a whole {ending} file: damaged, cut off, or of another kind\n"
    assert CliRunner().invoke(cli.app, ["info", str(whole)]).exit_code == 0


def test_what_does_not_say_is_refused_in_one_line(files, tmp_path):
    Image.new("RGB", (4, 4)).save(tmp_path / "plain.png")
    (tmp_path / "text.png").write_text("text")
    (tmp_path / "text.mp4").write_text("text")
    for name in ("plain.png", "text.png", "text.mp4", "scene.toml"):
        with pytest.raises(ProvenanceError, match=name):
            read_provenance(tmp_path / name)
    for arguments in (
        ["missing.mp4"],
        ["--verify", str(files / "movie.mp4")],
        [str(files / "run.gsd"), "--verify", "--frame", "11"],
    ):
        shown = CliRunner().invoke(cli.app, ["info", *arguments])
        assert shown.exit_code in (1, 2) and shown.output.count("\n") == 1
