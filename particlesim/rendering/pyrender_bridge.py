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
from particlesim.rendering.platform import Platform

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
_SAMPLES = 4  # a pixel; what the sphere shader's mask is written for
_SHADOW_SHARE = 1.2  # edge of the shadow map, in heights of the picture: a texel is then about as large as a pixel
_VIEW_BLOCK = 0  # binding point of the uniform block that all programs share


@dataclass(frozen=True)
class Kind:
    """What a layer's instances are: its shaders, the floats of each attribute, and how it meets other layers."""

    name: str
    vertex: tuple[int, ...]  # floats of each vertex attribute, the first three being a place
    instance: tuple[int, ...]  # floats of each instance attribute
    mode: int = gl.GL_TRIANGLES
    shadow: bool = False  # casts one
    cull: bool = False  # only faces towards the camera are drawn, only those away from the light cast a shadow
    blend: bool = False  # lets through what is behind it, and hides nothing


SPHERE = Kind("sphere", (3,), (4, 3), gl.GL_TRIANGLE_STRIP, shadow=True)
HULL = Kind("hull", (3, 3, 4), (4, 4, 3), shadow=True, cull=True)
FLOOR = Kind("floor", (3,), (), gl.GL_TRIANGLE_STRIP)
LINE = Kind("line", (3,), (4, 3, 4), gl.GL_TRIANGLE_STRIP, blend=True)


class Layer(pyrender.Primitive):
    """One geometry drawn many times. ``vertices`` (v, sum of kind.vertex) float32, drawn as ``kind.mode`` says.

    ``triangles`` (t, 3) uint32 are rows of ``vertices``; without them the vertices are drawn in their order.
    """

    def __init__(self, kind: Kind, vertices: np.ndarray, triangles: np.ndarray | None = None) -> None:
        super().__init__(positions=vertices[:, :3])
        self.kind = kind
        order = np.arange(len(vertices)) if triangles is None else triangles
        self._order = np.ascontiguousarray(order, dtype=np.uint32).ravel()
        self._vertices = np.ascontiguousarray(vertices, dtype=np.float32)
        self._rows = np.zeros((0 if kind.instance else 1, sum(kind.instance)), dtype=np.float32)
        self.visible = len(self._rows)
        self._stale = False

    def put(self, rows: np.ndarray, visible: int | None = None) -> None:
        """Replace the instances: (n, sum of kind.instance) float32. They reach the GPU with the next drawing.

        Only the first ``visible`` are in the picture; the others cast shadows all the same.
        """
        self._rows = np.ascontiguousarray(rows, dtype=np.float32)
        self.visible = len(self._rows) if visible is None else visible
        self._stale = True

    @property
    def count(self) -> int:
        """How many instances there are."""
        return len(self._rows)

    def draw(self, count: int) -> None:
        """Draw the first ``count`` instances with the program in use."""
        if not count:
            return
        self._bind()
        if self._stale:
            gl.glBindBuffer(gl.GL_ARRAY_BUFFER, self._buffers[1])
            gl.glBufferData(gl.GL_ARRAY_BUFFER, self._rows.nbytes, self._rows, gl.GL_STREAM_DRAW)
            self._stale = False
        gl.glDrawElementsInstanced(self.kind.mode, len(self._order), gl.GL_UNSIGNED_INT, ctypes.c_void_p(0), count)
        self._unbind()

    def _add_to_context(self) -> None:
        self._vaid = gl.glGenVertexArrays(1)
        gl.glBindVertexArray(self._vaid)
        self._buffers = [int(buffer) for buffer in gl.glGenBuffers(3)]
        gl.glBindBuffer(gl.GL_ARRAY_BUFFER, self._buffers[0])
        gl.glBufferData(gl.GL_ARRAY_BUFFER, self._vertices.nbytes, self._vertices, gl.GL_STATIC_DRAW)
        self._attributes(0, self.kind.vertex, divisor=0)
        gl.glBindBuffer(gl.GL_ARRAY_BUFFER, self._buffers[1])
        self._attributes(len(self.kind.vertex), self.kind.instance, divisor=1)
        gl.glBindBuffer(gl.GL_ELEMENT_ARRAY_BUFFER, self._buffers[2])
        gl.glBufferData(gl.GL_ELEMENT_ARRAY_BUFFER, self._order.nbytes, self._order, gl.GL_STATIC_DRAW)
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
    """A shader program whose files may include others, and which takes its uniforms from the shared block."""

    def _load(self, shader_filename: str) -> str:
        def included(match: re.Match[str]) -> str:
            return (_SHADERS / match[1]).read_text(encoding="utf-8")

        source = Path(shader_filename).read_text(encoding="utf-8")
        return re.sub(r'^#include "(.+)"$', included, source, flags=re.MULTILINE)

    def _add_to_context(self) -> None:
        super()._add_to_context()
        block = gl.glGetUniformBlockIndex(self._program_id, "View")
        gl.glUniformBlockBinding(self._program_id, block, _VIEW_BLOCK)


class _KeyLight(pyrender.DirectionalLight):
    """The light that casts shadows, with a map that is looked up between its texels."""

    def __init__(self, pixels: int) -> None:
        super().__init__()
        self.pixels = pixels

    def _generate_shadow_texture(self, size: int | None = None) -> None:
        smooth = pyrender.Sampler(
            magFilter=gl.GL_LINEAR,
            minFilter=gl.GL_LINEAR,
            wrapS=gl.GL_CLAMP_TO_BORDER,
            wrapT=gl.GL_CLAMP_TO_BORDER,
        )
        self.shadow_texture = pyrender.Texture(
            sampler=smooth,
            source_channels="D",
            data_format=gl.GL_FLOAT,
            width=self.pixels,
            height=self.pixels,
        )


class _Renderer(pyrender.Renderer):
    """Draws the layers of a scene: shadow map, then one picture of four samples a pixel."""

    _main_fb: int | None
    _main_fb_ms: int | None

    def __init__(self, width: int, height: int) -> None:
        super().__init__(width, height)
        self._programs: dict[str, Program] = {}
        self._block = gl.glGenBuffers(1)
        self.view_block = np.zeros(0, dtype=np.float32)

    def render(self, scene: pyrender.Scene, flags: int, seg_node_map: Any = None) -> np.ndarray:
        gl.glBindBufferBase(gl.GL_UNIFORM_BUFFER, _VIEW_BLOCK, self._block)
        gl.glBufferData(
            gl.GL_UNIFORM_BUFFER, self.view_block.nbytes, np.ascontiguousarray(self.view_block), gl.GL_STREAM_DRAW
        )
        return super().render(scene, flags, seg_node_map)

    def __del__(self) -> None:
        # pyrender deletes objects by number here, in whatever context is then current. Ours go with their context.
        pass

    def _use(self, name: str) -> None:
        if name not in self._programs:
            self._programs[name] = Program(str(_SHADERS / f"{name}.vert"), str(_SHADERS / f"{name}.frag"))
            self._programs[name]._add_to_context()
        self._programs[name]._bind()

    def _shadow_mapping_pass(self, scene: pyrender.Scene, light_node: Any, flags: int) -> None:
        texture = light_node.light.shadow_texture
        self._configure_shadow_framebuffer()
        gl.glBindFramebuffer(gl.GL_FRAMEBUFFER, self._shadow_fb)
        texture._bind()
        gl.glTexParameteri(gl.GL_TEXTURE_2D, gl.GL_TEXTURE_COMPARE_MODE, gl.GL_COMPARE_REF_TO_TEXTURE)
        texture._bind_as_depth_attachment()
        gl.glDrawBuffer(gl.GL_NONE)
        gl.glReadBuffer(gl.GL_NONE)
        gl.glViewport(0, 0, light_node.light.pixels, light_node.light.pixels)
        gl.glEnable(gl.GL_DEPTH_TEST)
        gl.glDepthMask(gl.GL_TRUE)
        gl.glDisable(gl.GL_BLEND)
        # What has left the box of the map towards the light casts its shadow all the same.
        gl.glEnable(gl.GL_DEPTH_CLAMP)
        gl.glClear(gl.GL_DEPTH_BUFFER_BIT)
        for layer in _layers(scene):
            if layer.kind.shadow:
                self._use(f"{layer.kind.name}_shadow")
                self._cull(layer.kind.cull, gl.GL_FRONT)
                layer.draw(layer.count)

    def _forward_pass(self, scene: pyrender.Scene, flags: int, seg_node_map: Any = None) -> np.ndarray:
        self._configure_forward_pass_viewport(flags)
        gl.glEnable(gl.GL_MULTISAMPLE)
        gl.glDisable(gl.GL_DEPTH_CLAMP)
        gl.glClearColor(*scene.bg_color)
        gl.glClear(gl.GL_COLOR_BUFFER_BIT | gl.GL_DEPTH_BUFFER_BIT)
        gl.glBlendFunc(gl.GL_SRC_ALPHA, gl.GL_ONE_MINUS_SRC_ALPHA)
        for light in scene.lights:
            gl.glActiveTexture(gl.GL_TEXTURE0)
            light.shadow_texture._bind()
        for layer in _layers(scene):
            self._use(layer.kind.name)
            self._cull(layer.kind.cull, gl.GL_BACK)
            (gl.glEnable if layer.kind.blend else gl.glDisable)(gl.GL_BLEND)
            gl.glDepthMask(not layer.kind.blend)
            layer.draw(layer.visible)
        return self._read_main_framebuffer(scene, flags)

    @staticmethod
    def _cull(wanted: bool, side: int) -> None:
        (gl.glEnable if wanted else gl.glDisable)(gl.GL_CULL_FACE)
        gl.glCullFace(side)

    def _configure_main_framebuffer(self) -> None:
        if self._main_fb is not None:
            return
        size = self.viewport_width, self.viewport_height
        self._main_cb, self._main_cb_ms, self._main_db_ms = (int(b) for b in gl.glGenRenderbuffers(3))
        self._main_db = 0
        plain, multisampled = (int(f) for f in gl.glGenFramebuffers(2))
        self._main_fb, self._main_fb_ms = plain, multisampled
        self._attach(plain, gl.GL_COLOR_ATTACHMENT0, self._main_cb, gl.GL_RGBA8, 0)
        self._attach(multisampled, gl.GL_COLOR_ATTACHMENT0, self._main_cb_ms, gl.GL_RGBA8, _SAMPLES)
        self._attach(multisampled, gl.GL_DEPTH_ATTACHMENT, self._main_db_ms, gl.GL_DEPTH_COMPONENT24, _SAMPLES)
        if gl.glCheckFramebufferStatus(gl.GL_FRAMEBUFFER) != gl.GL_FRAMEBUFFER_COMPLETE:
            raise ValueError(f"no frame buffer with {_SAMPLES} samples a pixel")
        self._main_fb_dims = size

    def _attach(self, framebuffer: int, point: int, buffer: int, form: int, samples: int) -> None:
        gl.glBindFramebuffer(gl.GL_FRAMEBUFFER, framebuffer)
        gl.glBindRenderbuffer(gl.GL_RENDERBUFFER, buffer)
        gl.glRenderbufferStorageMultisample(
            gl.GL_RENDERBUFFER, samples, form, self.viewport_width, self.viewport_height
        )
        gl.glFramebufferRenderbuffer(gl.GL_FRAMEBUFFER, point, gl.GL_RENDERBUFFER, buffer)

    def _read_main_framebuffer(self, scene: pyrender.Scene, flags: int) -> np.ndarray:
        width, height = self._main_fb_dims
        gl.glBindFramebuffer(gl.GL_READ_FRAMEBUFFER, self._main_fb_ms)
        gl.glBindFramebuffer(gl.GL_DRAW_FRAMEBUFFER, self._main_fb)
        gl.glBlitFramebuffer(0, 0, width, height, 0, 0, width, height, gl.GL_COLOR_BUFFER_BIT, gl.GL_NEAREST)
        gl.glBindFramebuffer(gl.GL_READ_FRAMEBUFFER, self._main_fb)
        gl.glPixelStorei(gl.GL_PACK_ALIGNMENT, 1)
        image = np.empty((height, width, 3), dtype=np.uint8)
        gl.glReadPixels(0, 0, width, height, gl.GL_RGB, gl.GL_UNSIGNED_BYTE, image)
        # OpenGL's first row is the lowest.
        return np.ascontiguousarray(image[::-1])


class Canvas:
    """An off-screen picture of the given layers, drawn in their order. Close it when done."""

    def __init__(self, platform: Platform, size: tuple[int, int], layers: Sequence[Layer], background: np.ndarray):
        self._scene = pyrender.Scene(bg_color=[*background, 1.0])
        self._scene.add(pyrender.Mesh(list(layers)))
        self.shadow_pixels = round(_SHADOW_SHARE * size[1])
        self._scene.add(_KeyLight(self.shadow_pixels))
        # pyrender wants a camera; the one that counts comes with each picture, in the uniform block.
        self._scene.add(pyrender.PerspectiveCamera(yfov=1.0))
        try:
            self._context = _context(platform, size)
            self._context.init_context()
            self._context.make_current()
            self._renderer = _Renderer(*size)
            self.samples = self._sample_points()
        except (AssertionError, OpenGL.error.Error, OSError, ValueError) as error:
            reason = " ".join(str(error).split()) or type(error).__name__
            raise RenderError(f"OpenGL ({platform.renderer}) gives no picture of {size}: {reason}") from error

    def draw(self, view_block: np.ndarray) -> np.ndarray:
        """The picture, (height, width, 3) uint8 sRGB; ``view_block`` is the uniform block of shaders/common.glsl."""
        self._context.make_current()
        self._renderer.view_block = view_block
        return self._renderer.render(self._scene, RenderFlags.OFFSCREEN | RenderFlags.SHADOWS_DIRECTIONAL)

    def close(self) -> None:
        """Give back the context and what it holds. Other canvases live on: the display is shared and stays."""
        self._context.delete_context()

    def _sample_points(self) -> np.ndarray:
        """Where a pixel's samples lie, from its centre [pixels], (4, 2)."""
        self._renderer._configure_main_framebuffer()
        gl.glBindFramebuffer(gl.GL_FRAMEBUFFER, self._renderer._main_fb_ms)
        points = [gl.glGetMultisamplefv(gl.GL_SAMPLE_POSITION, i, np.zeros(2, np.float32)) for i in range(_SAMPLES)]
        return np.array(points, dtype=np.float32) - 0.5


def _layers(scene: pyrender.Scene) -> list[Layer]:
    return [layer for mesh in scene.meshes for layer in mesh.primitives]


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
