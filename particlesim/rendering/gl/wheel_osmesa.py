"""PyOpenGL's platform OSMesa on the library of a wheel. PyOpenGL imports it by name, as its own platforms."""

from __future__ import annotations

import functools

from OpenGL.platform.osmesa import OSMesaPlatform

from particlesim.rendering.gl.platform import WHEEL, wheel_folder
from particlesim.rendering.gl.probe import load_folder


class WheelOSMesa(OSMesaPlatform):
    """PyOpenGL asks the system for libOSMesa by a name that the wheel's does not have."""

    # The system's libGLU, where there is one, would bring the system's OpenGL along.
    GLU = None

    @functools.cached_property
    def GL(self) -> object:
        """The library with the functions of OpenGL and of OSMesa."""
        folder = wheel_folder()
        if folder is None:
            raise ImportError(f"{WHEEL} is not installed")
        return load_folder(folder, "libOSMesa")
