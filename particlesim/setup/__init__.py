"""From a scene to a model: where particles start and how."""
