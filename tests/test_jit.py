"""What kernels are compiled with."""

import os
import stat
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from particlesim.core import jit
from particlesim.core.jit import entry_kernel, kernel, without_refcounts


class Things(NamedTuple):
    values: np.ndarray
    factor: float


@kernel
def _sum_of_part(things, first, last):
    total = 0.0
    part = things.values[first:last]
    for k in range(len(part)):
        total += part[k, 0] * things.factor
    return total


@entry_kernel
def _sum_and_count(things, counted):
    things, counted = without_refcounts((things, counted))
    total = 0.0
    for k in range(len(counted)):
        counted[k] += 1
        total += _sum_of_part(things, k, len(things.values))
    return total, things.values.copy()


def test_borrowed_arrays_are_read_and_written_in_place():
    values, counted = np.arange(8.0).reshape(4, 2), np.zeros(3, dtype=np.int64)
    held = sys.getrefcount(values), sys.getrefcount(counted)
    total, copied = _sum_and_count(Things(values, 2.0), counted)
    assert total == 2.0 * (12 + 12 + 10)
    assert np.array_equal(copied, values)
    assert not np.shares_memory(copied, values)
    assert counted.tolist() == [1, 1, 1]
    assert (sys.getrefcount(values), sys.getrefcount(counted)) == held


@pytest.fixture
def no_home(tmp_path, monkeypatch):
    """As for a user without an entry in passwd whose HOME is not set; the temporary folder is this test's."""

    def home():
        raise RuntimeError("Could not determine home directory.")

    for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME", "HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(Path, "home", home)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path / f"particlesim-{os.getuid()}"


def test_without_a_home_kernels_are_kept_in_a_private_temporary_folder(no_home):
    assert jit._cache_folder() == jit._cache_folder() == str(no_home)
    assert stat.S_IMODE(no_home.stat().st_mode) == 0o700


def test_a_home_that_cannot_be_written_to_is_passed_over(no_home, monkeypatch, tmp_path):
    (tmp_path / "file").write_text("no folder")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert jit._cache_folder() == str(no_home)


@pytest.mark.parametrize("spoil", ["mode", "link", "owner"])
def test_a_folder_that_others_may_have_filled_is_not_used(no_home, monkeypatch, tmp_path, spoil):
    if spoil == "link":
        (tmp_path / "elsewhere").mkdir(mode=0o700)
        no_home.symlink_to(tmp_path / "elsewhere")
    else:
        no_home.mkdir(mode=0o700)
    if spoil == "mode":
        no_home.chmod(0o770)
    if spoil == "owner":
        own, foreign = os.getuid(), os.getuid() + 1
        no_home.rename(tmp_path / f"particlesim-{foreign}")
        monkeypatch.setattr(os, "getuid", lambda: foreign)
        assert (tmp_path / f"particlesim-{foreign}").stat().st_uid == own
    made = Path(jit._cache_folder())
    assert made.parent == tmp_path and made.name not in (no_home.name, f"particlesim-{os.getuid()}")
    assert stat.S_IMODE(made.stat().st_mode) == 0o700
