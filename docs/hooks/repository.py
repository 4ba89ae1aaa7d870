"""Files of the repository as part of the site: README.md is its first page, and links lead where they lead there."""

from __future__ import annotations

import re
from pathlib import Path
from posixpath import dirname, join, normpath, relpath
from typing import Any

from mkdocs.structure.files import File

_ROOT = Path(__file__).parents[2]
_PAGES = {"README.md": "index.md", "CONTRIBUTING.md": "CONTRIBUTING.md", "CHANGELOG.md": "CHANGELOG.md"}
_FILES = (
    *("LICENSE", "CITATION.cff", "scenes/*.toml", "scenes/sweeps/*.toml"),
    *("renders/*.mp4", "renders/*.png", "renders/*.svg"),
)
_LINK = re.compile(r"(?<=\]\()(?![a-z]+:|#)([^)#\s]+)")


def on_files(files: Any, *, config: Any) -> Any:
    """Add what lies outside of docs/."""
    for name, page in _PAGES.items():
        files.append(File.generated(config, page, content=(_ROOT / name).read_text()))
    for path in (path for pattern in _FILES for path in sorted(_ROOT.glob(pattern))):
        name = path.relative_to(_ROOT).as_posix()
        files.append(File.generated(config, name, abs_src_path=str(path)))
    return files


def on_page_markdown(markdown: str, *, page: Any, **_: Any) -> str:
    """Have links lead to where a file of the repository is in the site."""
    here = page.file.src_uri
    outside = {site: name for name, site in _PAGES.items()}
    folder = dirname(outside.get(here, f"docs/{here}"))

    def moved(link: re.Match[str]) -> str:
        target = normpath(join(folder, link[1]))
        return relpath(_PAGES.get(target, target.removeprefix("docs/")), dirname(here) or ".")

    return _LINK.sub(moved, markdown)
