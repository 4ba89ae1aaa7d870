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
_VIEW_BLOCK = 0  # binding point of the uniform block that all programs share


@dataclass(frozen=True)
class Kind:
    """What a layer's instances are: its shaders, the floats of each attribute, and how it meets other layers."""

    name: str
    vertex: tuple[int, ...]  # floats of each vertex attribute, the first three being a place
    instance: tuple[int, ...]  # floats of each instance attribute
    mode: int = gl.GL_TRIANGLES
    casts: bool = False  # drawn into the shadow map, and not into the picture
    cull: int | None = None  # the side of faces that is not drawn
    # How it is laid over what is there, without hiding what comes later: factors of the new and of the old colour.
    blend: tuple[int, int] | None = None


SPHERE = Kind("sphere", (3,), (4, 4), gl.GL_TRIANGLE_STRIP)
HULL = Kind("hull", (3, 3, 4), (4, 4, 4), cull=gl.GL_BACK)
SPHERE_SHADOW = Kind("sphere_shadow", (3,), (4,), gl.GL_TRIANGLE_STRIP, casts=True)
# Of hulls the faces away from the light cast the shadow: rounding then puts none on the faces towards it.
HULL_SHADOW = Kind("hull_shadow", (3,), (4, 4), casts=True, cull=gl.GL_FRONT)
FLOOR = Kind("floor", (3,), (), gl.GL_TRIANGLE_STRIP)
CONTACT = Kind("contact", (3,), (4,), gl.GL_TRIANGLE_STRIP, blend=(gl.GL_ZERO, gl.GL_SRC_COLOR))
LINE = Kind("line", (3,), (4, 3, 4), gl.GL_TRIANGLE_STRIP, blend=(gl.GL_SRC_ALPHA, gl.GL_ONE_MINUS_SRC_ALPHA))


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
        order, none = len(self._order), ctypes.c_void_p(0)
        gl.glDrawElementsInstanced(self.kind.mode, order, gl.GL_UNSIGNED_INT, none, self.count)
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

    def __init__(self, pixels: tuple[int, int]) -> None:
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
            width=self.pixels[0],
            height=self.pixels[1],
        )


class _Renderer(pyrender.Renderer):
    """Draws the layers of a scene: the shadow map, then the picture, ``samples`` by ``samples`` to a pixel."""

    def __init__(self, size: tuple[int, int], samples: int, smooth: bool) -> None:
        super().__init__(samples * size[0], samples * size[1])
        self._size = size
        self._smooth = smooth
        self._programs: dict[str, Program] = {}
        self._block = gl.glGenBuffers(1)
        self.view_block = np.zeros(0, dtype=np.float32)
        self._drawn = _Target(samples * size[0], samples * size[1], depth=True)
        self._final = _Target(*size, depth=False)
        self._nothing = gl.glGenVertexArrays(1)

    def render(self, scene: pyrender.Scene, flags: int, seg_node_map: Any = None) -> np.ndarray:
        block = np.ascontiguousarray(self.view_block)
        gl.glBindBufferBase(gl.GL_UNIFORM_BUFFER, _VIEW_BLOCK, self._block)
        gl.glBufferData(gl.GL_UNIFORM_BUFFER, block.nbytes, block, gl.GL_STREAM_DRAW)
        return super().render(scene, flags, seg_node_map)

    def __del__(self) -> None:
        # pyrender deletes objects by number here, in whatever context is then current. Ours go with their context.
        pass

    def _use(self, vertex: str, fragment: str) -> None:
        if fragment not in self._programs:
            self._programs[fragment] = Program(str(_SHADERS / f"{vertex}.vert"), str(_SHADERS / f"{fragment}.frag"))
            self._programs[fragment]._add_to_context()
        self._programs[fragment]._bind()

    def _shadow_mapping_pass(self, scene: pyrender.Scene, light_node: Any, flags: int) -> None:
        texture = light_node.light.shadow_texture
        self._configure_shadow_framebuffer()
        gl.glBindFramebuffer(gl.GL_FRAMEBUFFER, self._shadow_fb)
        texture._bind()
        gl.glTexParameteri(gl.GL_TEXTURE_2D, gl.GL_TEXTURE_COMPARE_MODE, gl.GL_COMPARE_REF_TO_TEXTURE)
        texture._bind_as_depth_attachment()
        gl.glDrawBuffer(gl.GL_NONE)
        gl.glReadBuffer(gl.GL_NONE)
        gl.glViewport(0, 0, *light_node.light.pixels)
        gl.glEnable(gl.GL_DEPTH_TEST)
        gl.glDepthMask(gl.GL_TRUE)
        # What has left the box of the map towards the light casts its shadow all the same.
        gl.glEnable(gl.GL_DEPTH_CLAMP)
        gl.glClear(gl.GL_DEPTH_BUFFER_BIT)
        self._draw_layers(scene, casts=True)

    def _forward_pass(self, scene: pyrender.Scene, flags: int, seg_node_map: Any = None) -> np.ndarray:
        gl.glBindFramebuffer(gl.GL_FRAMEBUFFER, self._drawn.framebuffer)
        gl.glViewport(0, 0, self.viewport_width, self.viewport_height)
        gl.glEnable(gl.GL_DEPTH_TEST)
        gl.glDepthMask(gl.GL_TRUE)
        gl.glDisable(gl.GL_DEPTH_CLAMP)
        gl.glClearColor(*scene.bg_color)
        gl.glClear(gl.GL_COLOR_BUFFER_BIT | gl.GL_DEPTH_BUFFER_BIT)
        for light in scene.lights:
            gl.glActiveTexture(gl.GL_TEXTURE0)
            light.shadow_texture._bind()
        self._draw_layers(scene, casts=False)
        return self._read_main_framebuffer(scene, flags)

    def _draw_layers(self, scene: pyrender.Scene, casts: bool) -> None:
        for layer in (layer for mesh in scene.meshes for layer in mesh.primitives if layer.kind.casts == casts):
            kind = layer.kind
            self._use(kind.name, kind.name)
            (gl.glDisable if kind.cull is None else gl.glEnable)(gl.GL_CULL_FACE)
            gl.glCullFace(kind.cull or gl.GL_BACK)
            (gl.glEnable if kind.blend else gl.glDisable)(gl.GL_BLEND)
            gl.glDepthMask(not kind.blend)
            if kind.blend:
                gl.glBlendFunc(*kind.blend)
            layer.draw()

    def _read_main_framebuffer(self, scene: pyrender.Scene, flags: int) -> np.ndarray:
        width, height = self._size
        if self._smooth:
            self._smooth_edges()
        else:
            gl.glBindFramebuffer(gl.GL_READ_FRAMEBUFFER, self._drawn.framebuffer)
            gl.glBindFramebuffer(gl.GL_DRAW_FRAMEBUFFER, self._final.framebuffer)
            # Upside down, as OpenGL's first row is the lowest. At two samples a side this is an exact mean.
            whole = 0, 0, self.viewport_width, self.viewport_height
            gl.glBlitFramebuffer(*whole, 0, height, width, 0, gl.GL_COLOR_BUFFER_BIT, gl.GL_LINEAR)
        gl.glBindFramebuffer(gl.GL_READ_FRAMEBUFFER, self._final.framebuffer)
        gl.glPixelStorei(gl.GL_PACK_ALIGNMENT, 4)
        # Four bytes a pixel as they are stored: OpenGL takes longer to leave one out than numpy.
        image = np.empty((height, width, 4), dtype=np.uint8)
        gl.glReadPixels(0, 0, width, height, gl.GL_RGBA, gl.GL_UNSIGNED_BYTE, image)
        return np.ascontiguousarray(image[..., :3])

    def _smooth_edges(self) -> None:
        gl.glBindFramebuffer(gl.GL_FRAMEBUFFER, self._final.framebuffer)
        gl.glViewport(0, 0, *self._size)
        for switch in (gl.GL_DEPTH_TEST, gl.GL_BLEND, gl.GL_CULL_FACE):
            gl.glDisable(switch)
        gl.glActiveTexture(gl.GL_TEXTURE0)
        gl.glBindTexture(gl.GL_TEXTURE_2D, self._drawn.colour)
        self._use("whole", "smooth")
        gl.glBindVertexArray(self._nothing)
        gl.glDrawArrays(gl.GL_TRIANGLES, 0, 3)
        gl.glBindVertexArray(0)


class _Target:
    """A frame buffer whose colours, 8 bits a channel, can be read as a texture."""

    def __init__(self, width: int, height: int, depth: bool) -> None:
        self.framebuffer = gl.glGenFramebuffers(1)
        self.colour = gl.glGenTextures(1)
        gl.glBindTexture(gl.GL_TEXTURE_2D, self.colour)
        gl.glTexImage2D(
            gl.GL_TEXTURE_2D, 0, gl.GL_RGBA8, width, height, 0, gl.GL_RGBA, gl.GL_UNSIGNED_BYTE, ctypes.c_void_p(0)
        )
        gl.glTexParameteri(gl.GL_TEXTURE_2D, gl.GL_TEXTURE_MIN_FILTER, gl.GL_LINEAR)
        gl.glTexParameteri(gl.GL_TEXTURE_2D, gl.GL_TEXTURE_WRAP_S, gl.GL_CLAMP_TO_EDGE)
        gl.glTexParameteri(gl.GL_TEXTURE_2D, gl.GL_TEXTURE_WRAP_T, gl.GL_CLAMP_TO_EDGE)
        gl.glBindFramebuffer(gl.GL_FRAMEBUFFER, self.framebuffer)
        gl.glFramebufferTexture2D(
            gl.GL_FRAMEBUFFER, gl.GL_COLOR_ATTACHMENT0, gl.GL_TEXTURE_2D, self.colour, 0
        )
        if depth:
            buffer = gl.glGenRenderbuffers(1)
            gl.glBindRenderbuffer(gl.GL_RENDERBUFFER, buffer)
            gl.glRenderbufferStorage(gl.GL_RENDERBUFFER, gl.GL_DEPTH_COMPONENT24, width, height)
            gl.glFramebufferRenderbuffer(gl.GL_FRAMEBUFFER, gl.GL_DEPTH_ATTACHMENT, gl.GL_RENDERBUFFER, buffer)
        if gl.glCheckFramebufferStatus(gl.GL_FRAMEBUFFER) != gl.GL_FRAMEBUFFER_COMPLETE:
            raise ValueError(f"no frame buffer of {width} x {height} pixels")


class Canvas:
    """An off-screen picture of the given layers, drawn in their order. Close it when done.

    ``samples``: squares a side that each pixel is the mean of, 1 or 2; ``smooth``: whether jagged edges of a picture
    without such samples are found and smoothed; ``shadow_pixels``: width and height of the shadow map.
    """

    def __init__(
        self,
        platform: Platform,
        size: tuple[int, int],
        layers: Sequence[Layer],
        background: np.ndarray,
        *,
        samples: int = 1,
        smooth: bool = True,
        shadow_pixels: tuple[int, int] = (1024, 1024),
    ) -> None:
        self._scene = pyrender.Scene(bg_color=[*background, 1.0])
        self._scene.add(pyrender.Mesh(list(layers)))
        self._scene.add(_KeyLight(shadow_pixels))
        # pyrender wants a camera; the one that counts comes with each picture, in the uniform block.
        self._scene.add(pyrender.PerspectiveCamera(yfov=1.0))
        try:
            self._context = _context(platform, size)
            self._context.init_context()
            self._context.make_current()
            self._renderer = _Renderer(size, samples, smooth)
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
