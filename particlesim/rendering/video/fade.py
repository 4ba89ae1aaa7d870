"""The opening and the close of a movie: out of its background and into it."""

from __future__ import annotations

import numpy as np


def strength(number: int, total: int, frames: float) -> float:
    """How much of picture ``number`` of ``total`` is seen, 0 .. 1, if the fades at both ends take ``frames`` pictures.

    The first and the last are all background.
    """
    if frames <= 0.0:
        return 1.0
    return _smooth(min(1.0, number / frames, (total - 1 - number) / frames))


def title_strength(number: int, total: int, fps: float) -> float:
    """How much of the title is seen over picture ``number`` of ``total``, 0 .. 1.

    It goes within three seconds, or the first quarter of a shorter movie: in the last third of that time.
    """
    pictures = min(3.0 * fps, total // 4)
    return _smooth(min(1.0, 3.0 * (pictures - number) / pictures)) if number < pictures else 0.0


def _smooth(share: float) -> float:
    """From 0 to 1 without a jerk where it begins and ends."""
    return share * share * (3.0 - 2.0 * share)


def faded(image: np.ndarray, seen: float, background: np.ndarray) -> np.ndarray:
    """An image (h, w, 3) uint8 of which so much is seen, 0 .. 1, before ``background`` (3,) sRGB 0 .. 1.

    Of four channels (see transparency.py) each has its own background.
    """
    if seen >= 1.0:
        return image
    blend = seen * image + (1.0 - seen) * 255.0 * background
    return (blend + 0.5).astype(np.uint8)
