"""Fonts for all letters: Pillow's own, and for what it lacks those that the machine has."""

from __future__ import annotations

import contextlib
import functools
import unicodedata
from collections.abc import Iterator
from typing import cast

from PIL import ImageFont

# A code point that stands for no letter: fonts draw it as they draw what they lack.
_NO_LETTER = "\U0010ffff"

# Texts whose font is kept.
_REMEMBERED = 256


class Fonts:
    """Fonts with letters ``em`` pixels high; ``usual``: the one of all texts, as far as it goes."""

    def __init__(self, em: float) -> None:
        # With a size it is one that can be scaled.
        self.usual = cast("ImageFont.FreeTypeFont", ImageFont.load_default(size=em))
        self._em = em
        self.of = functools.cache(self._find)
        self.joining = functools.lru_cache(_REMEMBERED)(self._find_joining)

    def _find(self, letters: str) -> ImageFont.FreeTypeFont | None:
        """The first font that has all of some letters, None if there is none on this machine."""
        return next((font for font in self._every() if all(_has(font, letter) for letter in letters)), None)

    def _find_joining(self, text: str) -> ImageFont.FreeTypeFont | None:
        """The font for a text that goes from right to left, or whose letters join or bear marks.

        None for any other, whose letters stand one by one, or if no font has all of its letters.
        """
        joined = not text.isascii() and any(_joins(letter) for letter in unicodedata.normalize("NFC", text))
        return self._find(text) if joined else None

    def _every(self) -> Iterator[ImageFont.FreeTypeFont]:
        """All fonts, the usual one first."""
        yield self.usual
        for file in _files():
            with contextlib.suppress(OSError):  # of a kind that cannot be scaled, or damaged
                yield ImageFont.truetype(file, self._em)


def letters_of(text: str) -> list[str]:
    """What is to be drawn of a text: its letters, with their accents, without marks that only say how."""
    return [letter for letter in unicodedata.normalize("NFC", text) if unicodedata.category(letter) not in ("Cf", "Mn")]


def _joins(letter: str) -> bool:
    return unicodedata.bidirectional(letter) in ("R", "AL") or unicodedata.category(letter) in ("Mn", "Mc")


def _has(font: ImageFont.FreeTypeFont, letter: str) -> bool:
    drawn, lacking = font.getmask(letter), font.getmask(_NO_LETTER)
    return letter.isspace() or (drawn.size, bytes(drawn)) != (lacking.size, bytes(lacking))


@functools.cache
def _files() -> list[str]:
    """Files of fonts: one that is always there, with many alphabets and signs, and those of the system."""
    from matplotlib import font_manager, get_data_path  # noqa: PLC0415  (slow to import, and seldom asked for)

    return [f"{get_data_path()}/fonts/ttf/DejaVuSans.ttf", *sorted(font_manager.findSystemFonts())]
