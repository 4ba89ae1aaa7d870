"""Short cuts through numba's compiler: kernels are ready in half the time, and those of polyhedra run twice as fast.

Numba takes every function all the way to machine code: optimised, emitted, loaded, wrapped. Of a function that only
kernels call none of this is used, for what runs is the copy that each entry kernel has in itself. Here it ends as LLVM
code. That copy numba lets others call as well, so that LLVM must keep its signature, in which a system of bodies takes
71 arguments, used or not. Here it is private to the entry kernel. And numba looks for references to count in all
values, number by number, even where their type has none: a third of all instructions that it writes down. Here it
looks at the type first.

These are changes to the inside of numba. They are made only if all that they build upon is there; without them the
kernels are the same, but later and slower. pyproject.toml has the versions of numba that were looked at.
"""

from __future__ import annotations

import ctypes
import functools
from typing import Any

import llvmlite.binding as llvm
from numba.core import codegen
from numba.core.environment import lookup_environment
from numba.core.runtime.context import NRTContext

_BUILT_UPON = {
    codegen.CPUCodeLibrary: (
        "_optimize_final_module _finalize_final_module _finalize_dynamic_globals _get_module_for_linking"
        " _unserialize serialize_using_object_code"
    ),
    codegen.JITCodeLibrary: "get_pointer_to_function",
    codegen.JITCPUCodegen: "_library_class set_env",
    codegen.JitEngine: "is_symbol_defined",
    NRTContext: "get_meminfos",
}

# What Python finds in place of the wrapper that an inner function has not: it sets a TypeError and returns null.
_NOT_CALLABLE = ctypes.cast(ctypes.pythonapi.PyErr_BadArgument, ctypes.c_void_p).value

# How the wrappers by which Python calls the entry kernels of this package begin. Other users of numba keep their code.
_OUR_WRAPPER = "_ZN7cpython11particlesim"

# Numba's word for a library of which LLVM code is kept, instead of machine code.
_LLVM_CODE = "bitcode"


def _defined(module: Any) -> list[Any]:
    return [function for function in module.functions if not function.is_declaration]


class _Library(codegen.JITCodeLibrary):
    """A function with all that it calls: LLVM code, not optimised, until the address of any of it is asked for."""

    _inner = False

    def get_pointer_to_function(self, name: str) -> Any:
        """The address of a function. The first that numba asks for is the wrapper, which inner functions have not."""
        found = any(function.name == name for function in _defined(self._final_module))
        if not self._finalized:
            self._inner = not found
        elif self._inner and found:  # the wrapper by which C calls back
            self._inner = False
            self._optimize_final_module()
            self._finalize_final_module()
        self._ensure_finalized()
        return _NOT_CALLABLE if self._inner else super().get_pointer_to_function(name)

    def _optimize_final_module(self) -> None:
        if self._inner:
            return
        functions = _defined(self._final_module)
        if any(function.name.startswith(_OUR_WRAPPER) for function in functions):
            for function in functions:
                # Numba's runtime (NRT) is one for all. Private names, unlike internal ones, never meet those of others.
                if function.linkage == llvm.Linkage.linkonce_odr and not function.name.startswith("NRT"):
                    function.linkage = llvm.Linkage.private
        super()._optimize_final_module()

    def _finalize_final_module(self) -> None:
        if self._inner:
            self._finalize_dynamic_globals()
            self._finalized = True
            return
        super()._finalize_final_module()
        owner: Any = self._codegen
        # Numba does so when a function's own machine code is loaded. Exceptions are made with what is found there.
        for variable in self._final_module.global_variables:
            environment = lookup_environment(variable.name)
            if environment is not None:
                owner.set_env(variable.name, environment)

    def serialize_using_object_code(self) -> Any:
        """What is kept on disk: of inner functions, that which others need to call them."""
        if self._inner:
            return self.name, _LLVM_CODE, self._get_module_for_linking().as_bitcode()
        return super().serialize_using_object_code()

    @classmethod
    def _unserialize(cls, owner: Any, state: Any) -> Any:
        name, kind, data = state
        if kind != _LLVM_CODE:
            return super()._unserialize(owner, state)
        library = owner.create_library(name)
        library._inner, library._final_module = True, llvm.parse_bitcode(data)
        library._finalize_final_module()
        return library


def _keep_llvm_code() -> None:
    owner: Any = codegen.JITCPUCodegen
    set_environment = owner.set_env

    def set_env(self: Any, name: str, environment: Any) -> None:
        if self._engine.is_symbol_defined(name):
            set_environment(self, name, environment)

    owner._library_class, owner.set_env = _Library, set_env


def _look_at_types_first() -> None:
    context: Any = NRTContext
    references_in = context.get_meminfos

    @functools.cache
    def has_references(managers: Any, kind: Any) -> bool:
        return bool(managers[kind].contains_nrt_meminfo())

    def get_meminfos(self: Any, builder: Any, kind: Any, value: Any) -> Any:
        counted = has_references(self._context.data_model_manager, kind)
        return references_in(self, builder, kind, value) if counted else []

    context.get_meminfos = get_meminfos


def take_short_cuts() -> bool:
    """Change numba for the rest of this process; False, with nothing changed, if it is not as it was known to be."""
    known = all(hasattr(owner, name) for owner, names in _BUILT_UPON.items() for name in names.split())
    if known and codegen.JITCPUCodegen._library_class is codegen.JITCodeLibrary:
        _keep_llvm_code()
        _look_at_types_first()
    return known
