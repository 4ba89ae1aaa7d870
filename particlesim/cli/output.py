"""Where the result of a command goes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from particlesim.core.output_path import check_output, check_place


@contextmanager
def place_for(path: Path | None, source: Path, *suffixes: str, beside: Sequence[str] = ()) -> Iterator[Path]:
    """Where the result goes: as told, or to renders/ under the name of the source, with the first of ``suffixes``.

    A wrong place is found out before the work, not after it (see ``check_output``); renders/ does not stay behind if
    nothing comes of it.
    """
    if path is not None:
        check_place(path)
        path = path if path.suffix else path.with_suffix(suffixes[0])
        check_output(path, *suffixes, beside=beside)
        yield path
        return
    folder = Path("renders")
    path = folder / f"{source.stem}{suffixes[0]}"
    is_new = not folder.exists()
    folder.mkdir(exist_ok=True)
    try:
        check_output(path, *suffixes, beside=beside)
        yield path
    except BaseException:
        if is_new and not any(folder.iterdir()):
            folder.rmdir()
        raise
