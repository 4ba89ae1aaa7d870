"""Kernels that come with the package: a wheel may hold them compiled, for a level of processors (see jobs/wheel.py)."""

from __future__ import annotations

import os
import shutil
import tempfile
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
import numba

# Folders of kernels, each named after the digest of the module they are of (see jit.py).
READY_MADE = Path(__file__).parent.parent / "kernels"

# What they are compiled for: a level of x86-64 as its psABI defines them (version 1.0, table 3.1), here all processors
# since about 2013, and what it has beyond what every x86-64 has, in LLVM's words.
_LEVEL = "x86-64-v3"
_FEATURES = (
    "cx16", "sahf", "popcnt", "sse3", "sse4.1", "sse4.2", "ssse3",
    "avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe", "xsave",
)  # fmt: skip


def compile_for_level() -> None:
    """Let numba compile for the level from now on, in processes that are started as well, whatever this machine has."""
    os.environ["NUMBA_CPU_NAME"] = _LEVEL
    os.environ["NUMBA_CPU_FEATURES"] = ",".join(f"+{feature}" for feature in _FEATURES)
    numba.config.reload_config()


def use_ready_made() -> bool:
    """Whether kernels come with this package and run on this machine; what else is compiled is for their level then."""
    config: Any = numba.config
    host = llvm.get_host_cpu_features()
    if not READY_MADE.is_dir() or config.DISABLE_JIT or not all(host.get(feature) for feature in _FEATURES):
        return False
    if "NUMBA_CPU_NAME" not in os.environ:
        compile_for_level()
    return bool(config.CPU_NAME == _LEVEL)


def copy_ready_made(digest: str, cache: Path) -> None:
    """Put the kernels of a module with this digest where numba looks for them, unless there are any."""
    source = READY_MADE / digest
    if not source.is_dir() or cache.exists():
        return
    cache.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=cache.parent) as folder:
        whole = shutil.copytree(source, Path(folder, "whole"))
        if not cache.exists():  # another process may have been faster
            whole.rename(cache)
