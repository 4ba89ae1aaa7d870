"""From the frames of a trajectory to a movie. Needs no screen; OpenGL is loaded when a Renderer is made, not before."""

from particlesim.rendering.errors import RenderError
from particlesim.rendering.movie import write_image, write_movie
from particlesim.rendering.platform import describe, describe_ffmpeg
from particlesim.rendering.renderer import Renderer

__all__ = ["RenderError", "Renderer", "describe", "describe_ffmpeg", "write_image", "write_movie"]
