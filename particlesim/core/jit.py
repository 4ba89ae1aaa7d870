"""The two decorators under which kernels are compiled, and the cache in which the result is kept.

Numba's on-disk cache notices a change in the file of a kernel but not in the files of the kernels that it calls. The
cache folder of a module is therefore named after a digest of its source and of all that it imports: a stale kernel
cannot be run, what a change does not concern is not compiled again, and a package installed read-only has a cache.
"""

from __future__ import annotations

import functools
import gc
import hashlib
import os
import re
import stat
import tempfile
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numba
from numba.core import cgutils, types
from numba.core.caching import _CacheLocator
from numba.core.compiler_lock import global_compiler_lock
from numba.core.imputils import impl_ret_untracked
from numba.extending import intrinsic, models, register_model
from numba.np.arrayobj import make_array

from particlesim.core.compile_lock import compiled_here
from particlesim.core.inner_kernels import take_short_cuts
from particlesim.core.kernel_cache import KernelCache
from particlesim.core.ready_made import copy_ready_made, use_ready_made

_PACKAGE = Path(__file__).parent.parent
_IMPORT = re.compile(rb"^\s*from particlesim\.([\w.]+) import", re.MULTILINE)


@functools.cache
def _source(module: str) -> bytes:
    """The source of a module of this package, named from below it; empty if there is none."""
    path = _PACKAGE.joinpath(*module.split("."))
    path = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    return path.read_bytes() if path.is_file() else b""


@functools.cache
def _digest(module: str) -> str:
    """A digest of a module and of all that it imports from this package, directly or not."""
    found, waiting = set(), [module]
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting += [match.decode() for match in _IMPORT.findall(_source(name))]
    sources = hashlib.sha256(_source("core.jit") + _source("core.inner_kernels"))
    for name in sorted(found):
        sources.update(_source(name))
    return sources.hexdigest()[:16]


def _cache_folder() -> str:
    """The folder for compiled kernels: NUMBA_CACHE_DIR if set, else the user's cache, else a private temporary one."""
    base = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME")
    try:
        folder = Path(base or Path.home() / ".cache") / "particlesim" / "kernels"
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except (OSError, RuntimeError) as error:  # RuntimeError: a user without an entry in passwd, and HOME is not set
        elsewhere = _private_folder(Path(tempfile.gettempdir()) / f"particlesim-{os.getuid()}")
        warnings.warn(f"compiled kernels are kept in {elsewhere}: {error}", stacklevel=2)
        return str(elsewhere)
    return str(folder)


def _private_folder(folder: Path) -> Path:
    """``folder`` if none but this user can write to it, made if it is not there; else a new one.

    Its name can be foreseen, and what is in it is run: any user could have put it there.
    """
    try:
        folder.mkdir(mode=0o700)
    except FileExistsError:
        found = folder.lstat()
        if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.getuid() or found.st_mode & 0o077:
            return Path(tempfile.mkdtemp(prefix="particlesim-"))
    return folder


CACHE_FOLDER = _cache_folder()

# Processes that compile into it beside each other lock its functions here.
_LOCKS = Path(CACHE_FOLDER, "compiling")


def is_compiled(module: str) -> bool:
    """Whether there are compiled kernels of a module of this package, named from below it, as it is now."""
    return any(Path(CACHE_FOLDER, _digest(module)).rglob("*.nbi"))


_njit: Any = numba.njit
_READY_MADE = use_ready_made()
take_short_cuts()


def _compiled(function: Callable[..., Any], **options: Any) -> Any:
    """Compile ``function`` for the machine: cached on disk, without the GIL, IEEE arithmetic (no fastmath)."""
    # The place of a function's cache is settled when it is decorated; other users of numba keep theirs.
    config: Any = numba.config
    elsewhere = config.CACHE_DIR
    ours = function.__module__.startswith("particlesim.")
    digest = _digest(function.__module__.removeprefix("particlesim."))
    config.CACHE_DIR = os.path.join(CACHE_FOLDER, digest)
    if _READY_MADE:
        source = function.__code__.co_filename
        copy_ready_made(digest, Path(config.CACHE_DIR, _CacheLocator.get_suitable_cache_subpath(source)))
    try:
        compiled = _njit(nogil=True, error_model="numpy", no_cfunc_wrapper=True, **options)(function)
        if ours and not config.DISABLE_JIT:
            compiled._cache = KernelCache(function)
    finally:
        config.CACHE_DIR = elsewhere
    if not config.DISABLE_JIT:
        _compile_once_a_role(compiled)
    return compiled


def _role(kind: Any) -> Any:
    """The one type of all arguments that differ in nothing that matters: constants and short integers among them."""
    plain: Any = types.unliteral(kind)
    if isinstance(kind, types.BaseAnonymousTuple):
        return types.BaseTuple.from_types([_role(element) for element in plain])
    widest: Any = types.intp
    short = isinstance(kind, types.Integer) and plain.signed and plain.bitwidth < widest.bitwidth
    return widest if short else plain


def _compile_once_a_role(dispatcher: Any) -> None:
    """Keep numba from compiling a function anew for each constant that it is called with."""
    compile_as_typed = dispatcher.compile

    def compile_once(signature: Any) -> Any:
        roles = tuple(_role(kind) for kind in signature)
        if roles in dispatcher.overloads:
            return compile_as_typed(roles)
        with global_compiler_lock, _rare_collections(), compiled_here(_LOCKS, dispatcher.py_func):
            return compile_as_typed(roles)

    dispatcher.compile = compile_once


@contextmanager
def _rare_collections() -> Iterator[None]:
    """Let Python look for garbage less often: a compiler makes millions of objects, and most of them stay."""
    usual = gc.get_threshold()
    gc.set_threshold(50_000, *usual[1:])
    try:
        yield
    finally:
        gc.set_threshold(*usual)


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function that only kernels call. Called from Python it crashes: it has no wrapper, which takes long."""
    return _compiled(function, no_cpython_wrapper=True)


def entry_kernel(function: Callable[..., Any]) -> Any:
    """Compile a function that Python calls; kernels may call it too."""
    return _compiled(function)


class _Uncounted(types.Array):
    """The type of an array that is held elsewhere: references to it, or to parts of it, are not counted."""

    def __init__(self, array: types.Array) -> None:
        name = f"uncounted {array.name}"
        super().__init__(array.dtype, array.ndim, array.layout, not array.mutable, name, array.aligned)

    def copy(self, dtype: Any = None, ndim: Any = None, layout: Any = None, readonly: Any = None) -> Any:
        """The type of a part, which numba asks for with the number of its axes, or of a new array like this one."""
        kind: Any = super().copy(dtype, ndim, layout, readonly)
        return kind if ndim is None else _Uncounted(kind)


@register_model(_Uncounted)
class _UncountedModel(models.StructModel):
    """An array as numba lays it out, but that what counts its references is a mere address."""

    def __init__(self, manager: Any, kind: Any) -> None:
        counted = models.ArrayModel(manager, kind)
        members = dict(zip(counted._fields, counted._members, strict=True))  # the way numba's own code reads it
        members["meminfo"] = types.voidptr
        super().__init__(manager, kind, list(members.items()))


def _uncounted_type(kind: Any) -> Any:
    """The type of an array, or of a tuple with arrays in it, that is not counted."""
    if isinstance(kind, _Uncounted):
        return kind
    if isinstance(kind, types.Array):
        return _Uncounted(kind)
    if isinstance(kind, types.BaseTuple):
        elements: Any = kind
        elements = [_uncounted_type(element) for element in elements]
        return types.BaseTuple.from_types(elements, getattr(kind, "instance_class", None))
    return kind


def _uncounted(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    """The value, of type ``kind``, as its uncounted type has it."""
    if isinstance(kind, _Uncounted):
        return value
    if isinstance(kind, types.Array):
        array, bare = make_array(kind)(context, builder, value=value), make_array(_Uncounted(kind))(context, builder)
        for name in ("nitems", "itemsize", "data", "shape", "strides"):
            setattr(bare, name, getattr(array, name))
        bare.meminfo = cgutils.get_null_value(array.meminfo.type)
        bare.parent = cgutils.get_null_value(array.parent.type)
        return bare._getvalue()
    if isinstance(kind, types.BaseTuple):
        kinds: Any = kind
        elements = [_uncounted(context, builder, k, builder.extract_value(value, i)) for i, k in enumerate(kinds)]
        return context.make_tuple(builder, _uncounted_type(kind), elements)
    return value


def _borrow(typing_context: Any, thing: Any) -> Any:
    result = _uncounted_type(thing)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return impl_ret_untracked(context, builder, result, _uncounted(context, builder, thing, arguments[0]))

    return result(thing), generate


def _same(thing: Any) -> Any:
    return thing


_config: Any = numba.config

# Inside a kernel: an array or tuple (of tuples) of arrays that came as an argument, whose references are not counted
# from here on. Counting is atomic: handing a struct of arrays to a function takes longer than moving a particle, and
# threads that count the same arrays wait for each other. The caller of the kernel holds the arrays meanwhile; neither
# they nor parts of them may be returned.
without_refcounts: Any = _same if _config.DISABLE_JIT else intrinsic(_borrow)
