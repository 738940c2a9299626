"""Text of LLVM to functions that can be called, by way of object code, which can be kept.

Owns `available`, `Loaded` and `made`. llvmlite is loaded when the first function is asked for. Nothing is optimized but
the choice of instructions: what comes here is straight already. Object code is kept on disk by its text, the compiler
and the processor.
"""

from __future__ import annotations

import ctypes
import itertools
import os
import sys
import threading
from functools import lru_cache
from importlib.util import find_spec
from typing import Any

from potto import store
from potto.kernels.native.vectors import LIBRARY

KIND = "machine-code"
FUNCTION = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)
_lock = threading.Lock()
if hasattr(os, "register_at_fork"):  # a fork in the middle of a compilation has the lock, and nobody to give it back
    os.register_at_fork(before=_lock.acquire, after_in_parent=_lock.release, after_in_child=_lock.release)
_numbers = itertools.count()


@lru_cache(maxsize=1)
def available() -> bool:
    """Whether machine code can be made here."""
    return find_spec("llvmlite") is not None


class _Compiler:
    """LLVM, for the processor at hand."""

    def __init__(self) -> None:
        import ctypes.util  # which loads more than the rest of this module

        from llvmlite import binding

        self.binding: Any = binding
        binding.initialize_native_target()
        binding.initialize_native_asmprinter()
        self.cpu = binding.get_host_cpu_name()
        self.features = binding.get_host_cpu_features().flatten()
        target = binding.Target.from_default_triple()
        self.machine = target.create_target_machine(cpu=self.cpu, features=self.features, opt=2, jit=True)
        self.jit = binding.create_lljit_compiler(self.machine)
        mathematics = ctypes.CDLL("ucrtbase" if sys.platform == "win32" else ctypes.util.find_library("m"))
        self.symbols = {name: ctypes.cast(getattr(mathematics, name), ctypes.c_void_p).value for name in LIBRARY}

    @property
    def signature(self) -> str:
        """What object code depends on beside its text."""
        version = ".".join(map(str, self.binding.llvm_version_info))
        return f"llvm {version} {self.binding.get_process_triple()} {self.cpu} {self.features}"


@lru_cache(maxsize=1)
def compiler() -> _Compiler:
    return _Compiler()


def loaded_llvm() -> bool:
    """Whether LLVM is in memory already."""
    return compiler.cache_info().currsize > 0


class Loaded:
    """A function in memory, as long as this is."""

    def __init__(self, library: Any, address: int) -> None:
        self.library = library
        self.call = FUNCTION(address)


def made(text: str, name: str) -> tuple[Loaded, bool]:
    """The function of that name in a text, and whether its object code had to be compiled: nothing has kept it."""
    with _lock:
        llvm = compiler()
        key = f"{llvm.signature}\n{text}".encode()
        code = store.get(KIND, key)
        new = code is None
        if code is None:
            module = llvm.binding.parse_assembly(text)
            module.verify()
            code = bytes(llvm.machine.emit_object(module))
            store.put(KIND, key, code)
        builder = llvm.binding.JITLibraryBuilder().add_object_img(code).export_symbol(name)
        for symbol, address in llvm.symbols.items():
            builder.import_symbol(symbol, address)
        library = builder.link(llvm.jit, f"potto{next(_numbers)}")
        return Loaded(library, library[name]), new
