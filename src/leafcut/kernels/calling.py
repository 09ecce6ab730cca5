"""Calling the machine code of kernels from Python, without Numba.

Numba's own calls of a compiled function need all of Numba. What they do for a kernel is little: each array is given as
its address, shape and steps, each named tuple as its fields, and the function is called as one of C. The convention is
that of ``numba.core.callconv.CPUCallConv``: a place for the result, a place for an error, then the arguments, and it
returns whether there was an error. Arrays are taken apart in the machine code (`compiling`), which is quicker.
"""

from __future__ import annotations

import ctypes
import functools
import inspect
import os
import pickle
import sys
import threading
import time
from collections.abc import Callable, Hashable, Iterator
from contextlib import contextmanager
from typing import Any, Protocol

import numpy as np

from leafcut.kernels.keeping import CodePlace, MachineCode

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

_ARRAY = np.ndarray

#: Calls machine code with what `_take` puts down of arguments.
Call = Callable[[list[Any]], Any]

_lock = threading.RLock()


class CompilingListener(Protocol):
    """Is told when a kernel begins to be compiled, and when that has ended."""

    def began(self, kept: bool) -> None:
        """Compiling begins; `kept` says whether the next run finds it on the disk."""

    def ended(self) -> None:
        """It has ended."""


_listeners: list[CompilingListener] = []


class _CompileTime:
    """Seconds of this process that went into compiling; nested and parallel compilations count once."""

    def __init__(self) -> None:
        self._spent, self._since, self._depth = 0.0, 0.0, 0

    def seconds(self) -> float:
        """Return the seconds until now."""
        with _time_lock:
            return self._spent + (time.perf_counter() - self._since if self._depth else 0.0)

    @contextmanager
    def counted(self) -> Iterator[None]:
        """Count the time inside."""
        with _time_lock:
            if not self._depth:
                self._since = time.perf_counter()
            self._depth += 1
        try:
            yield
        finally:
            with _time_lock:
                self._depth -= 1
                if not self._depth:
                    self._spent += time.perf_counter() - self._since


_time_lock = threading.Lock()
_compile_time = _CompileTime()


def compile_seconds() -> float:
    """Return the seconds that this process has spent compiling kernels; still going on counts until now."""
    return _compile_time.seconds()


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
        self.signatures: dict[str, Call] = {}
        self._calls: dict[tuple[Hashable, ...], Call] = {}

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        """Call the machine code; it is loaded or compiled first where it must be."""
        if named:
            bound = inspect.signature(self.py_func).bind(*arguments, **named)
            bound.apply_defaults()
            arguments = bound.args
        key: list[Hashable] = []
        given: list[Any] = []
        _take(arguments, key, given)
        call = self._calls.get(tuple(key)) or self._ready(tuple(key), arguments)
        return call(given)

    def __reduce__(self) -> str:
        """Other processes find it by its name."""
        return str(self.py_func.__qualname__)

    @property
    def _numba_type_(self) -> Any:
        """Numba asks for this where a kernel calls another one, and compiles that into it."""
        from numba.core import types

        return types.Dispatcher(self._dispatcher)

    @functools.cached_property
    def _dispatcher(self) -> Any:
        from leafcut.kernels.compiling import dispatcher_of

        return dispatcher_of(self.py_func)

    def _ready(self, key: tuple[Hashable, ...], arguments: tuple[Any, ...]) -> Call:
        """Return how to call the machine code for the kinds of some arguments."""
        with _lock:
            kinds = tuple(map(_kind, arguments))
            words = ", ".join(map(_in_words, kinds))
            if words not in self.signatures:
                kept = CodePlace.of(self.py_func, words)
                code = kept.load()
                if code is None:
                    code = self._compiled(kinds, arguments, kept)
                self.signatures[words] = _caller(code, kinds)
            call = self._calls[key] = self.signatures[words]
            return call

    def _compiled(self, kinds: tuple[Hashable, ...], arguments: tuple[Any, ...], kept: CodePlace) -> MachineCode:
        for listener in tuple(_listeners):
            listener.began(kept.can_be_kept())
        try:
            with _compile_time.counted():
                from leafcut.kernels.compiling import machine_code

                code = machine_code(self._dispatcher, arguments, list(_given(kinds)))
        finally:
            for listener in tuple(_listeners):
                listener.ended()
        kept.save(code)
        return code


def _take(values: tuple[Any, ...], key: list[Hashable], given: list[Any]) -> None:
    """Put what tells the kinds of some values at the end of `key`, and what machine code is given of them of `given`.

    Of an array that is where its object lies. This is done in every call, and is most of what a call takes.
    """
    for value in values:
        kind: Any = type(value)
        if kind is _ARRAY or isinstance(value, _ARRAY):
            key += (value.dtype, value.ndim, value.flags.num & _FLAGS)
            given.append(id(value))
        elif isinstance(value, tuple):
            key += (kind, len(value))
            _take(value, key, given)
        else:
            key.append(_UNSIGNED if kind is int and not _LEAST <= value <= _MOST else kind)
            given.append(value)


def _kind(value: Any) -> Any:
    """Return what a value's machine code depends on."""
    if isinstance(value, np.ndarray):
        return value.dtype, value.ndim, value.flags.num & _FLAGS
    kind: Any = type(value)
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
        name: str = np.dtype(kind).name
    except TypeError:
        name = ""
    if name not in _OF_C or np.dtype(kind).byteorder not in "=|":
        raise TypeError(f"kernels take arrays, numbers and tuples of them, not {kind}")
    return name


def _given(kinds: tuple[Any, ...]) -> Iterator[str | tuple[int, int]]:
    """Yield what machine code is given for values of some kinds: (dimensions, bytes of an element) or a number."""
    for kind in kinds:
        if not isinstance(kind, tuple):
            yield _number(kind)
        elif isinstance(kind[0], np.dtype):
            yield kind[1], kind[0].itemsize
        else:
            yield from _given(kind[1])


def _caller(code: MachineCode, kinds: tuple[Hashable, ...]) -> Call:
    """Return what calls machine code with arguments of some kinds."""
    given = [ctypes.c_void_p if isinstance(one, tuple) else _OF_C[one] for one in _given(kinds)]
    several, nothing = code.returns.startswith("("), code.returns == "none"
    fields = [(f"_{k}", _OF_C[word]) for k, word in enumerate(code.returns.strip("()").split(", "))]
    result_type = type("Results", (ctypes.Structure,), {"_fields_": fields}) if several else _OF_C[code.returns]
    # A function that ctypes calls so lets go of the GIL.
    function = ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_void_p, ctypes.c_void_p, *given)(_address(code))

    def call(values: list[Any]) -> Any:
        result, error = result_type(), ctypes.c_void_p()
        status = function(ctypes.byref(result), ctypes.byref(error), *values)
        if status not in _FINE:
            raise _error_at(status, error)
        if several:
            return tuple(getattr(result, name) for name, _ in fields)
        return None if nothing else result.value

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
