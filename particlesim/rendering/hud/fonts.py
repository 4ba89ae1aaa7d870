"""Fonts for all letters: Pillow's own, and for what it lacks those that the machine has."""

from __future__ import annotations

import functools
import unicodedata
from typing import cast

from PIL import ImageFont

# A code point that stands for no letter: fonts draw it as they draw what they lack.
_NO_LETTER = "\U0010ffff"


class Fonts:
    """Fonts with letters ``em`` pixels high; ``usual``: the one of all texts, as far as it goes."""

    def __init__(self, em: float) -> None:
        # With a size it is one that can be scaled.
        self.usual = cast("ImageFont.FreeTypeFont", ImageFont.load_default(size=em))
        self._em = em
        self.of = functools.cache(self._find)

    def _find(self, letter: str) -> ImageFont.FreeTypeFont | None:
        """The first font that has a letter, None if there is none on this machine."""
        if _has(self.usual, letter):
            return self.usual
        for file in _files():
            try:
                font = ImageFont.truetype(file, self._em)
            except OSError:  # of a kind that cannot be scaled, or damaged
                continue
            if _has(font, letter):
                return font
        return None


def letters_of(text: str) -> list[str]:
    """What is to be drawn of a text: its letters, with their accents, without marks that only say how."""
    return [letter for letter in unicodedata.normalize("NFC", text) if unicodedata.category(letter) not in ("Cf", "Mn")]


def _has(font: ImageFont.FreeTypeFont, letter: str) -> bool:
    drawn, lacking = font.getmask(letter), font.getmask(_NO_LETTER)
    return letter.isspace() or (drawn.size, bytes(drawn)) != (lacking.size, bytes(lacking))


@functools.cache
def _files() -> list[str]:
    """Files of fonts: one that is always there, with many alphabets and signs, and those of the system."""
    from matplotlib import font_manager, get_data_path  # noqa: PLC0415  (slow to import, and seldom asked for)

    return [f"{get_data_path()}/fonts/ttf/DejaVuSans.ttf", *sorted(font_manager.findSystemFonts())]
