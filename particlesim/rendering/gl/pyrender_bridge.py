"""The one place that knows pyrender and OpenGL: layers of instanced geometry, drawn off screen into an image.

pyrender brings the context, the scene graph, the cameras and the shader cache. Its stock way of drawing cannot
change the poses of instances once drawn, has no colour for each of them, and runs a heavy shader; hence the
subclasses below. Import this module only after ``platform.choose``: PyOpenGL takes its platform when imported.
"""

from __future__ import annotations

import ctypes
import re
import sys
import types
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from particlesim.rendering.errors import RenderError
from particlesim.rendering.gl.platform import Platform

# pyrender's window needs pyglet, and pyglet needs X libraries; nothing here opens a window.
_viewer = types.ModuleType("pyrender.viewer")
_viewer.Viewer = None  # type: ignore[attr-defined]
sys.modules.setdefault("pyrender.viewer", _viewer)

import OpenGL.error  # noqa: E402
import pyrender  # noqa: E402
from OpenGL import GL as gl  # noqa: E402
from pyrender.constants import RenderFlags  # noqa: E402
from pyrender.shader_program import ShaderProgram  # noqa: E402

_SHADERS = Path(__file__).with_name("shaders")
_FLOAT = 4  # bytes
# Binding points, as the shaders have them: texture units, and that of the uniform block.
_SHADOW_MAP, _PIXEL, _SURFACES, _FLOOR = gl.GL_TEXTURE0, gl.GL_TEXTURE1, gl.GL_TEXTURE2, gl.GL_TEXTURE3
_VIEW_BLOCK = 0  # binding point of the uniform block shared by all


@dataclass(frozen=True)
class Kind:
    """What a layer's instances are: its shaders, the floats of each attribute, and how it meets other layers."""

    vertex_shader: str
    fragment_shader: str
    instance: tuple[int, ...] = ()  # floats of each instance attribute
    mode: int = gl.GL_TRIANGLE_STRIP
    blend: bool = False  # lets through what is behind it, and hides nothing


# Tiles of the picture, in which the canvas shades the surfaces of each kind that were found at its pixels (see
# geometry_tables.py). As points: of two triangles each, what is beside the line between them would be shaded twice.
SURFACES = tuple(Kind("tile", shader, (2,), gl.GL_POINTS) for shader in ("sphere", "face", "rounded"))
FLOOR = Kind("floor", "floor")
LINE = Kind("line", "line", (4, 3, 4), blend=True)


class Layer(pyrender.Primitive):
    """One geometry drawn many times: ``corners`` (c, 3) float32 in the order in which ``kind.mode`` takes them."""

    def __init__(self, kind: Kind, corners: np.ndarray) -> None:
        super().__init__(positions=corners)
        self.kind = kind
        self._corners = np.ascontiguousarray(corners, dtype=np.float32)
        self._rows = np.zeros((0 if kind.instance else 1, sum(kind.instance)), dtype=np.float32)
        self._stale = False

    def put(self, rows: np.ndarray) -> None:
        """Replace the instances: (n, sum of kind.instance) float32. They reach the GPU with the next drawing."""
        self._rows = np.ascontiguousarray(rows, dtype=np.float32)
        self._stale = True

    @property
    def count(self) -> int:
        """How many instances there are."""
        return len(self._rows)

    def draw(self) -> None:
        """Draw the instances with the program in use."""
        if not self.count:
            return
        self._bind()
        if self._stale:
            gl.glBindBuffer(gl.GL_ARRAY_BUFFER, self._buffers[1])
            gl.glBufferData(gl.GL_ARRAY_BUFFER, self._rows.nbytes, self._rows, gl.GL_STREAM_DRAW)
            self._stale = False
        gl.glDrawArraysInstanced(self.kind.mode, 0, len(self._corners), self.count)
        self._unbind()

    def _add_to_context(self) -> None:
        self._vaid = gl.glGenVertexArrays(1)
        gl.glBindVertexArray(self._vaid)
        self._buffers = [int(buffer) for buffer in gl.glGenBuffers(2)]
        gl.glBindBuffer(gl.GL_ARRAY_BUFFER, self._buffers[0])
        gl.glBufferData(gl.GL_ARRAY_BUFFER, self._corners.nbytes, self._corners, gl.GL_STATIC_DRAW)
        self._attributes(0, (3,), divisor=0)
        gl.glBindBuffer(gl.GL_ARRAY_BUFFER, self._buffers[1])
        self._attributes(1, self.kind.instance, divisor=1)
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


class Program(ShaderProgram):
    """A shader program whose files may include others."""

    def _load(self, shader_filename: str) -> str:
        def included(match: re.Match[str]) -> str:
            return (_SHADERS / match[1]).read_text(encoding="utf-8")

        source = Path(shader_filename).read_text(encoding="utf-8")
        return re.sub(r'^#include "(.+)"$', included, source, flags=re.MULTILINE)


@dataclass(frozen=True)
class Picture:
    """What a picture is made of besides the layers. The first rows of all maps are the lowest.

    ``view_block``: the uniform block of shaders/common.glsl; ``shadow`` (h, w) float32: the shadow map, how close to
    the light what it meets is [m]; ``pixel`` (height, width) int32 and ``surfaces`` (rows, 4) float32: what is seen
    at each pixel, see shaders/surface.glsl; ``floor`` (b, a) float32: share of the light that reaches the floor, from
    its corner (-x, -y) to (x, y).
    """

    view_block: np.ndarray
    shadow: np.ndarray
    pixel: np.ndarray
    surfaces: np.ndarray
    floor: np.ndarray


class _Renderer(pyrender.Renderer):
    """Draws the layers of a scene, ``samples`` by ``samples`` to a pixel."""

    picture: Picture

    def __init__(self, size: tuple[int, int], samples: int) -> None:
        super().__init__(samples * size[0], samples * size[1])
        self._programs: dict[Kind, Program] = {}
        self._block, self._table = (int(buffer) for buffer in gl.glGenBuffers(2))
        self._drawn = _Target(samples * size[0], samples * size[1], depth=True)
        self._final = self._drawn if samples == 1 else _Target(*size, depth=False)
        self._surfaces = int(gl.glGenTextures(1))
        # Beyond the edges of the shadow map light meets nothing, beyond those of the floor nothing shades.
        self._shadow, self._floor = _texture(gl.GL_NEAREST, -np.inf), _texture(gl.GL_LINEAR, 1.0)
        self._pixel = _texture(gl.GL_NEAREST, -1.0)
        gl.glBindBuffer(gl.GL_TEXTURE_BUFFER, self._table)
        gl.glBindTexture(gl.GL_TEXTURE_BUFFER, self._surfaces)
        gl.glTexBuffer(gl.GL_TEXTURE_BUFFER, gl.GL_RGBA32F, self._table)

    def render(self, scene: pyrender.Scene, flags: int, seg_node_map: Any = None) -> np.ndarray:
        block = np.ascontiguousarray(self.picture.view_block)
        gl.glBindBufferBase(gl.GL_UNIFORM_BUFFER, _VIEW_BLOCK, self._block)
        gl.glBufferData(gl.GL_UNIFORM_BUFFER, block.nbytes, block, gl.GL_STREAM_DRAW)
        return super().render(scene, flags, seg_node_map)

    def __del__(self) -> None:
        # pyrender deletes objects by number here, in whatever context is then current. Ours go with their context.
        pass

    def _use(self, kind: Kind) -> None:
        if kind not in self._programs:
            shaders = (f"{kind.vertex_shader}.vert", f"{kind.fragment_shader}.frag")
            self._programs[kind] = Program(*(str(_SHADERS / shader) for shader in shaders))
            self._programs[kind]._add_to_context()
        self._programs[kind]._bind()

    def _forward_pass(self, scene: pyrender.Scene, flags: int, seg_node_map: Any = None) -> np.ndarray:
        picture = self.picture
        gl.glBindFramebuffer(gl.GL_FRAMEBUFFER, self._drawn.framebuffer)
        gl.glViewport(0, 0, self._drawn.width, self._drawn.height)
        gl.glEnable(gl.GL_DEPTH_TEST)
        gl.glEnable(gl.GL_PROGRAM_POINT_SIZE)
        gl.glDepthMask(gl.GL_TRUE)
        gl.glClearColor(*scene.bg_color)
        gl.glClear(gl.GL_COLOR_BUFFER_BIT | gl.GL_DEPTH_BUFFER_BIT)
        gl.glBlendFunc(gl.GL_SRC_ALPHA, gl.GL_ONE_MINUS_SRC_ALPHA)
        self._bind_surfaces()
        _fill(_SHADOW_MAP, self._shadow, gl.GL_R32F, gl.GL_RED, gl.GL_FLOAT, picture.shadow)
        _fill(_PIXEL, self._pixel, gl.GL_R32I, gl.GL_RED_INTEGER, gl.GL_INT, picture.pixel)
        _fill(_FLOOR, self._floor, gl.GL_R32F, gl.GL_RED, gl.GL_FLOAT, picture.floor)
        self._draw_layers(scene)
        return self._read_main_framebuffer(scene, flags)

    def _bind_surfaces(self) -> None:
        table = np.ascontiguousarray(self.picture.surfaces)
        gl.glActiveTexture(_SURFACES)
        gl.glBindTexture(gl.GL_TEXTURE_BUFFER, self._surfaces)
        gl.glBindBuffer(gl.GL_TEXTURE_BUFFER, self._table)
        gl.glBufferData(gl.GL_TEXTURE_BUFFER, table.nbytes, table, gl.GL_STREAM_DRAW)

    def _draw_layers(self, scene: pyrender.Scene) -> None:
        for layer in (layer for mesh in scene.meshes for layer in mesh.primitives):
            kind = layer.kind
            self._use(kind)
            (gl.glEnable if kind.blend else gl.glDisable)(gl.GL_BLEND)
            gl.glDepthMask(not kind.blend)
            layer.draw()

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


def _texture(look_up: int, beyond: float) -> int:
    """A map of a plane, of one value beyond its edges."""
    texture = int(gl.glGenTextures(1))
    gl.glBindTexture(gl.GL_TEXTURE_2D, texture)
    gl.glTexParameteri(gl.GL_TEXTURE_2D, gl.GL_TEXTURE_MIN_FILTER, look_up)
    gl.glTexParameteri(gl.GL_TEXTURE_2D, gl.GL_TEXTURE_MAG_FILTER, look_up)
    gl.glTexParameteri(gl.GL_TEXTURE_2D, gl.GL_TEXTURE_WRAP_S, gl.GL_CLAMP_TO_BORDER)
    gl.glTexParameteri(gl.GL_TEXTURE_2D, gl.GL_TEXTURE_WRAP_T, gl.GL_CLAMP_TO_BORDER)
    gl.glTexParameterfv(gl.GL_TEXTURE_2D, gl.GL_TEXTURE_BORDER_COLOR, np.full(4, beyond, dtype=np.float32))
    return texture


def _fill(unit: int, texture: int, form: int, channels: int, number: int, values: np.ndarray) -> None:
    """Put ``values`` (height, width) into a texture, and that on its unit."""
    height, width = values.shape
    gl.glActiveTexture(unit)
    gl.glBindTexture(gl.GL_TEXTURE_2D, texture)
    gl.glTexImage2D(gl.GL_TEXTURE_2D, 0, form, width, height, 0, channels, number, np.ascontiguousarray(values))


class _Target:
    """A frame buffer of 8 bits a channel."""

    def __init__(self, width: int, height: int, depth: bool) -> None:
        self.width, self.height = width, height
        self.framebuffer = gl.glGenFramebuffers(1)
        gl.glBindFramebuffer(gl.GL_FRAMEBUFFER, self.framebuffer)
        self._attach(gl.GL_COLOR_ATTACHMENT0, gl.GL_RGBA8)
        if depth:
            self._attach(gl.GL_DEPTH_ATTACHMENT, gl.GL_DEPTH_COMPONENT24)
        if gl.glCheckFramebufferStatus(gl.GL_FRAMEBUFFER) != gl.GL_FRAMEBUFFER_COMPLETE:
            raise ValueError(f"no frame buffer of {width} x {height} pixels")

    def _attach(self, point: int, form: int) -> None:
        buffer = gl.glGenRenderbuffers(1)
        gl.glBindRenderbuffer(gl.GL_RENDERBUFFER, buffer)
        gl.glRenderbufferStorage(gl.GL_RENDERBUFFER, form, self.width, self.height)
        gl.glFramebufferRenderbuffer(gl.GL_FRAMEBUFFER, point, gl.GL_RENDERBUFFER, buffer)


class Canvas:
    """An off-screen picture of the given layers, drawn in their order. Close it when done.

    ``samples``: squares a side that each pixel is the mean of, 1 or 2.
    """

    def __init__(
        self,
        platform: Platform,
        size: tuple[int, int],
        layers: Sequence[Layer],
        background: np.ndarray,
        samples: int,
    ) -> None:
        self._scene = pyrender.Scene(bg_color=[*background, 1.0])
        self._scene.add(pyrender.Mesh(list(layers)))
        # pyrender wants a camera; the one that counts comes with each picture, in the uniform block.
        self._scene.add(pyrender.PerspectiveCamera(yfov=1.0))
        try:
            self._context = _context(platform, size)
            self._context.init_context()
            self._context.make_current()
            self._renderer = _Renderer(size, samples)
        except (AssertionError, OpenGL.error.Error, OSError, ValueError) as error:
            reason = " ".join(str(error).split()) or type(error).__name__
            raise RenderError(f"OpenGL ({platform.renderer}) gives no picture of {size}: {reason}") from error

    def draw(self, picture: Picture) -> np.ndarray:
        """The picture, (height, width, 4) uint8 sRGB; as always in OpenGL, its first row is the lowest."""
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
