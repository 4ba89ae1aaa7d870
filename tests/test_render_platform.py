"""Which OpenGL is chosen, and what is said when there is none."""

import os
import subprocess
import sys

import pytest

from particlesim.rendering import RenderError
from particlesim.rendering.gl import platform

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


def draw(**environment):
    child = subprocess.run(
        [sys.executable, "-c", DRAW], capture_output=True, text=True, env={**os.environ, **environment}, check=True
    )
    return child.stdout.splitlines()


def test_importing_the_renderer_is_cheap():
    code = "import sys, particlesim.rendering; print(sorted({'OpenGL', 'pyrender', 'numba'} & set(sys.modules)))"
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout.strip() == "[]"


def test_platform_that_does_not_exist_is_one_line_with_the_remedy():
    lines = draw(PYOPENGL_PLATFORM="nonsense")
    assert len(lines) == 1
    assert "nonsense" in lines[0] and platform.FIX in lines[0]


def test_machine_without_opengl_is_one_line_with_the_remedy(monkeypatch):
    monkeypatch.delenv("PYOPENGL_PLATFORM", raising=False)
    monkeypatch.setattr(platform, "_probe", lambda name: "not installed")
    platform.choose.cache_clear()
    try:
        with pytest.raises(RenderError) as error:
            platform.choose()
    finally:
        platform.choose.cache_clear()
    assert str(error.value).endswith(platform.FIX) and "\n" not in str(error.value)
    assert "egl: not installed; osmesa: not installed" in str(error.value)


def test_a_driver_that_crashes_takes_only_the_probe_with_it(monkeypatch, tmp_path):
    crash = tmp_path / "python"
    crash.write_text("#!/bin/sh\nkill -SEGV $$\n")
    crash.chmod(0o755)
    monkeypatch.setattr(platform.sys, "executable", str(crash))
    assert "crashes" in platform._probe("egl")


def test_every_platform_of_this_machine_draws_the_same_picture():
    working = [name for name in platform.PLATFORMS if isinstance(platform._probe(name), platform.Platform)]
    assert working, f"no OpenGL: {platform.FIX}"
    pictures = {tuple(draw(PYOPENGL_PLATFORM=name)) for name in working}
    assert len(pictures) == 1
    assert len(bytes.fromhex(pictures.pop()[0])) == 128 * 96 * 3


def test_descriptions_are_one_line():
    assert "ffmpeg version" in platform.describe_ffmpeg() and "\n" not in platform.describe_ffmpeg()
    assert "OpenGL" in platform.describe() and "\n" not in platform.describe()
