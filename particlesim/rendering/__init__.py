"""From the frames of a trajectory to a movie. Needs no screen; OpenGL is loaded when a Renderer is made, not before."""

from typing import TYPE_CHECKING, Any

from particlesim.rendering.errors import RenderError
from particlesim.rendering.gl.platform import describe, describe_ffmpeg
from particlesim.rendering.video.encoder import write_image

if TYPE_CHECKING:
    from particlesim.rendering.renderer import Renderer

__all__ = ["RenderError", "Renderer", "describe", "describe_ffmpeg", "write_image"]


def __getattr__(name: str) -> Any:
    # The renderer brings kernels, and these the compiler: commands that draw nothing need not wait for it.
    if name == "Renderer":
        from particlesim.rendering.renderer import Renderer  # noqa: PLC0415

        return Renderer
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
