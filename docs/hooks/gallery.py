"""All scenes with their pictures: a line ``{{ gallery }}`` on a page becomes a section for each file in scenes/.

    python docs/hooks/gallery.py        # draws the pictures that are not there yet

A scene whose movie is in renders/ is shown with that movie's poster, and leads to it.
"""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import particlesim as ps

_ROOT = Path(__file__).parents[2]
_SCENES = sorted((_ROOT / "scenes").glob("*.toml"))
_PICTURES = _ROOT / "docs" / "pictures"

# When a picture is taken, as a part of the scene's duration.
_MOMENT = 0.4


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Put the gallery in the place of the line that asks for it."""
    return re.sub(r"^\{\{ gallery \}\}$", lambda _: _gallery(), markdown, flags=re.MULTILINE)


def _gallery() -> str:
    return "\n\n".join(_section(path) for path in _SCENES)


def _section(path: Path) -> str:
    text = path.read_text()
    said = " ".join(line.removeprefix("#").strip() for line in re.match(r"(#.*\n)*", text)[0].splitlines())
    indented = text.replace("\n", "\n    ").rstrip()
    return f"""## {tomllib.loads(text)["title"]} {{ #{path.stem} }}

{_picture(path.stem)}

{said}

```sh
particlesim render scenes/{path.stem}.toml
```

??? note "[`scenes/{path.stem}.toml`](../scenes/{path.stem}.toml)"
    ```toml
    {indented}
    ```"""


def _picture(name: str) -> str:
    """The picture of a scene, which leads to its movie if there is one that is kept."""
    if (_ROOT / "renders" / f"{name}.mp4").exists() and (_ROOT / "renders" / f"{name}.png").exists():
        return f"[![{name}](../renders/{name}.png){{ width=640 }}](../renders/{name}.mp4)"
    return f"![{name}](pictures/{name}.png)"


def draw() -> None:
    """Draw the pictures of scenes that have none."""
    for path in _SCENES:
        picture = _PICTURES / f"{path.stem}.png"
        if "pictures/" in _picture(path.stem) and not picture.exists():
            scene = ps.load_scene(path)
            scene.movie.resolution = 640, 360
            ps.still(scene, picture, time=_MOMENT * scene.duration)
            print(picture)


if __name__ == "__main__":
    draw()
