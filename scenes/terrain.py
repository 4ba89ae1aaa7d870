"""Makes terrain.png: a valley that winds downhill into a hollow, as heights in 16 bits of grey."""

from pathlib import Path

import numpy as np
from PIL import Image

# Squares of the grid along x and y: 2 cm each in the scene.
ALONG, ACROSS = 180, 120


def heights() -> np.ndarray:
    """The heights, (rows, columns) from 0 to 1, the first row at the far end."""
    x, y = np.meshgrid(np.linspace(0.0, 1.0, ALONG + 1), np.linspace(1.0, -1.0, ACROSS + 1))
    middle = 0.35 * np.sin(9.0 * x) * (1.0 - x)
    banks = 0.55 * (y - middle) ** 2
    knolls = 0.035 * np.sin(31.0 * x + 2.0) * np.cos(11.0 * y + 5.0 * x) * (1.0 - x)
    hollow = 0.9 * (1.0 - x) ** 1.3 + 0.12 * np.clip(x - 0.85, 0.0, None) ** 2 / 0.15**2
    ground = hollow + banks + knolls
    return (ground - ground.min()) / np.ptp(ground)


if __name__ == "__main__":
    grey = np.rint(65535.0 * heights()).astype(np.uint16)
    Image.fromarray(grey).save(Path(__file__).with_suffix(".png"), optimize=True)
