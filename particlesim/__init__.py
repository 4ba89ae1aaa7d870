"""particlesim: from a scene file to a movie of particles that bounce as physics says they do, without a screen.

    import particlesim as ps

    scene = ps.load_scene("scenes/mixed_box.toml")
    ps.render(scene, "movie.mp4")

Conventions, everywhere: SI units; right-handed axes, z up; quaternions (w, x, y, z) of unit length, from body to
world axes; angular velocity and momentum in world axes; contact normals point from the first body to the second; a
separation below 0 is an overlap; arrays are named by what they hold, such as ``position (n, 3) float64 [m]``.

Names are loaded when they are first used: a simulation does not need OpenGL, and ``--help`` needs neither. Which names
there are, and where, is in ``__init__.pyi``.
"""

import lazy_loader

__version__ = "0.1.0"

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
