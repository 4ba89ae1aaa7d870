"""Which OpenGL platform and which ffmpeg this machine has. PyOpenGL fixes its platform when it is first imported."""

from __future__ import annotations

import functools
import json
import os
import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from particlesim.rendering.errors import RenderError

WHEEL = "lavavu-osmesa"
# In the order of trying: the system's libraries may have a GPU behind them, the wheel's have none. Each with the
# platform that it is to PyOpenGL.
SOURCES = {"egl": "egl", "osmesa": "osmesa", WHEEL: "osmesa"}
FIX = "apt-get install -y --no-install-recommends libegl1 libgl1"
if sys.platform == "linux" and os.uname().machine == "x86_64":
    FIX = f"pip install --no-deps {WHEEL}, or: {FIX}"

# Opening a context takes a fraction of a second; a driver that takes this long [s] hangs.
_PATIENCE = 60.0


@dataclass(frozen=True)
class Platform:
    """A platform that opens contexts: where it comes from, EGL device, and what its driver says of itself."""

    source: str
    device: int | None
    vendor: str
    renderer: str
    version: str
    passed_over: tuple[str, ...] = ()  # what was tried before it, each with the reason why it does not draw

    @property
    def name(self) -> str:
        """What PyOpenGL calls it."""
        return SOURCES[self.source]


# The process that has drawn, if any has: this one, or one that it was forked from.
_drawn_in: int | None = None


def check_process() -> None:
    """RenderError in a fork of a process that has drawn.

    A driver's threads are not there in a fork, and what waits for them does so for ever.
    """
    if _drawn_in not in (None, os.getpid()):
        raise RenderError(
            "cannot draw in a fork of a process that has drawn: start it by 'spawn' or 'forkserver' "
            "(multiprocessing.get_context), or fork it before anything is drawn"
        )


def choose() -> Platform:
    """The platform to draw with: the first that opens a context of those that PYOPENGL_PLATFORM allows, if it is set.

    The answer is kept for the process.

    Raises
    ------
    RenderError
        In one line with the remedy, if none works, or if this process cannot draw since another has.
    """
    check_process()
    return _found()


@functools.cache
def _found() -> Platform:
    reasons: list[str] = []
    for source in _allowed():
        found = _probe(source)
        if isinstance(found, Platform):
            return replace(found, passed_over=tuple(reasons))
        reasons.append(f"{source}: {found}")
    raise RenderError(f"cannot draw without OpenGL ({'; '.join(reasons)}): install it with: {FIX}")


def _allowed() -> list[str]:
    wanted = os.environ.get("PYOPENGL_PLATFORM")
    allowed = [source for source, name in SOURCES.items() if wanted in (None, "", name)]
    if not allowed:
        names = ", ".join(dict.fromkeys(SOURCES.values()))
        raise RenderError(
            f"PYOPENGL_PLATFORM is '{wanted}' but must be one of {names} to draw without a screen: "
            f"unset it, or install what is needed with: {FIX}"
        )
    return allowed


def open_bridge(found: Platform) -> Any:
    """The module that draws, with PyOpenGL on the platform found. RenderError if it cannot be imported."""
    global _drawn_in  # noqa: PLW0603  (what becomes of a process cannot be undone)
    _drawn_in = os.getpid()
    # PyOpenGL reads the platform here, at its first import and never again.
    os.environ["PYOPENGL_PLATFORM"] = found.name
    try:
        if found.source == WHEEL:
            from OpenGL.plugins import PlatformPlugin  # noqa: PLC0415

            PlatformPlugin.by_name("osmesa").import_path = "particlesim.rendering.gl.wheel_osmesa.WheelOSMesa"
        from particlesim.rendering.gl import pyrender_bridge  # noqa: PLC0415
    except (ImportError, AttributeError, OSError) as error:
        raise RenderError(f"cannot draw: {_one_line(str(error))}; install what OpenGL needs with: {FIX}") from error
    return pyrender_bridge


def wheel_folder() -> str | None:
    """The folder of the libraries in the wheel with libOSMesa, or None if the wheel is not installed."""
    from importlib import metadata  # noqa: PLC0415  (costs time that commands without a picture need not pay)

    try:
        return str(metadata.distribution(WHEEL).locate_file("lavavu_osmesa.libs"))
    except metadata.PackageNotFoundError:
        return None


def describe() -> str:
    """One line on the OpenGL that pictures are drawn with, and why with this one. RenderError as for ``choose``."""
    found = choose()
    origin = f"the wheel {WHEEL}" if found.source == WHEEL else "the system"
    return f"{found.name} of {origin}, {found.renderer}, {found.vendor}, OpenGL {found.version} ({_why(found)})"


def _why(found: Platform) -> str:
    if found.passed_over:
        return "as others do not draw: " + "; ".join(found.passed_over)
    return "as PYOPENGL_PLATFORM says" if os.environ.get("PYOPENGL_PLATFORM") else "tried first"


def describe_ffmpeg() -> str:
    """One line on the ffmpeg that movies are encoded with. RenderError if there is none, or if it does not run."""
    path = ffmpeg()
    try:
        answer = subprocess.run([path, "-version"], capture_output=True, text=True, timeout=_PATIENCE, check=True)
    except (OSError, subprocess.SubprocessError) as error:
        raise RenderError(f"{path} does not run ({_one_line(str(error))})") from error
    first = answer.stdout.partition("\n")[0]
    if not first.startswith("ffmpeg version"):
        raise RenderError(f"{path} is not ffmpeg: it does not say its version")
    return f"{path}, {first.partition(' Copyright')[0]}"


def ffmpeg() -> str:
    """Path of the ffmpeg to encode with. RenderError if there is none."""
    import imageio_ffmpeg  # noqa: PLC0415  (costs time that commands without a movie need not pay)

    try:
        return str(Path(imageio_ffmpeg.get_ffmpeg_exe()))
    except RuntimeError as error:
        raise RenderError("no ffmpeg: install it with: pip install imageio-ffmpeg") from error


def _probe(source: str) -> Platform | str:
    """What a child process finds at a source, or why it found nothing."""
    folder = wheel_folder() if source == WHEEL else ""
    if folder is None:
        return "not installed"
    command = [sys.executable, "-I", str(Path(__file__).with_name("probe.py")), SOURCES[source], folder]
    try:
        child = subprocess.run(command, capture_output=True, text=True, timeout=_PATIENCE, check=False)
    except subprocess.TimeoutExpired:
        return "its driver hangs"
    lines = child.stdout.splitlines()
    if child.returncode != 0 or not lines:
        return f"its driver crashes (exit status {child.returncode})"
    answer = json.loads(lines[-1])
    return _one_line(answer["error"]) if "error" in answer else Platform(source, **answer)


def _one_line(text: str) -> str:
    return " ".join(text.split())
