"""Times as people say them."""

from __future__ import annotations


def in_words(seconds: float) -> str:
    """A time as people say it."""
    if seconds < 1.0:
        return "less than a second"
    if seconds < 99.5:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60.0)
    if minutes < 100:
        return f"{minutes} min"
    return f"{minutes // 60} h {minutes % 60:02d} min" if minutes < 6000 else f"{minutes / 1440:,.0f} days"
