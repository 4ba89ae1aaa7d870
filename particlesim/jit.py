"""The one decorator under which every kernel is compiled, and the cache in which the result is kept.

Numba's on-disk cache notices a change in the file of a kernel but not in the files of the kernels that it calls.
The cache folder is therefore named after a digest of all kernel sources: a stale kernel cannot be run, and a
package installed read-only still has a cache.
"""

from __future__ import annotations

import getpass
import hashlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
from numba.core import cgutils, types
from numba.core.imputils import impl_ret_untracked
from numba.extending import intrinsic
from numba.np.arrayobj import make_array

_PACKAGE = Path(__file__).parent


def _source_digest() -> str:
    digest = hashlib.sha256()
    for path in sorted(_PACKAGE.rglob("*.py")):
        source = path.read_bytes()
        if b"@kernel" in source or path.name in ("constants.py", "jit.py"):
            digest.update(source)
    return digest.hexdigest()[:16]


def _cache_folder() -> str:
    """The folder for compiled kernels: NUMBA_CACHE_DIR if set, else the user's cache, else a temporary folder."""
    base = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    folder = Path(base) / "particlesim" / f"kernels-{_source_digest()}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError:
        folder = Path(tempfile.gettempdir()) / f"particlesim-{getpass.getuser()}-{folder.name}"
        folder.mkdir(parents=True, exist_ok=True)
    return str(folder)


CACHE_FOLDER = _cache_folder()


def kernel(function: Callable[..., Any] | None = None, *, inline: bool = False) -> Any:
    """Compile ``function`` for the machine: cached on disk, without the GIL, IEEE arithmetic (no fastmath).

    ``inline=True`` writes it into its callers.  It is for what runs once an item and takes the structs of arrays:
    handing these over counts references to some thirty arrays, which takes longer than moving a particle.
    """
    if function is None:
        return lambda wrapped: kernel(wrapped, inline=inline)
    # The place of a function's cache is settled when it is decorated; other users of numba keep theirs.
    config: Any = numba.config
    elsewhere = config.CACHE_DIR
    config.CACHE_DIR = CACHE_FOLDER
    try:
        options: dict[str, Any] = {"inline": "always" if inline else "never", "error_model": "numpy"}
        return numba.njit(cache=True, nogil=True, **options)(function)
    finally:
        config.CACHE_DIR = elsewhere


def _without_owner(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    """An array, or a tuple with arrays in it, without what counts its references."""
    if isinstance(kind, types.Array):
        array = make_array(kind)(context, builder, value=value)
        array.meminfo = cgutils.get_null_value(array.meminfo.type)
        array.parent = cgutils.get_null_value(array.parent.type)
        return array._getvalue()  # the way numba's own code reads it
    if isinstance(kind, types.BaseTuple):
        elements: Any = kind
        for k, element in enumerate(elements):
            changed = _without_owner(context, builder, element, builder.extract_value(value, k))
            value = builder.insert_value(value, changed, k)
    return value


def _borrow(typing_context: Any, thing: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return impl_ret_untracked(context, builder, thing, _without_owner(context, builder, thing, arguments[0]))

    return thing(thing), generate


def _same(thing: Any) -> Any:
    return thing


_config: Any = numba.config

# Inside a kernel: an array or tuple (of tuples) of arrays that came as an argument, whose references are not counted
# from here on. Counting is atomic: handing a struct of arrays to a function takes longer than moving a particle, and
# threads that count the same arrays wait for each other. The caller of the kernel holds the arrays meanwhile.
borrowed: Any = _same if _config.DISABLE_JIT else intrinsic(_borrow)
