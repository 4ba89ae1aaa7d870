"""Pictures without a background: a fourth channel says how much each pixel hides of what they are laid over.

While a picture is made its colours are times that (premultiplied), so that lines, panels and means of pixels come out
right; files have colours as they are.
"""

from __future__ import annotations

import numpy as np

# How bright the floor is where no shadow lies, 0 .. 255: a little below white, for the noise in it.
CLEAR_FLOOR = 253


def cut_out(colours: np.ndarray, ids: np.ndarray) -> np.ndarray:
    """A picture (h, w, 4) uint8 that was drawn for white, without it: of floor and background its shadows are left.

    ``ids`` (h, w): below 0 where no body is seen.
    """
    shadow = np.maximum(CLEAR_FLOOR - colours[..., 0].astype(np.int16), 0)
    cut = np.where((ids < 0)[..., None], np.uint8(0), colours)
    cut[..., 3] = np.where(ids < 0, shadow, 255)
    return cut


def straight(image: np.ndarray) -> np.ndarray:
    """An image (h, w, 4) uint8 as files have it; one without a fourth channel stays."""
    if image.shape[2] == 3:
        return image
    hides = image[..., 3:].astype(np.float32)
    colours = 255.0 * image[..., :3] / np.maximum(hides, 1.0) + 0.5
    return np.dstack([np.minimum(colours, 255.0).astype(np.uint8), image[..., 3]])
