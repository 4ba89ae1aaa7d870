"""Which OpenGL platform and which ffmpeg this machine has. PyOpenGL fixes its platform when it is first imported."""

from __future__ import annotations

import functools
import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from particlesim.rendering.errors import RenderError

PLATFORMS = ("egl", "osmesa")
FIX = "apt-get install -y --no-install-recommends libegl1 libgl1"

# Opening a context takes a fraction of a second; a driver that takes this long [s] hangs.
_PATIENCE = 60.0


@dataclass(frozen=True)
class Platform:
    """A platform that opens contexts: its name, EGL device, and what its driver says of itself."""

    name: str
    device: int | None
    vendor: str
    renderer: str
    version: str


@functools.cache
def choose() -> Platform:
    """The platform to draw with: PYOPENGL_PLATFORM if set, else the first of EGL and OSMesa that opens a context.

    The answer is kept for the process. RenderError, one line with the remedy, if none works.
    """
    wanted = os.environ.get("PYOPENGL_PLATFORM")
    if wanted and wanted not in PLATFORMS:
        raise RenderError(
            f"PYOPENGL_PLATFORM is '{wanted}' but must be one of {', '.join(PLATFORMS)} to draw without a screen: "
            f"unset it, or install what is needed with: {FIX}"
        )
    reasons = []
    for name in (wanted,) if wanted else PLATFORMS:
        found = _probe(name)
        if isinstance(found, Platform):
            return found
        reasons.append(f"{name}: {found}")
    raise RenderError(f"cannot draw without OpenGL ({'; '.join(reasons)}): install it with: {FIX}")


def open_bridge(found: Platform) -> Any:
    """The module that draws, with PyOpenGL on the platform found. RenderError if it cannot be imported."""
    # PyOpenGL reads the platform here, at its first import and never again.
    os.environ["PYOPENGL_PLATFORM"] = found.name
    try:
        from particlesim.rendering.gl import pyrender_bridge  # noqa: PLC0415
    except (ImportError, AttributeError, OSError) as error:
        raise RenderError(f"cannot draw: {_one_line(str(error))}; install what OpenGL needs with: {FIX}") from error
    return pyrender_bridge


def describe() -> str:
    """One line on the OpenGL that pictures are drawn with. RenderError as for ``choose``."""
    found = choose()
    return f"{found.name}, {found.renderer}, {found.vendor}, OpenGL {found.version}"


def describe_ffmpeg() -> str:
    """One line on the ffmpeg that movies are encoded with. RenderError if there is none."""
    path = ffmpeg()
    try:
        answer = subprocess.run([path, "-version"], capture_output=True, text=True, timeout=_PATIENCE, check=True)
    except (OSError, subprocess.SubprocessError) as error:
        raise RenderError(f"{path} does not run ({_one_line(str(error))})") from error
    return f"{path}, {answer.stdout.splitlines()[0].split(' Copyright')[0]}"


def ffmpeg() -> str:
    """Path of the ffmpeg to encode with. RenderError if there is none."""
    import imageio_ffmpeg  # noqa: PLC0415  (costs time that commands without a movie need not pay)

    try:
        return str(Path(imageio_ffmpeg.get_ffmpeg_exe()))
    except RuntimeError as error:
        raise RenderError("no ffmpeg: install it with: pip install imageio-ffmpeg") from error


def _probe(name: str) -> Platform | str:
    """What a child process finds on the platform, or why it found nothing."""
    command = [sys.executable, "-I", str(Path(__file__).with_name("probe.py")), name]
    try:
        child = subprocess.run(command, capture_output=True, text=True, timeout=_PATIENCE, check=False)
    except subprocess.TimeoutExpired:
        return "its driver hangs"
    lines = child.stdout.splitlines()
    if child.returncode != 0 or not lines:
        return f"its driver crashes (exit status {child.returncode})"
    answer = json.loads(lines[-1])
    return _one_line(answer["error"]) if "error" in answer else Platform(name=name, **answer)


def _one_line(text: str) -> str:
    return " ".join(text.split())
