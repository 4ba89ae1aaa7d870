"""From the frames of a trajectory to a movie. Needs no screen; OpenGL is loaded when a Renderer is made, not before."""

from particlesim.render.errors import RenderError
from particlesim.render.movie import write_image, write_movie
from particlesim.render.platform import describe, describe_ffmpeg
from particlesim.render.renderer import Renderer

__all__ = ["RenderError", "Renderer", "describe", "describe_ffmpeg", "write_image", "write_movie"]
