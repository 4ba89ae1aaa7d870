"""What this machine has for simulating and drawing."""

from __future__ import annotations

import platform
from typing import NamedTuple

import numba

from particlesim.core.jit import CACHE_FOLDER
from particlesim.rendering import RenderError, describe, describe_ffmpeg

# For an ffmpeg that is there but does not work; all else that is missing says itself what to install.
_FFMPEG_REMEDY = "unset IMAGEIO_FFMPEG_EXE, or install it with: pip install --force-reinstall imageio-ffmpeg"


class Finding(NamedTuple):
    """One thing looked at: its name, whether it is there, and what it is or how to get it."""

    what: str
    good: bool
    text: str


def diagnose() -> list[Finding]:
    """Look at everything a movie needs."""
    findings = [
        Finding("python", True, platform.python_version()),
        Finding("numba", True, f"{numba.__version__}, {numba.get_num_threads()} threads"),
        Finding("kernel cache", True, CACHE_FOLDER),
    ]
    for what, look in (("OpenGL", describe), ("ffmpeg", describe_ffmpeg)):
        try:
            findings.append(Finding(what, True, look()))
        except RenderError as error:
            remedy = "" if "install" in str(error) else f"; {_FFMPEG_REMEDY}"
            findings.append(Finding(what, False, f"{error}{remedy}"))
    return findings
