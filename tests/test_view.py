"""Pages that show runs: their numbers are those of the run, they need nothing else, and a browser shows them."""

import base64
import json
import re
import zlib
from html.parser import HTMLParser

import numpy as np
import pytest
from typer.testing import CliRunner

import particlesim as ps
from particlesim.cli import main as cli
from particlesim.geometry.surface import surface_of
from particlesim.rendering.web.page import PageError, check_size
from tests.browser import CHROMIUM, Browser
from tests.worlds import gas, listed, scene


class Scripts(HTMLParser):
    """The texts of scripts by their id, and all attributes that fetch something."""

    def __init__(self, text):
        super().__init__()
        self.found, self.fetched, self._inside = {}, [], None
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        names = dict(attributes)
        self.fetched += [names[name] for name in ("src", "href") if name in names]
        self._inside = names.get("id") if tag == "script" else None

    def handle_endtag(self, tag):
        self._inside = None

    def handle_data(self, data):
        if self._inside:
            self.found[self._inside] = self.found.get(self._inside, "") + data


def unpacked(text):
    """What a page says of a run, and its arrays."""
    found = Scripts(text).found
    run, content = json.loads(found["run"]), zlib.decompress(base64.b64decode(found["arrays"]))
    arrays = {
        entry["name"]: np.frombuffer(content, entry["type"], entry["count"], entry["start"]) for entry in run["arrays"]
    }
    return run, arrays


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    path = tmp_path_factory.mktemp("view") / "run.gsd"
    some = gas(2, duration=0.3)
    coloured = some.model_copy(update={"particles": [g.model_copy(update={"colour": "by_speed"}) for g in some.groups]})
    ps.simulate(coloured, path)
    return path


def test_its_numbers_are_those_of_the_run(run):
    with ps.open(run) as stored:
        frames, header = list(stored), stored.header
    said, arrays = unpacked(ps.view(run).text)
    count = len(header.shape)
    assert said["times"] == [frame.time for frame in frames]
    lower, upper = np.array(said["lower"]), np.array(said["upper"])
    position = lower + (upper - lower) * arrays["position"].reshape(-1, count, 3) / 65535
    velocity = said["fastest"] * arrays["velocity"].reshape(-1, count, 3) / 32767
    orientation = arrays["orientation"].reshape(-1, count, 4) / 32767
    for k, frame in enumerate(frames):
        assert np.abs(position[k] - frame.position).max() <= 0.51 * (upper - lower).max() / 65535
        assert np.abs(velocity[k] - frame.velocity).max() <= 0.51 * said["fastest"] / 32767
        assert np.abs(orientation[k] - frame.orientation).max() <= 0.51 / 32767
    assert (arrays["shape"] == header.shape).all() and (arrays["group"] == header.group).all()
    assert arrays["mass"] == pytest.approx(header.mass, rel=1e-6)
    assert arrays["size"] == pytest.approx(header.size, rel=1e-6)
    assert len(arrays["there"]) == 0 and len(arrays["colour"]) == 3 * count * len(frames)
    for shape, told in zip(header.shapes, said["shapes"], strict=True):
        surface = surface_of(shape)
        assert told["name"] == shape.name and told["triangles"] == surface.triangles.ravel().tolist()
        assert np.array(told["position"]) == pytest.approx(surface.vertices.ravel(), abs=1e-6)


def test_what_comes_and_goes_is_there_when_it_is(tmp_path):
    flowing = scene(
        emitters=[{"shape": "sphere", "count": 4, "rate": 20.0, "size": 0.2, "velocity": [1, 0, 0], "colour": "red",
                   "region": {"lower": [-1, -1, -1], "upper": [1, 1, 1]}}],
        duration=0.3,
    )  # fmt: skip
    ps.simulate(flowing, tmp_path / "run.gsd")
    with ps.open(tmp_path / "run.gsd") as stored:
        expected = [[k in frame.ids for k in range(4)] for frame in stored]
    said, arrays = unpacked(ps.view(tmp_path / "run.gsd").text)
    there = arrays["there"].reshape(-1, 4)
    assert there.astype(bool).tolist() == expected and 0 < there.sum() < there.size
    # Colours that stay are there once.
    assert arrays["colour"].reshape(4, 3).tolist() == [[255, 0, 0]] * 4
    assert np.isfinite([*said["lower"], *said["upper"]]).all()


def test_it_fetches_nothing_and_names_are_no_markup(tmp_path):
    odd = "</script><b src='x'>$title"
    some = scene(listed("sphere", {"position": [0, 0, 0]}, name=odd), title=odd, duration=0.1)
    text = ps.view(some).text
    assert Scripts(text).fetched == []
    assert unpacked(text)[0]["groups"] == [odd]
    assert "<title>&lt;/script&gt;&lt;b src=&#x27;x&#x27;&gt;$title</title>" in text


def test_a_page_is_what_a_notebook_shows(run, tmp_path):
    made = ps.view(run, tmp_path / "page.html", frames=range(3))
    assert (tmp_path / "page.html").read_text() == made.text
    assert re.fullmatch(r"<Page: 3 frames, 0\.\d MB>", repr(made))
    assert made._repr_html_().startswith('<iframe srcdoc="&lt;!doctype html&gt;')


def test_what_is_too_much_for_a_page_is_refused(tmp_path):
    check_size(100_000, 83)
    line = r"^100 frames of 100,000 particles take 240 MB in a page, which holds 200 MB: one frame in 2 goes into it$"
    with pytest.raises(PageError, match=line):
        check_size(100_000, 100)
    with pytest.raises(PageError, match="even one frame is too much"):
        check_size(10_000_000, 1)


def test_the_command(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(cli.app, ["view", str(run), "--every", "4"])
    assert (done.exit_code, done.stdout) == (0, "renders/run.html\n")
    assert len(unpacked((tmp_path / "renders/run.html").read_text())[0]["times"]) == 3
    done = CliRunner().invoke(cli.app, ["view", str(run), "-o", "x.htm"])
    assert (done.exit_code, done.stderr) == (2, "x.htm: the output must end in .html\n")


# What a person does, and what there is to see then.
VIEWER = "while (!window.viewer) await new Promise((done) => setTimeout(done, 20));"
PIXEL = """
viewer.draw();
const gl = viewer.renderer.getContext(), found = new Uint8Array(4);
gl.readPixels(gl.drawingBufferWidth / 2, gl.drawingBufferHeight / 2, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, found);
return [...found].slice(0, 3);
"""
SCRUB = """
const slider = document.getElementById("frame");
slider.value = 5;
slider.dispatchEvent(new Event("input"));
return document.getElementById("time").textContent;
"""
PLAY = """
document.getElementById("play").click();
while (viewer.since !== null) await new Promise((done) => setTimeout(done, 20));
return viewer.frame;
"""
CLICK = """
for (const kind of ["pointerdown", "pointerup"])
  document.querySelector("canvas").dispatchEvent(new PointerEvent(kind, { clientX: %s, clientY: %s, pointerId: 1 }));
return document.getElementById("picked").innerText;
"""


@pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium")
def test_a_browser_shows_it(tmp_path):
    """A ball goes through the middle, where it is seen at frame 5, and clicked on; then the rest is played."""
    ball = listed("sphere", {"position": [-1.0, 0, 0], "velocity": [6.0, 0, 0]}, size=0.4, colour="blue", name="ball")
    one = scene(ball, size=(3.0, 3.0, 3.0), duration=1 / 3, movie={"fps": 30}, camera={"kind": "fixed"})
    ps.view(one, tmp_path / "page.html")
    with Browser(tmp_path / "profile") as browser:
        browser.open(tmp_path / "page.html")
        browser.run(VIEWER)
        background = [0xF4, 0xF2, 0xEE]
        assert np.abs(np.array(browser.run(PIXEL)) - background).max() <= 1
        assert browser.run(SCRUB) == "0.167 of 0.333 s"
        red, green, blue = browser.run(PIXEL)
        assert blue > 2 * red and blue > 2 * green
        numbers = browser.run(CLICK % ("window.innerWidth / 2", "window.innerHeight / 2"))
        assert browser.run(CLICK % (5, 5)) == ""
        assert browser.run(PLAY) == 10
        assert browser.errors == []
    rows = dict(line.split("\t") for line in numbers.strip().split("\n"))
    assert (rows["particle"], rows["shape"], rows["group"]) == ("0", "sphere", "ball")
    assert rows["velocity"] == "6.000, 0.000, 0.000 m/s" and rows["speed"] == "6.000 m/s"
    x, y, z = (float(part) for part in rows["position"].removesuffix(" m").split(", "))
    assert (x, y, z) == pytest.approx((0.0, 0.0, 0.0), abs=1e-4)
    assert float(rows["mass"].split()[0]) == pytest.approx(1000.0 * np.pi / 6.0 * 0.4**3, rel=1e-3)
