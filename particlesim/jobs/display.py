"""Results as notebooks show them: movies that play where they are, pictures, and a line for what is too large."""

from __future__ import annotations

import base64
import html
from pathlib import Path

# Movies up to this size are put into the notebook [bytes]; larger ones would make it slow to open and to save.
EMBEDDED = 20_000_000

_KINDS = {".mp4": "video/mp4", ".webm": "video/webm", ".gif": "image/gif"}


def html_of(path: Path, caption: str) -> str | None:
    """A movie as HTML, with what it contains if it is small enough, and a caption; None for another file, or none."""
    kind = _KINDS.get(path.suffix.lower())
    if kind is None or not path.is_file():
        return None
    below = f"<figcaption>{html.escape(caption)}</figcaption>"
    if path.stat().st_size > EMBEDDED:
        size = f"{path.stat().st_size / 1e6:,.0f} MB, more than a notebook should hold"
        return f"<figure><p>{html.escape(str(path))}: {size}</p>{below}</figure>"
    data = base64.b64encode(path.read_bytes()).decode()
    shown = f'style="max-width: 100%" src="data:{kind};base64,{data}"'
    movie = f"<img {shown}>" if kind == "image/gif" else f"<video controls loop muted playsinline {shown}></video>"
    return f"<figure>{movie}{below}</figure>"


def png_of(path: Path) -> bytes | None:
    """A picture, or the poster of a movie, as it is in its file; None for another file, or none."""
    picture = path.with_suffix(".png") if path.suffix.lower() in _KINDS else path
    return picture.read_bytes() if picture.suffix.lower() == ".png" and picture.is_file() else None
