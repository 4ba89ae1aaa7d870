"""Kernels that come with the package are used where they run, and only there."""

from types import SimpleNamespace

import llvmlite.binding as llvm
import pytest

from particlesim.core import ready_made
from particlesim.core.ready_made import copy_ready_made, use_ready_made


@pytest.fixture
def package(monkeypatch, tmp_path):
    """A package with the kernels of one module, on a machine of the level that they are for."""
    kernels = tmp_path / "package" / "kernels"
    (kernels / "digest").mkdir(parents=True)
    (kernels / "digest" / "kernel.nbi").write_bytes(b"index")
    config = SimpleNamespace(DISABLE_JIT=0, CPU_NAME=None)
    config.reload_config = lambda: setattr(config, "CPU_NAME", ready_made.os.environ["NUMBA_CPU_NAME"])
    monkeypatch.setattr(ready_made, "READY_MADE", kernels)
    monkeypatch.setattr(ready_made, "numba", SimpleNamespace(config=config))
    monkeypatch.setattr(llvm, "get_host_cpu_features", lambda: dict.fromkeys(ready_made._FEATURES, True))
    for name in ("NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES"):
        monkeypatch.setenv(name, "")  # and so put back at the end
        monkeypatch.delenv(name)
    return kernels


def test_kernels_that_run_here_are_used(package, monkeypatch):
    assert use_ready_made()
    assert ready_made.os.environ["NUMBA_CPU_NAME"] == "x86-64-v3"
    assert "+avx2" in ready_made.os.environ["NUMBA_CPU_FEATURES"]
    assert use_ready_made()  # by a process that this one starts, too


def test_a_source_checkout_has_none(package, monkeypatch, tmp_path):
    monkeypatch.setattr(ready_made, "READY_MADE", tmp_path / "nothing")
    assert not use_ready_made()
    assert "NUMBA_CPU_NAME" not in ready_made.os.environ


def test_an_older_processor_compiles_for_itself(package, monkeypatch):
    features = dict.fromkeys(ready_made._FEATURES, True) | {"avx2": False}
    monkeypatch.setattr(llvm, "get_host_cpu_features", lambda: features)
    assert not use_ready_made()
    assert "NUMBA_CPU_NAME" not in ready_made.os.environ


def test_another_wish_for_the_processor_is_heard(package, monkeypatch):
    monkeypatch.setenv("NUMBA_CPU_NAME", "generic")
    ready_made.numba.config.CPU_NAME = "generic"
    assert not use_ready_made()


def test_kernels_are_copied_once(package, tmp_path):
    cache = tmp_path / "cache" / "digest" / "core"
    copy_ready_made("digest", cache)
    assert (cache / "kernel.nbi").read_bytes() == b"index"
    (cache / "kernel.nbi").write_bytes(b"newer")
    copy_ready_made("digest", cache)
    assert (cache / "kernel.nbi").read_bytes() == b"newer"
    assert [path.name for path in cache.parent.iterdir()] == ["core"]


def test_a_module_without_any_is_compiled(package, tmp_path):
    copy_ready_made("another digest", tmp_path / "cache" / "another digest" / "core")
    assert not (tmp_path / "cache").exists()
