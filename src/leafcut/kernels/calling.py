"""Calling the machine code of kernels from Python, without Numba.

Numba's own calls of a compiled function need all of Numba. What they do for a kernel is little: each array is given as
its address, shape and steps, each named tuple as its fields, and the function is called as one of C. The convention is
that of ``numba.core.callconv.CPUCallConv``: a place for the result, a place for an error, then the arguments, and it
returns whether there was an error.
"""

from __future__ import annotations

import ctypes
import functools
import inspect
import os
import pickle
import sys
import threading
from collections.abc import Callable, Hashable, Iterator
from contextlib import contextmanager
from typing import Any, Protocol

import numpy as np

from leafcut.kernels.keeping import Kept, MachineCode

#: Those of ``ndarray.flags.num`` that Numba makes a difference of: contiguous as in C or Fortran, aligned, writeable.
_C, _FORTRAN, _ALIGNED, _WRITEABLE = 0x1, 0x2, 0x100, 0x400
_FLAGS = _C | _FORTRAN | _ALIGNED | _WRITEABLE

#: A whole number of Python that does not fit into 64 bits with a sign.
_UNSIGNED = np.uint64
_MOST, _LEAST = 2**63 - 1, -(2**63)

#: What a compiled function returns: 0 and −2 (it returns nothing) are no errors; from 1 on, its own error is told of.
_FINE, _OWN_ERROR = (0, -2), 1

#: Names that Numba gives types, and those that C has for them.
_OF_C: dict[str, Any] = {
    "none": ctypes.c_void_p, "bool": ctypes.c_bool, "int8": ctypes.c_int8, "int16": ctypes.c_int16,
    "int32": ctypes.c_int32, "int64": ctypes.c_int64, "uint8": ctypes.c_uint8, "uint16": ctypes.c_uint16,
    "uint32": ctypes.c_uint32, "uint64": ctypes.c_uint64, "float32": ctypes.c_float, "float64": ctypes.c_double,
}  # fmt: skip

_lock = threading.RLock()


class CompilingListener(Protocol):
    """Is told when a kernel begins to be compiled, and when that has ended."""

    def began(self, kept: bool) -> None:
        """Compiling begins; `kept` says whether the next run finds it on the disk."""

    def ended(self) -> None:
        """It has ended."""


_listeners: list[CompilingListener] = []


@contextmanager
def listening(listener: CompilingListener) -> Iterator[None]:
    """Tell a listener of all that is compiled inside."""
    _listeners.append(listener)
    try:
        yield
    finally:
        _listeners.remove(listener)


class Kernel:
    """A function, and its machine code for every kind of arguments that it was called with.

    Attributes
    ----------
    py_func
        The function in Python.
    signatures
        The kinds of arguments that machine code is at hand for, in words.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        functools.update_wrapper(self, function)
        self.py_func = function
        self.signatures: dict[str, Callable[..., Any]] = {}
        self._calls: dict[tuple[Hashable, ...], Callable[..., Any]] = {}

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        """Call the machine code; it is loaded or compiled first where it must be."""
        if named:
            bound = inspect.signature(self.py_func).bind(*arguments, **named)
            bound.apply_defaults()
            arguments = bound.args
        kinds = tuple(map(_kind, arguments))
        call = self._calls.get(kinds)
        return (call or self._ready(kinds, arguments))(arguments)

    def __reduce__(self) -> str:
        """Other processes find it by its name."""
        return self.__qualname__

    @property
    def _numba_type_(self) -> Any:
        """Numba asks for this where a kernel calls another one, and compiles that into it."""
        from numba.core import types

        return types.Dispatcher(self._dispatcher)

    @functools.cached_property
    def _dispatcher(self) -> Any:
        from leafcut.kernels.compiling import dispatcher_of

        return dispatcher_of(self.py_func)

    def _ready(self, kinds: tuple[Hashable, ...], arguments: tuple[Any, ...]) -> Callable[..., Any]:
        """Return how to call the machine code for some kinds of arguments."""
        with _lock:
            words = ", ".join(map(_in_words, kinds))
            if words not in self.signatures:
                kept = Kept.of(self.py_func, words)
                code = kept.load()
                if code is None:
                    code = self._compiled(arguments, kept)
                self.signatures[words] = _caller(code, kinds)
            call = self._calls[kinds] = self.signatures[words]
            return call

    def _compiled(self, arguments: tuple[Any, ...], kept: Kept) -> MachineCode:
        for listener in tuple(_listeners):
            listener.began(kept.can_be_kept())
        try:
            from leafcut.kernels.compiling import machine_code

            code = machine_code(self._dispatcher, arguments)
        finally:
            for listener in tuple(_listeners):
                listener.ended()
        kept.save(code)
        return code


def _kind(value: Any) -> Hashable:
    """Return what a value's machine code depends on."""
    if isinstance(value, np.ndarray):
        return value.dtype, value.ndim, value.flags.num & _FLAGS
    kind = type(value)
    if issubclass(kind, tuple):
        return kind, tuple(map(_kind, value))
    if kind is int and not _LEAST <= value <= _MOST:
        return _UNSIGNED
    return kind


def _in_words(kind: Any) -> str:
    """Return a kind as words that are the same in every process.

    Raises
    ------
    TypeError
        Kernels take no such thing.
    """
    if isinstance(kind, tuple) and isinstance(kind[0], np.dtype):
        dtype, dimensions, flags = kind
        layout = "C" if flags & _C else "F" if flags & _FORTRAN else "A"
        less = ("" if flags & _WRITEABLE else " read-only") + ("" if flags & _ALIGNED else " unaligned")
        return f"{_number(dtype)}[{dimensions}{layout}]{less}"
    if isinstance(kind, tuple):
        return f"{kind[0].__module__}.{kind[0].__qualname__}({', '.join(map(_in_words, kind[1]))})"
    return _number(kind)


def _number(kind: Any) -> str:
    """Return the name of a kind of numbers."""
    try:
        name = np.dtype(kind).name
    except TypeError:
        name = ""
    if name not in _OF_C or np.dtype(kind).byteorder not in "=|":
        raise TypeError(f"kernels take arrays, numbers and tuples of them, not {kind}")
    return name


def _types_of_c(kind: Any) -> Iterator[Any]:
    """Yield the types of C that a value of a kind is given as."""
    if isinstance(kind, tuple) and isinstance(kind[0], np.dtype):
        # Its two owners (none: nothing is counted), number of elements, bytes of one, address, shape and steps.
        yield from [ctypes.c_void_p] * 2 + [ctypes.c_int64] * 2 + [ctypes.c_void_p] + [ctypes.c_int64] * (2 * kind[1])
    elif isinstance(kind, tuple):
        for one in kind[1]:
            yield from _types_of_c(one)
    else:
        yield _OF_C[_number(kind)]


def _flattened(values: tuple[Any, ...], flat: list[Any]) -> list[Any]:
    """Put what C is given of some values at the end of `flat`, and return it."""
    for value in values:
        if isinstance(value, np.ndarray):
            flat += (None, None, value.size, value.itemsize, value.ctypes.data, *value.shape, *value.strides)
        elif isinstance(value, tuple):
            _flattened(value, flat)
        else:
            flat.append(value)
    return flat


def _caller(code: MachineCode, kinds: tuple[Hashable, ...]) -> Callable[..., Any]:
    """Return what calls machine code with arguments of some kinds."""
    given = [one for kind in kinds for one in _types_of_c(kind)]
    result_type = _OF_C[code.returns]
    returns_something = code.returns != "none"
    # A function that ctypes calls so lets go of the GIL.
    function = ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_void_p, ctypes.c_void_p, *given)(_address(code))

    def call(arguments: tuple[Any, ...]) -> Any:
        result, error = result_type(), ctypes.c_void_p()
        status = function(ctypes.byref(result), ctypes.byref(error), *_flattened(arguments, []))
        if status not in _FINE:
            raise _error_at(status, error)
        return result.value if returns_something else None

    return call


class _Error(ctypes.Structure):
    """Where Numba keeps an error: pickled, and so long."""

    _fields_ = (("pickled", ctypes.c_void_p), ("size", ctypes.c_int32))


def _error_at(status: int, place: ctypes.c_void_p) -> BaseException:
    """Return the error that machine code ended with, as a division by zero."""
    if status < _OWN_ERROR or not place.value:
        return RuntimeError(f"a kernel ended with status {status}")
    told = _Error.from_address(place.value)
    kind, values, _ = pickle.loads(ctypes.string_at(told.pickled, told.size))
    error: BaseException = kind(*(values or ()))
    return error


@functools.cache
def _engine() -> Any:
    """Return LLVM's loader of object files; it holds all machine code until the process ends."""
    import llvmlite.binding as llvm

    if os.name == "nt":  # there the C library's functions are found through Numba alone
        import numba.core.registry

        _ = numba.core.registry.cpu_target.target_context
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    machine = llvm.Target.from_triple(llvm.get_process_triple()).create_target_machine(jit=True)
    return llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)


def _address(code: MachineCode) -> int:
    """Load an object file, and return where its function lies."""
    import llvmlite.binding as llvm

    engine = _engine()
    engine.add_object_file(llvm.object_file.ObjectFileRef.from_data(code.object))
    engine.finalize_object()
    address: int = engine.get_function_address(code.symbol)
    if not address:
        raise RuntimeError(f"no function {code.symbol} in the machine code of a kernel (Python {sys.version})")
    return address
