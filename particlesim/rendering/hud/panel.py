"""Panels in the corners of a picture: a plate that keeps text legible whatever is behind it, letters and patches."""

from __future__ import annotations

import functools
import math

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from particlesim.rendering.hud.fonts import Fonts, letters_of

# Plate, strong text and faint text in sRGB, for pictures with a dark background and with a light one. The plate lets a
# little of the picture through.
_DARK = np.array([[22.0, 25.0, 29.0], [245.0, 245.0, 242.0], [176.0, 180.0, 184.0]], dtype=np.float32)
_LIGHT = np.array([[252.0, 252.0, 250.0], [24.0, 27.0, 31.0], [96.0, 100.0, 104.0]], dtype=np.float32)
_OPACITY = 0.88

# Height of letters as a fraction of the picture's shorter side, and the least [pixels]; in a small picture they are
# smaller, up to a larger fraction of it, but not so small that they run together.
_TEXT, _LARGEST_TEXT = 0.026, 0.05
_SMALL, _SMALLEST = 12.0, 8.0

# Texts whose ink is kept: names stay from picture to picture, and so do most values.
_REMEMBERED = 256


class Style:
    """Letters and colours of the panels of one movie, for pictures of ``size`` (width, height), ``dark`` or light.

    ``text``: height of the letters as a fraction of the picture's shorter side, where that is enough to be read.
    """

    def __init__(self, size: tuple[int, int], dark: bool, text: float = _TEXT) -> None:
        side = min(size)
        least = max(_SMALLEST, min(_SMALL, _LARGEST_TEXT * side))
        self.em = max(least, text * side)  # height of the letters [pixels]
        self.plate, self.strong, self.faint = _DARK if dark else _LIGHT
        self._fonts = Fonts(self.em)
        self._glyph = functools.cache(self._draw_glyph)
        self.ink = functools.lru_cache(_REMEMBERED)(self._draw_text)

    @property
    def margin(self) -> int:
        """Distance of panels from the edges and from each other [pixels]."""
        return round(0.9 * self.em)

    @property
    def pad(self) -> int:
        """Distance of what is on a panel from its edges [pixels]."""
        return round(0.7 * self.em)

    @property
    def line(self) -> int:
        """From one line of text to the next [pixels]."""
        return round(1.45 * self.em)

    def width(self, text: str) -> int:
        """How wide text is [pixels]."""
        joining = self._fonts.joining(text)
        if joining is not None:
            return math.ceil(joining.getlength(text))
        return sum(self._glyph(letter)[1] for letter in letters_of(text))

    def can_write(self, text: str) -> bool:
        """Whether there are fonts for all letters of a text."""
        return all(self._fonts.of(letter) for letter in letters_of(text))

    def _draw_text(self, text: str) -> np.ndarray:
        """How much ink text leaves, (h, w) float32 0 .. 1."""
        joining = self._fonts.joining(text)
        if joining is not None:
            return self._drawn(text, joining, self.width(text))
        glyphs = [self._glyph(letter) for letter in letters_of(text)]
        tall, wide = (max((mask.shape[axis] for mask, _ in glyphs), default=0) for axis in (0, 1))
        ink, left = np.zeros((tall, self.width(text) + wide), dtype=np.float32), 0
        for mask, advance in glyphs:
            room = ink[:, left : left + mask.shape[1]]
            np.maximum(room, mask, out=room)
            left += advance
        return ink

    def _draw_glyph(self, letter: str) -> tuple[np.ndarray, int]:
        """How much ink a letter leaves, (h, w) float32 0 .. 1, and how far the next one stands [pixels]."""
        # Whole pixels, and one width for all figures: a number changes in place, nothing else moves.
        usual = self._fonts.usual
        font = self._fonts.of(letter) or usual
        advance = round(font.getlength("0" if letter.isdecimal() else letter))
        return self._drawn(letter, font, advance), advance

    def _drawn(self, text: str, font: ImageFont.FreeTypeFont, width: int) -> np.ndarray:
        """The ink of text of one font, (h, w) float32 0 .. 1."""
        tile = Image.new("L", (width + round(0.3 * self.em), round(1.4 * self.em)))
        # All fonts stand on the line of the usual one.
        above = self._fonts.usual.getmetrics()[0]
        ImageDraw.Draw(tile).text((0, above), text, fill=255, font=font, anchor="ls")
        return np.asarray(tile, dtype=np.float32) / 255.0


class Panel:
    """A plate (height, width) [pixels] with text and patches on it, to be laid over pictures."""

    def __init__(self, style: Style, height: int, width: int) -> None:
        self._style = style
        self._colour = np.tile(style.plate, (height, width, 1))
        self._opacity = np.full((height, width, 1), _OPACITY, dtype=np.float32)

    @property
    def size(self) -> tuple[int, int]:
        """Height and width [pixels]."""
        height, width = self._colour.shape[:2]
        return height, width

    def write(self, text: str, left: int, top: int, *, faint: bool = False) -> None:
        """Put text on it; ``left`` and ``top`` [pixels] from its upper left corner."""
        style = self._style
        self.stain(style.ink(text), style.faint if faint else style.strong, left, top)

    def stain(self, ink: np.ndarray, colour: np.ndarray, left: int, top: int) -> None:
        """Put ink (h, w) 0 .. 1 of an sRGB colour (3,) 0 .. 255 on it, as far as that goes."""
        height, width = self.size
        seen = ink[: height - top, max(-left, 0) : width - left, None]
        left = max(left, 0)
        area = slice(top, top + seen.shape[0]), slice(left, left + seen.shape[1])
        below, opacity = self._colour[area], self._opacity[area]
        below += seen * (colour - below)
        np.maximum(opacity, seen, out=opacity)

    def fill(self, colour: np.ndarray, left: int, top: int) -> None:
        """Put a patch of sRGB colours (h, w, 3) 0 .. 255 on it, which lets nothing through."""
        height, width = colour.shape[:2]
        self._colour[top : top + height, left : left + width] = colour
        self._opacity[top : top + height, left : left + width] = 1.0

    def lay(self, image: np.ndarray, left: int, top: int, seen: float = 1.0) -> None:
        """Lay it over a picture (h, w, 3 or 4) uint8, as far as that goes; so much of it is ``seen``, 0 .. 1."""
        below = image[top : top + self._colour.shape[0], left : left + self._colour.shape[1]]
        height, width = below.shape[:2]
        opacity = seen * self._opacity[:height, :width]
        colour = self._colour[:height, :width]
        if image.shape[2] == 4:
            colour = np.dstack([colour, np.full((height, width), 255.0, dtype=np.float32)])
        below[:] = (below + opacity * (colour - below) + 0.5).astype(np.uint8)
