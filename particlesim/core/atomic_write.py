"""Files that appear whole or not at all."""

from __future__ import annotations

import contextlib
import errno
import os
import secrets
from collections.abc import Iterator
from pathlib import Path

# Letters of a file's name that its hidden file has too: enough to tell whose it is, few enough for any file system.
_TOLD = 40

# Errors that say that the file does not fit where it is to go: the system does not name it.
FULL = errno.ENOSPC, errno.EDQUOT, errno.EFBIG


@contextlib.contextmanager
def atomic_write(path: str | Path) -> Iterator[Path]:
    """A hidden file beside ``path`` to write to: it becomes ``path`` at the end, or is removed if anything fails.

    Its name is its own: of several that write to the same path at once, in one process or in many, the last one wins.
    FileNotFoundError if the folder does not exist.
    """
    path = Path(path)
    if not path.parent.is_dir():
        raise FileNotFoundError(f"{path}: there is no folder {path.parent}")
    hidden = path.with_name(f".{path.stem[:_TOLD]}.{secrets.token_hex(8)}{path.suffix}")
    try:
        yield hidden
        os.replace(hidden, path)
    except OSError as error:
        named(error, path)
        raise
    finally:
        hidden.unlink(missing_ok=True)


def named(error: OSError, path: Path) -> None:
    """Let an error that says that a file does not fit where it is to go name the file that was wanted."""
    if error.errno in FULL:
        error.filename = str(path)
