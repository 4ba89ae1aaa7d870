"""The readout in the corner: time, particles, impacts and how much the energy has changed."""

from __future__ import annotations

import functools

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from particlesim.trajectory import Frame

_ENERGIES = ("kinetic_translational", "kinetic_rotational", "potential")

# Panel, text of the values and of their names in sRGB, for pictures with a dark background and with a light one. The
# panel lets a little of the picture through and keeps the text legible whatever that is.
_DARK = np.array([[22.0, 25.0, 29.0], [245.0, 245.0, 242.0], [176.0, 180.0, 184.0]])
_LIGHT = np.array([[252.0, 252.0, 250.0], [24.0, 27.0, 31.0], [96.0, 100.0, 104.0]])
_OPACITY = 0.82

# Heights in fractions of the picture's shorter side.
_TEXT = 0.026
_SMALLEST = 9.0  # [pixels], below which letters run together


class Readout:
    """A panel for pictures of one size (width, height), ``dark`` or light. Letters are drawn once and kept."""

    def __init__(self, size: tuple[int, int], dark: bool) -> None:
        self._panel, self._ink, self._faint = _DARK if dark else _LIGHT
        self._text = max(_SMALLEST, _TEXT * min(size))
        self._font = ImageFont.load_default(size=self._text)
        self._glyph = functools.cache(self._draw_glyph)

    def draw(self, image: np.ndarray, frame: Frame, first: Frame) -> None:
        """Draw the panel for ``frame`` into ``image`` (h, w, 3) uint8, energy compared with that of ``first``."""
        rows = readout_rows(frame, first)
        em = self._text
        label, figure, line = round(6.4 * em), round(5.2 * em), round(1.45 * em)
        margin, pad = round(0.9 * em), round(0.7 * em)
        height, width = line * len(rows) + 2 * pad, label + figure + 2 * pad
        panel = image[margin : margin + height, margin : margin + width]
        height, width = panel.shape[:2]
        ink = np.zeros((2, line * len(rows) + 2 * pad, label + figure + 2 * pad))
        for number, (name, value) in enumerate(rows):
            top = pad + number * line
            self._write(ink[0], name, pad, top)
            self._write(ink[1], value, pad + label + figure - self._width(value), top)
        faint, full = ink[:, :height, :width, None]
        colour = (1.0 - _OPACITY) * panel + _OPACITY * self._panel
        colour += faint * (self._faint - colour)
        colour += full * (self._ink - colour)
        panel[:] = np.clip(colour + 0.5, 0.0, 255.0).astype(np.uint8)

    def _width(self, text: str) -> int:
        return sum(self._glyph(letter)[1] for letter in text)

    def _write(self, ink: np.ndarray, text: str, x: int, y: int) -> None:
        for letter in text:
            mask, advance = self._glyph(letter)
            room = ink[y : y + mask.shape[0], x : x + mask.shape[1]]
            np.maximum(room, mask[: room.shape[0], : room.shape[1]], out=room)
            x += advance

    def _draw_glyph(self, letter: str) -> tuple[np.ndarray, int]:
        """How much ink a letter leaves, (h, w) 0 .. 1, and how far the next one stands [pixels]."""
        # Whole pixels, and one width for all figures: a number changes in place, nothing else moves.
        advance = round(self._font.getlength("0" if letter.isdigit() else letter))
        tile = Image.new("L", (advance + round(0.3 * self._text), round(1.4 * self._text)))
        ImageDraw.Draw(tile).text((0, 0), letter, fill=255, font=self._font)
        return np.asarray(tile, dtype=np.float64) / 255.0, advance


def readout_rows(frame: Frame, first: Frame) -> list[tuple[str, str]]:
    """Name and value of each line; what the ledger does not tell is left out."""
    rows = [("time", f"{frame.time:.2f} s"), ("particles", _grouped(len(frame.position)))]
    if "impacts" in frame.ledger:
        rows.append(("impacts", _grouped(round(frame.ledger["impacts"]))))
    if any(key in frame.ledger for key in _ENERGIES):
        rows.append(("energy change", _change_text(energy_change(frame, first))))
    return rows


def energy_change(frame: Frame, first: Frame) -> float:
    """Change of the total energy since ``first``, relative to the kinetic energy and depth of potential there."""
    now, then = ([f.ledger.get(key, 0.0) for key in _ENERGIES] for f in (frame, first))
    scale = sum(abs(part) for part in then) or sum(abs(part) for part in now)
    return (sum(now) - sum(then)) / scale if scale else 0.0


def _grouped(number: int) -> str:
    return f"{number:,}"


def _change_text(change: float) -> str:
    if change == 0.0:
        return "0"
    # With the hyphen for a minus sign: the font has no other in every version of its library.
    return f"{100.0 * change:+.1f} %" if abs(change) >= 1e-3 else f"{change:+.0e}"
