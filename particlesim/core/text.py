"""Texts as they fit into a line."""

from __future__ import annotations

# Letters of a value that a message shows: enough to tell which it is.
SHOWN = 60


def shortened(text: str, most: int = SHOWN) -> str:
    """A text cut short where it is longer than so many letters."""
    return text if len(text) <= most else f"{text[: most - 3]}..."
