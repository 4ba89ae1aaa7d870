"""What is changed inside numba, so that kernels are ready sooner: it is still there to be changed, and all goes on."""

import operator
import os
import subprocess
import sys

import numba
import numpy as np
import pytest
from numba.core import codegen

from particlesim.core import inner_kernels
from particlesim.core.jit import entry_kernel, kernel
from tests.kernels import callable_from_python

pytestmark = pytest.mark.skipif(bool(os.environ.get("NUMBA_DISABLE_JIT")), reason="nothing is compiled")


@kernel
def _sum_beyond(values, unused, least):
    total = 0.0
    for k in range(len(values)):
        if values[k] > least:
            total += np.sin(values[k])
        elif values[k] < -least:
            total -= np.cos(values[k])
        else:
            total += np.exp(-values[k] * values[k])
    if np.isnan(least):
        raise ValueError(least)
    return total


@entry_kernel
def _sums(values, unused):
    return _sum_beyond(values, unused, 0.1), _sum_beyond(values, unused, 0.2), _sum_beyond(values, unused, 0.3)


@entry_kernel
def _sum_of_sums(values, unused):
    one, two, three = _sums(values, unused)
    return one + two + three + _sum_beyond(values, unused, 0.4)


@kernel
def _factorial(n):
    return 1 if n <= 1 else n * _factorial(n - 1)


VALUES = np.linspace(-1.0, 1.0, 21)
UNUSED = (VALUES, VALUES[::2].copy())


def expected(least):
    return _sum_beyond.py_func(VALUES, UNUSED, least)


def test_numba_is_as_it_was_known_to_be():
    assert inner_kernels.take_short_cuts()
    assert codegen.JITCPUCodegen._library_class is inner_kernels._Library


def test_another_numba_is_left_as_it_is(monkeypatch):
    monkeypatch.setattr(codegen.JITCPUCodegen, "_library_class", codegen.JITCodeLibrary)
    monkeypatch.setitem(inner_kernels._BUILT_UPON, codegen.JitEngine, "is_symbol_defined no_such_thing")
    assert not inner_kernels.take_short_cuts()
    assert codegen.JITCPUCodegen._library_class is codegen.JITCodeLibrary


def test_an_inner_kernel_becomes_machine_code_in_entry_kernels_only(monkeypatch):
    monkeypatch.setattr(inner_kernels, "_OUR_WRAPPER", "_ZN7cpython")
    assert _sums(VALUES, UNUSED) == pytest.approx([expected(0.1), expected(0.2), expected(0.3)], rel=1e-13)
    (inner,), (entry,) = _sum_beyond.overloads.values(), _sums.overloads.values()
    engine, name = inner.library.codegen._engine, inner.fndesc.mangled_name
    assert not engine.is_symbol_defined(name)
    assert engine.is_symbol_defined(entry.fndesc.llvm_cpython_wrapper_name)
    assert all(function.linkage.name == "private" for function in entry.library.get_defined_functions()
               if "_sum_beyond" in function.name and "_sums" not in function.name)  # fmt: skip


def test_other_entries_call_the_same_inner_kernel(monkeypatch):
    # A private copy must not be taken for the function of that name: its signature is another.
    monkeypatch.setattr(inner_kernels, "_OUR_WRAPPER", "_ZN7cpython")
    _sums(VALUES, UNUSED)
    assert callable_from_python(_sum_beyond)(VALUES, UNUSED, 0.1) == pytest.approx(expected(0.1), rel=1e-13)
    assert _sum_of_sums(VALUES, UNUSED) == pytest.approx(sum(map(expected, (0.1, 0.2, 0.3, 0.4))), rel=1e-13)


def test_an_inner_kernel_cannot_be_called_from_python():
    _sums(VALUES, UNUSED)
    with pytest.raises(TypeError):
        operator.call(_sum_beyond, VALUES, UNUSED, 0.1)


def test_exceptions_come_through_with_their_values():
    with pytest.raises(ValueError, match="nan"):
        callable_from_python(_sum_beyond)(VALUES, UNUSED, np.nan)


def test_an_inner_kernel_may_call_itself():
    assert callable_from_python(_factorial)(10) == 3628800


def test_callbacks_of_other_users_of_numba_have_an_address():
    @numba.cfunc("float64(float64)")
    def double(x):
        return 2.0 * x

    assert double.ctypes(1.5) == 3.0


IN_A_LATER_PROCESS = """
import sys
import numpy as np
from particlesim.broad_phase import find_pairs
from particlesim.broad_phase.soa_aabb import overlap_bits

lower = np.random.default_rng(0).random((200, 3))
pairs = find_pairs(lower, lower + 0.1, method=sys.argv[1])
print(len(pairs), sum(overlap_bits.stats.cache_hits.values()), sum(overlap_bits.stats.cache_misses.values()))
"""


def test_an_inner_kernel_is_kept_for_entry_kernels_of_later_processes(tmp_path):
    def run(method):
        command = [sys.executable, "-c", IN_A_LATER_PROCESS, method]
        environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
        return subprocess.run(command, env=environment, check=True, capture_output=True, text=True).stdout.split()

    first, second, third = run("naive"), run("octree"), run("naive")
    assert first[0] == second[0] == third[0]
    assert first[1:] == ["0", "1"]
    assert second[1] == "1"
    assert third[1:] == ["0", "0"]
