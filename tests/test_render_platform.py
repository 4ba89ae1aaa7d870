"""Which OpenGL is chosen, and what is said when there is none."""

import os
import re
import subprocess
import sys
from functools import partial

import numpy as np
import pytest

from particlesim.jobs import frame_source, movie
from particlesim.rendering import RenderError
from particlesim.rendering.gl import platform
from particlesim.rendering.gl.probe import load_folder
from particlesim.scene import Scene
from tests.worlds import gas

DRAW = """
import numpy as np
from particlesim.geometry import shapes
from particlesim.rendering import Renderer, RenderError
from particlesim.rendering.look import look_of
from particlesim.scene import Scene
from particlesim.trajectory.frames import Frame, Header
scene = Scene(world={"size": (2, 2, 2)}, particles=[{"shape": "sphere", "count": 1}],
              movie={"resolution": (128, 96)})
header = Header("", (shapes.sphere(),), np.zeros(1, int), np.ones(1), np.zeros(1, int),
                np.ones(1), np.ones((1, 3)))
zero = np.zeros((1, 3))
frame = Frame(0.0, zero, np.array([[1.0, 0, 0, 0]]), zero, zero, zero.astype(int), np.zeros(1, int))
try:
    with Renderer(look_of(scene, header, frame)) as renderer:
        print(renderer.draw(frame).tobytes().hex())
except RenderError as error:
    print(error)
"""


ONLY = """
from particlesim.rendering.gl import platform
platform.SOURCES = {{{source!r}: platform.SOURCES[{source!r}]}}
"""


def draw(source=None, **environment):
    code = DRAW if source is None else ONLY.format(source=source) + DRAW
    child = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env={**os.environ, **environment}, check=True
    )
    return child.stdout.splitlines()


def picture(source):
    (line,) = draw(source, PYOPENGL_PLATFORM=platform.SOURCES[source])
    return np.frombuffer(bytes.fromhex(line), dtype=np.uint8).reshape(96, 128, 3).astype(int)


def works(source):
    return isinstance(platform._probe(source), platform.Platform)


@pytest.fixture
def probed(monkeypatch):
    """Lets sources be found, or not for a reason, as a test says."""

    def pretend(**answers):
        answers = {source.replace("_", "-"): answer for source, answer in answers.items()}
        monkeypatch.setattr(platform, "_probe", lambda source: answers.get(source, "not installed"))

    monkeypatch.delenv("PYOPENGL_PLATFORM", raising=False)
    platform._found.cache_clear()
    yield pretend
    platform._found.cache_clear()


def test_importing_the_renderer_is_cheap():
    code = "import sys, particlesim.rendering; print(sorted({'OpenGL', 'pyrender', 'numba'} & set(sys.modules)))"
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout.strip() == "[]"


def test_platform_that_does_not_exist_is_one_line_with_the_remedy():
    lines = draw(PYOPENGL_PLATFORM="nonsense")
    assert len(lines) == 1
    assert "nonsense" in lines[0] and platform.FIX in lines[0]


def test_machine_without_opengl_is_one_line_with_the_remedy(probed):
    probed()
    with pytest.raises(RenderError) as error:
        platform.choose()
    assert str(error.value).endswith(platform.FIX) and "\n" not in str(error.value)
    assert "egl: not installed; osmesa: not installed; lavavu-osmesa: not installed" in str(error.value)


@pytest.mark.parametrize(("make", "name"), [(movie.render, "a.mp4"), (partial(movie.still, time=1.0), "a.png")])
def test_a_machine_that_cannot_draw_is_found_out_before_any_work(make, name, probed, monkeypatch, tmp_path):
    probed()
    monkeypatch.setattr(frame_source, "start", lambda *_: pytest.fail("works"))
    with pytest.raises(RenderError, match="cannot draw"):
        make(Scene(world={"size": (2, 2, 2)}, particles=[{"shape": "sphere", "count": 1}]), tmp_path / name)


def found(source):
    return platform.Platform(source, None, "Mesa", "llvmpipe", "4.5")


def test_the_system_comes_first_and_the_description_says_why(probed):
    probed(egl=found("egl"), osmesa=found("osmesa"), lavavu_osmesa=found("lavavu-osmesa"))
    assert platform.describe() == "egl of the system, llvmpipe, Mesa, OpenGL 4.5 (tried first)"


def test_osmesa_of_the_system_comes_before_that_of_the_wheel(probed):
    probed(osmesa=found("osmesa"), lavavu_osmesa=found("lavavu-osmesa"))
    assert platform.choose().source == "osmesa"
    assert platform.describe().endswith("(as others do not draw: egl: not installed)")


def test_the_wheel_comes_last(probed):
    probed(lavavu_osmesa=found("lavavu-osmesa"))
    assert (platform.choose().source, platform.choose().name) == ("lavavu-osmesa", "osmesa")
    assert platform.describe().startswith("osmesa of the wheel lavavu-osmesa, ")
    assert "egl: not installed; osmesa: not installed" in platform.describe()


def test_the_environment_decides_if_it_is_set(probed, monkeypatch):
    probed(egl=found("egl"), lavavu_osmesa=found("lavavu-osmesa"))
    monkeypatch.setenv("PYOPENGL_PLATFORM", "osmesa")
    assert platform.choose().source == "lavavu-osmesa"
    platform._found.cache_clear()
    probed(osmesa=found("osmesa"))
    assert "as PYOPENGL_PLATFORM says" in platform.describe()


FORK = """
import multiprocessing
import sys

def drawn():
    try:
        with Renderer(look_of(scene, header, frame)) as renderer:
            return renderer.draw(frame).std() > 0.0
    except RenderError as error:
        return str(error)

def say(draw):
    print(draw(), flush=True)

def child(draw):
    process = multiprocessing.get_context("fork").Process(target=say, args=(draw,))
    process.start()
    process.join()

child(drawn)
print(drawn(), flush=True)
child(drawn)
with Renderer(look_of(scene, header, frame)) as open_before:
    def again():
        try:
            return open_before.draw(frame).std() > 0.0
        except RenderError as error:
            return str(error)
    child(again)
"""


def test_a_fork_draws_unless_something_has_been_drawn_before_it():
    code = DRAW[: DRAW.index("try:")] + FORK
    child = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120)
    before, here, after, handed_down = child.stdout.splitlines()
    assert (before, here) == ("True", "True")
    assert after == handed_down and after.startswith("cannot draw in a fork of a process that has drawn")
    assert "'spawn' or 'forkserver'" in after


def test_a_driver_that_crashes_takes_only_the_probe_with_it(monkeypatch, tmp_path):
    crash = tmp_path / "python"
    crash.write_text("#!/bin/sh\nkill -SEGV $$\n")
    crash.chmod(0o755)
    monkeypatch.setattr(platform.sys, "executable", str(crash))
    assert "crashes" in platform._probe("egl")


def test_every_platform_of_this_machine_draws_the_same_picture():
    working = [source for source in ("egl", "osmesa") if works(source)]
    assert working or works(platform.WHEEL), f"no OpenGL: {platform.FIX}"
    pictures = [picture(source) for source in working]
    assert all((one == pictures[0]).all() for one in pictures)


def test_the_wheel_draws_what_the_system_draws():
    """Except that another version of the compiler behind it may round otherwise."""
    has_wheel = sys.platform == "linux" and os.uname().machine == "x86_64"
    assert works(platform.WHEEL) == has_wheel
    sources = [source for source in platform.SOURCES if works(source)]
    first, *_, last = (picture(source) for source in (sources[0], sources[-1]))
    assert len(np.unique(first.reshape(-1, 3), axis=0)) > 100
    assert np.abs(first - last).max() <= 1


def test_a_folder_without_the_library_says_so(tmp_path):
    with pytest.raises(OSError, match="holds no libOSMesa"):
        load_folder(str(tmp_path), "libOSMesa")
    (tmp_path / "libOSMesa.so").write_text("not a library")
    with pytest.raises(OSError, match=r"libOSMesa\.so: "):
        load_folder(str(tmp_path), "libOSMesa")
    with pytest.raises(OSError, match="No such file"):
        load_folder(str(tmp_path / "nowhere"), "libOSMesa")


def test_an_ffmpeg_that_is_none_is_named_before_any_work(monkeypatch, tmp_path):
    monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", sys.executable)
    working = []
    with pytest.raises(RenderError, match=f"{re.escape(sys.executable)} .*(is not ffmpeg|does not run)"):
        movie.render(gas(3), tmp_path / "a.mp4", progress=lambda *told: working.append(told))
    assert not working and not list(tmp_path.iterdir())


def test_a_context_that_is_lost_is_one_line(monkeypatch, tmp_path):
    pyrender_bridge = platform.open_bridge(platform.choose())
    draw, pictures = pyrender_bridge.Canvas.draw, []

    def lose(canvas, picture):
        pictures.append(picture)
        if len(pictures) == 4:
            lost = pyrender_bridge.OpenGL.error.GLError(err=0x0507)  # GL_CONTEXT_LOST
            monkeypatch.setattr(canvas._context, "make_current", lambda: raised(lost))
        return draw(canvas, picture)

    monkeypatch.setattr(pyrender_bridge.Canvas, "draw", lose)
    with pytest.raises(RenderError, match=r"OpenGL \(.*\) gives no picture of \(64, 64\): GLError.* 1287"):
        movie.render(gas(3, movie={"resolution": [64, 64]}), tmp_path / "a.mp4")


def raised(error):
    raise error


def test_descriptions_are_one_line():
    assert "ffmpeg version" in platform.describe_ffmpeg() and "\n" not in platform.describe_ffmpeg()
    assert "OpenGL" in platform.describe() and "\n" not in platform.describe()
