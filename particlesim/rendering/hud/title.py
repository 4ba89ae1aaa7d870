"""The title of a scene, on a plate over the opening of its movie."""

from __future__ import annotations

import unicodedata
from collections.abc import Callable

import numpy as np

from particlesim.rendering.hud.panel import Panel, Style

# Height of the letters as a fraction of the picture's shorter side: the first at which the title takes no more than
# _FEW lines, or else the last, with up to _MOST lines; what is beyond is left out.
_TEXTS = (0.055, 0.045, 0.035, 0.026)
_FEW, _MOST = 2, 4

# The plate takes these shares of the picture's width and height at the most; so much of its height is below it.
_WIDTH, _HEIGHT, _BELOW = 0.85, 0.5, 0.06

# Letters of a title that are looked at: more are on no plate.
_LETTERS = 400

_CUT = "..."


class Title:
    """The plate with the title of a movie, for pictures of ``size`` (width, height), ``dark`` or light.

    Letters that no font has are left out; without any there is no plate.
    """

    def __init__(self, text: str, size: tuple[int, int], dark: bool) -> None:
        self._size = size
        self._panel: Panel | None = None
        for height in _TEXTS:
            style = Style(size, dark, height)
            room = round(_WIDTH * size[0]) - 2 * _beside(style)
            lines = wrapped(_writable(text[:_LETTERS], style.can_write), room, style.width)
            if len(lines) <= _FEW:
                break
        if lines:
            most = max(1, min(_MOST, int(_HEIGHT * size[1] / style.line)))
            self._panel = _panel(_cut(lines, most, room, style.width), style)

    def over(self, image: np.ndarray, seen: float) -> np.ndarray:
        """An image (h, w, 3) uint8 with the plate over it, of which so much is ``seen``, 0 .. 1."""
        if self._panel is None or seen <= 0.0:
            return image
        tall, wide = self._panel.size
        laid = image.copy()
        top = self._size[1] - round(_BELOW * self._size[1]) - tall
        self._panel.lay(laid, (self._size[0] - wide) // 2, top, seen)
        return laid


def _writable(text: str, can_write: Callable[[str], bool]) -> str:
    """What of a text there are fonts for; marks go with their letters."""
    kept = [""]
    for letter in unicodedata.normalize("NFC", text):
        is_mark = unicodedata.category(letter)[0] == "M"
        kept.append(letter if letter.isspace() or (kept[-1] if is_mark else can_write(letter)) else "")
    return "".join(kept)


def wrapped(text: str, room: int, width: Callable[[str], int]) -> list[str]:
    """Words in as few lines as ``room`` [pixels] allows, all about as long; a word that is too long is broken."""
    words = text.split()
    if not words:
        return []
    lines = _filled(words, room, width)
    longest = min(room, max(map(width, words)))
    for narrow in np.linspace(longest, room, 20).astype(int).tolist():
        narrower = _filled(words, narrow, width)
        if len(narrower) == len(lines):
            return narrower
    return lines


def _filled(words: list[str], room: int, width: Callable[[str], int]) -> list[str]:
    """Words in lines, as many in each as go into ``room``."""
    lines = [""]
    for word in words:
        longer = f"{lines[-1]} {word}".lstrip()
        if width(longer) <= room:
            lines[-1] = longer
        elif width(word) <= room:
            lines.append(word)
        else:
            lines += _broken(word, room, width)
    return [line for line in lines if line]


def _broken(word: str, room: int, width: Callable[[str], int]) -> list[str]:
    pieces = [""]
    for letter in word:
        if pieces[-1] and width(pieces[-1] + letter) > room:
            pieces.append("")
        pieces[-1] += letter
    return pieces


def _cut(lines: list[str], most: int, room: int, width: Callable[[str], int]) -> list[str]:
    """The first ``most`` lines; the last of them ends in points if there are more."""
    if len(lines) <= most:
        return lines
    last = lines[most - 1]
    while last and width(last + _CUT) > room:
        last = last[:-1]
    return [*lines[: most - 1], last + _CUT]


def _panel(lines: list[str], style: Style) -> Panel:
    widths = [style.width(line) for line in lines]
    above = style.pad // 2
    panel = Panel(style, style.line * len(lines) + 2 * above, max(widths) + 2 * _beside(style))
    for number, (line, width) in enumerate(zip(lines, widths, strict=True)):
        panel.write(line, (panel.size[1] - width) // 2, above + number * style.line)
    return panel


def _beside(style: Style) -> int:
    """From the plate's edges at the left and the right to its letters [pixels]."""
    return 2 * style.pad
