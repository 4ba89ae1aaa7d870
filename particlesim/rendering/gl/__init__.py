"""The one place that knows OpenGL."""
