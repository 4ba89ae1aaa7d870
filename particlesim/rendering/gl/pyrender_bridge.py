"""The one place that knows pyrender and OpenGL: a picture with its depths, and lines amidst it, drawn off screen.

pyrender brings the context, the scene graph, the cameras and the shader cache. Its stock way of drawing begins with an
empty picture, cannot change what it has drawn once, and runs a heavy shader; hence the subclasses below. Import this
module only after ``platform.choose``: PyOpenGL takes its platform when imported.
"""

from __future__ import annotations

import ctypes
import importlib.util
import sys
import types
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from particlesim.core.text import shortened
from particlesim.rendering.errors import RenderError
from particlesim.rendering.gl.geometry import STRIP
from particlesim.rendering.gl.platform import Platform, check_process

# pyrender's window needs pyglet, and pyglet needs X libraries; nothing here opens a window.
_viewer = types.ModuleType("pyrender.viewer")
_viewer.Viewer = None  # type: ignore[attr-defined]
sys.modules.setdefault("pyrender.viewer", _viewer)


def _put_off(name: str) -> None:
    """Let a package be imported when something of it is first asked for, and modules in it without the rest."""
    spec = importlib.util.find_spec(name)
    if name in sys.modules or spec is None or spec.loader is None:
        return
    package, load = importlib.util.module_from_spec(spec), spec.loader.exec_module

    def fetch(attribute: str) -> Any:
        package.__dict__.pop("__getattr__", None)
        load(package)
        return getattr(package, attribute)

    package.__getattr__ = fetch  # type: ignore[method-assign]
    sys.modules[name] = package


# For meshes, of which there are none here, pyrender imports trimesh, and that half of scipy: most of a second.
_put_off("trimesh")

import OpenGL.error  # noqa: E402
import pyrender  # noqa: E402
from OpenGL import GL as gl  # noqa: E402
from pyrender.constants import RenderFlags  # noqa: E402
from pyrender.shader_program import ShaderProgram  # noqa: E402

_SHADERS = Path(__file__).with_name("shaders")
_FLOAT = 4  # bytes
_LINE = 4, 3, 4  # floats of each attribute of a line
_REASON = 70  # letters of what a driver says that are told
_VIEW_BLOCK = 0  # binding point of the uniform block shared by all shaders
# Formats of what is drawn on, and of the numbers that are put there: in memory they are the same, and copied.
_COLOUR = gl.GL_RGBA8, gl.GL_RGBA, gl.GL_UNSIGNED_BYTE
_DEPTH = gl.GL_DEPTH_COMPONENT32F, gl.GL_DEPTH_COMPONENT, gl.GL_FLOAT


class Lines(pyrender.Primitive):
    """Lines of a constant width on the screen: the strip of geometry.STRIP, drawn once for each of them."""

    def __init__(self) -> None:
        super().__init__(positions=STRIP)
        self._rows = np.zeros((0, sum(_LINE)), dtype=np.float32)
        self._stale = False

    def put(self, rows: np.ndarray) -> None:
        """Replace the lines, see ``geometry.lines``. They reach the GPU with the next drawing."""
        self._rows = np.ascontiguousarray(rows, dtype=np.float32)
        self._stale = True

    def draw(self) -> None:
        """Draw them with the program in use."""
        if not len(self._rows):
            return
        self._bind()
        if self._stale:
            gl.glBindBuffer(gl.GL_ARRAY_BUFFER, self._buffers[1])
            gl.glBufferData(gl.GL_ARRAY_BUFFER, self._rows.nbytes, self._rows, gl.GL_STREAM_DRAW)
            self._stale = False
        gl.glDrawArraysInstanced(gl.GL_TRIANGLE_STRIP, 0, len(STRIP), len(self._rows))
        self._unbind()

    def _add_to_context(self) -> None:
        self._vaid = gl.glGenVertexArrays(1)
        gl.glBindVertexArray(self._vaid)
        self._buffers = [int(buffer) for buffer in gl.glGenBuffers(2)]
        gl.glBindBuffer(gl.GL_ARRAY_BUFFER, self._buffers[0])
        gl.glBufferData(gl.GL_ARRAY_BUFFER, STRIP.nbytes, STRIP, gl.GL_STATIC_DRAW)
        self._attributes(0, (3,), divisor=0)
        gl.glBindBuffer(gl.GL_ARRAY_BUFFER, self._buffers[1])
        self._attributes(1, _LINE, divisor=1)
        gl.glBindVertexArray(0)
        self._stale = True

    @staticmethod
    def _attributes(first: int, widths: tuple[int, ...], divisor: int) -> None:
        offset = 0
        for place, width in enumerate(widths, start=first):
            start = ctypes.c_void_p(offset * _FLOAT)
            gl.glVertexAttribPointer(place, width, gl.GL_FLOAT, gl.GL_FALSE, sum(widths) * _FLOAT, start)
            gl.glEnableVertexAttribArray(place)
            gl.glVertexAttribDivisor(place, divisor)
            offset += width


@dataclass(frozen=True)
class Picture:
    """What there is before lines are drawn. The first rows of both maps are the lowest.

    ``view_block``: the uniform block of shaders/line.vert; ``colour`` (height, width, 4) uint8 sRGB of what each pixel
    sees, and its ``depth`` (height, width) float32 in the window, 0 .. 1: what is farther is hidden by it.
    """

    view_block: np.ndarray
    colour: np.ndarray
    depth: np.ndarray


class _Renderer(pyrender.Renderer):
    """Draws the lines of a scene over a picture that is ``samples`` by ``samples`` to a pixel."""

    picture: Picture

    def __init__(self, size: tuple[int, int], samples: int) -> None:
        super().__init__(samples * size[0], samples * size[1])
        self._program = ShaderProgram(str(_SHADERS / "line.vert"), str(_SHADERS / "line.frag"))
        self._program._add_to_context()
        self._block = int(gl.glGenBuffers(1))
        self._drawn = _Target(samples * size[0], samples * size[1], depth=True)
        self._final = self._drawn if samples == 1 else _Target(*size, depth=False)

    def __del__(self) -> None:
        # pyrender deletes objects by number here, in whatever context is then current. Ours go with their context.
        pass

    def _forward_pass(self, scene: pyrender.Scene, flags: int, seg_node_map: Any = None) -> np.ndarray:
        self._drawn.put(self.picture)
        block = np.ascontiguousarray(self.picture.view_block)
        gl.glBindBufferBase(gl.GL_UNIFORM_BUFFER, _VIEW_BLOCK, self._block)
        gl.glBufferData(gl.GL_UNIFORM_BUFFER, block.nbytes, block, gl.GL_STREAM_DRAW)
        gl.glBindFramebuffer(gl.GL_FRAMEBUFFER, self._drawn.framebuffer)
        gl.glViewport(0, 0, self._drawn.width, self._drawn.height)
        # They let through what is behind them, and hide nothing.
        gl.glEnable(gl.GL_DEPTH_TEST)
        gl.glDepthMask(gl.GL_FALSE)
        gl.glEnable(gl.GL_BLEND)
        # The fourth channel of what is there says how much it hides, and the others are times that.
        gl.glBlendFuncSeparate(gl.GL_SRC_ALPHA, gl.GL_ONE_MINUS_SRC_ALPHA, gl.GL_ONE, gl.GL_ONE_MINUS_SRC_ALPHA)
        self._program._bind()
        for mesh in scene.meshes:
            for lines in mesh.primitives:
                lines.draw()
        return self._read_main_framebuffer(scene, flags)

    def _read_main_framebuffer(self, scene: pyrender.Scene, flags: int) -> np.ndarray:
        drawn, final = self._drawn, self._final
        gl.glBindFramebuffer(gl.GL_READ_FRAMEBUFFER, drawn.framebuffer)
        if final is not drawn:
            # At two samples a side, looking up half way between them gives their mean exactly.
            gl.glBindFramebuffer(gl.GL_DRAW_FRAMEBUFFER, final.framebuffer)
            whole, target = (0, 0, drawn.width, drawn.height), (0, 0, final.width, final.height)
            gl.glBlitFramebuffer(*whole, *target, gl.GL_COLOR_BUFFER_BIT, gl.GL_LINEAR)
            gl.glBindFramebuffer(gl.GL_READ_FRAMEBUFFER, final.framebuffer)
        # Four bytes a pixel, as they are stored: OpenGL takes longer to leave one out than numpy does.
        image = np.empty((final.height, final.width, 4), dtype=np.uint8)
        gl.glReadPixels(0, 0, final.width, final.height, gl.GL_RGBA, gl.GL_UNSIGNED_BYTE, image)
        return image


class _Target:
    """A frame buffer of 8 bits a channel."""

    def __init__(self, width: int, height: int, depth: bool) -> None:
        self.width, self.height = width, height
        self.framebuffer = gl.glGenFramebuffers(1)
        gl.glBindFramebuffer(gl.GL_FRAMEBUFFER, self.framebuffer)
        self._colour = self._attached(gl.GL_COLOR_ATTACHMENT0, _COLOUR)
        self._depth = self._attached(gl.GL_DEPTH_ATTACHMENT, _DEPTH) if depth else 0
        if gl.glCheckFramebufferStatus(gl.GL_FRAMEBUFFER) != gl.GL_FRAMEBUFFER_COMPLETE:
            raise ValueError(f"no frame buffer of {width} x {height} pixels")

    def put(self, picture: Picture) -> None:
        """Fill it with a picture."""
        for texture, form, values in ((self._colour, _COLOUR, picture.colour), (self._depth, _DEPTH, picture.depth)):
            gl.glBindTexture(gl.GL_TEXTURE_2D, texture)
            gl.glTexSubImage2D(gl.GL_TEXTURE_2D, 0, 0, 0, self.width, self.height, *form[1:], values)

    def _attached(self, point: int, form: tuple[int, int, int]) -> int:
        texture = int(gl.glGenTextures(1))
        gl.glBindTexture(gl.GL_TEXTURE_2D, texture)
        gl.glTexParameteri(gl.GL_TEXTURE_2D, gl.GL_TEXTURE_MAX_LEVEL, 0)
        gl.glTexImage2D(gl.GL_TEXTURE_2D, 0, form[0], self.width, self.height, 0, *form[1:], None)
        gl.glFramebufferTexture2D(gl.GL_FRAMEBUFFER, point, gl.GL_TEXTURE_2D, texture, 0)
        return texture


class Canvas:
    """An off-screen picture with lines in it. Close it when done.

    ``samples``: squares a side that each pixel is the mean of, 1 or 2.
    """

    def __init__(self, platform: Platform, size: tuple[int, int], lines: Lines, samples: int) -> None:
        self._scene = pyrender.Scene()
        self._scene.add(pyrender.Mesh([lines]))
        # pyrender wants a camera; the one that counts comes with each picture, in the uniform block.
        self._scene.add(pyrender.PerspectiveCamera(yfov=1.0))
        self._what = f"OpenGL ({platform.renderer}) gives no picture of {size}"
        with self._one_line_errors():
            self._context = _context(platform, size)
            self._context.init_context()
            self._context.make_current()
            self._renderer = _Renderer(size, samples)

    @contextmanager
    def _one_line_errors(self) -> Iterator[None]:
        """RenderError for what a driver says that has no context to draw in, or has lost it."""
        try:
            yield
        except (AssertionError, OpenGL.error.Error, OSError, ValueError) as error:
            # What it was called with comes last, and says nothing.
            reason = shortened(" ".join(str(error).split()), _REASON) or type(error).__name__
            raise RenderError(f"{self._what}: {reason}") from error

    def draw(self, picture: Picture) -> np.ndarray:
        """The picture, (height, width, 4) uint8 sRGB; as always in OpenGL, its first row is the lowest.

        RenderError if the context is lost, such as that of a GPU that was taken away.
        """
        check_process()
        with self._one_line_errors():
            self._context.make_current()
            self._renderer.picture = picture
            return self._renderer.render(self._scene, RenderFlags.OFFSCREEN)

    def close(self) -> None:
        """Give back the context and what it holds. Other canvases live on: the display is shared and stays."""
        self._context.delete_context()


def _context(platform: Platform, size: tuple[int, int]) -> Any:
    if platform.name == "osmesa":
        from pyrender.platforms.osmesa import OSMesaPlatform  # noqa: PLC0415

        return OSMesaPlatform(*size)
    from OpenGL import EGL as egl  # noqa: PLC0415
    from pyrender.platforms.egl import EGLPlatform, get_device_by_index  # noqa: PLC0415

    class _Egl(EGLPlatform):
        _egl_context: Any

        def delete_context(self) -> None:
            # pyrender terminates the display here, and with it every other context of the process.
            if self._egl_context is not None:
                egl.eglMakeCurrent(self._egl_display, egl.EGL_NO_SURFACE, egl.EGL_NO_SURFACE, egl.EGL_NO_CONTEXT)
                egl.eglDestroyContext(self._egl_display, self._egl_context)
                self._egl_context = None

    return _Egl(*size, device=get_device_by_index(platform.device))
