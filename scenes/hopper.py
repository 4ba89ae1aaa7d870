"""Makes hopper.stl: a round funnel above a pipe, open at both ends, in millimetres."""

from pathlib import Path

import numpy as np
import trimesh

# Radius and height of each ring, from the rim to the orifice [mm]; and how many sides it has.
RINGS = ((500.0, 900.0), (500.0, 500.0), (170.0, 40.0), (170.0, -40.0))
SIDES = 48


def hopper() -> trimesh.Trimesh:
    """The funnel, without a thickness."""
    angle = 2.0 * np.pi * np.arange(SIDES) / SIDES
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points = np.concatenate([np.column_stack([radius * circle, np.full(SIDES, height)]) for radius, height in RINGS])
    upper = np.arange((len(RINGS) - 1) * SIDES)
    after = upper // SIDES * SIDES + (upper + 1) % SIDES
    lower, lower_after = upper + SIDES, after + SIDES
    faces = np.concatenate([np.stack([upper, lower, after], axis=1), np.stack([after, lower, lower_after], axis=1)])
    return trimesh.Trimesh(points, faces, process=False)


if __name__ == "__main__":
    hopper().export(Path(__file__).with_suffix(".stl"))
