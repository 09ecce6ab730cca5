"""Making machine code of kernels: the one place that needs Numba, and that holds its flags.

No flag of Numba's says that a kernel is compiled for plain numbers only, at a level of its own, or for any processor.
So methods of its dispatcher are wrapped here, and its global level is changed while one kernel compiles; what each of
these saves of the first run on a machine stands beside it, and none changes an answer. For their sake pyproject.toml
caps Numba below the first version not tried; run tests/kernels and tests/solve to raise it.
"""

from __future__ import annotations

import functools
import threading
import types as python
from collections.abc import Callable
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
import numba
from llvmlite import ir
from numba.core import config, types

from leafcut.kernels.keeping import MachineCode

#: LLVM's level of optimisation. Measured on the colony: 1 makes code as fast as 3 does, in an eighth less time.
LEVEL = 1

#: Bytes before what an object of Python holds.
_HEAD = object.__basicsize__

#: Kinds of numbers that kernels take, with what LLVM has for them.
_OF_LLVM: dict[str, Any] = {
    "bool": ir.IntType(8), "float32": ir.FloatType(), "float64": ir.DoubleType(),
    **{f"{sign}int{bits}": ir.IntType(bits) for sign in ("", "u") for bits in (8, 16, 32, 64)},
}  # fmt: skip

_compiling = threading.RLock()


def dispatcher_of(function: Callable[..., object]) -> Any:
    """Return what Numba compiles of a function, with no way for Python to call it: that is a fifth of a compilation.

    Kernels allocate nothing, so no references are counted: a sixth less to compile.
    """
    compiled: Any = numba.njit(nogil=True, no_cfunc_wrapper=True, no_cpython_wrapper=True, _nrt=False)(
        _placed(function)
    )
    compiled.get_call_template = _with_plain_numbers(compiled.get_call_template)
    compiled.compile = _at_level(compiled.compile)
    return compiled


def machine_code(dispatcher: Any, arguments: tuple[object, ...], given: list[str | tuple[int, int]]) -> MachineCode:
    """Return the machine code of a kernel for the kinds of some arguments, for any processor of this architecture.

    `given` says how `calling` gives them: an array as its object (dimensions, bytes of an element), a number as itself
    (its kind).

    A processor's own instructions made no kernel faster at `LEVEL`, and code without them runs on every machine that
    shares a folder or a wheel.

    Raises
    ------
    TypeError
        The kernel returns something else than numbers.
    """
    with _compiling:
        signature = tuple(dispatcher.typeof_pyval(argument) for argument in arguments)
        dispatcher.compile(signature)
        made = dispatcher.overloads[signature]
        returns = _returned(dispatcher.__name__, made.signature.return_type)
        module = made.library._final_module.clone()
        entry = f"entry.{made.fndesc.llvm_func_name}"
        module.link_in(llvm.parse_assembly(str(_entry(entry, made.fndesc.llvm_func_name, given, module))))
        return MachineCode(entry, returns, _object(made.library.codegen, module))


def _returned(name: str, kind: Any) -> str:
    """Return in words what a kernel returns: nothing, a number, or several."""
    if isinstance(kind, type(types.none)):
        return "none"
    several = isinstance(kind, types.BaseAnonymousTuple)  # type: ignore[attr-defined]  # numba has no types
    words = [str(one) for one in (kind.types if several else [kind])]
    if not set(words) <= set(_OF_LLVM):
        raise TypeError(f"kernel {name} returns {kind}; return numbers, or change an array")
    return f"({', '.join(words)})" if several else words[0]


def _object(codegen: Any, module: Any) -> bytes:
    """Return the object file of a module: relocatable, with all that it calls but the C library's."""
    options: dict[str, Any] = {"opt": int(config.OPT)}
    codegen._customize_tm_options(options)
    machine = llvm.Target.from_triple(llvm.get_process_triple()).create_target_machine(
        **options | {"cpu": "generic", "features": ""}
    )
    code: bytes = machine.emit_object(module)
    return code


def _entry(name: str, target: str, given: list[str | tuple[int, int]], beside: Any) -> ir.Module:
    """Return a module with a function that takes arrays as the objects that they are, and calls the compiled one.

    Taken apart in Python an array costs a microsecond, and some kernels are called with twenty. Source: NumPy's C API,
    ``PyArrayObject``: behind the head of every object lie address, number of dimensions, shape and steps.
    """
    module = ir.Module(name)
    module.triple, module.data_layout = beside.triple, beside.data_layout
    pointer, whole = ir.IntType(8).as_pointer(), ir.IntType(64)
    parameters = [pointer if isinstance(one, tuple) else _OF_LLVM[one] for one in given]
    function = ir.Function(module, ir.FunctionType(ir.IntType(32), [pointer, pointer, *parameters]), name)
    builder = ir.IRBuilder(function.append_basic_block())

    def loaded(start: Any, offset: int, kind: Any) -> Any:
        place = builder.gep(start, [ir.Constant(whole, offset)])
        return builder.load(builder.bitcast(place, kind.as_pointer()))

    flat: list[Any] = list(function.args[:2])
    for value, one in zip(function.args[2:], given, strict=True):
        if not isinstance(one, tuple):
            flat.append(value)
            continue
        dimensions, item = one
        address, shape, steps = (loaded(value, _HEAD + 8 * k, pointer) for k in (0, 2, 3))
        lengths = [loaded(shape, 8 * k, whole) for k in range(dimensions)]
        number: Any = functools.reduce(builder.mul, lengths, ir.Constant(whole, 1))
        # Who owns it is not told: nothing is counted.
        flat += [pointer(None), pointer(None), number, ir.Constant(whole, item), address, *lengths]
        flat += [loaded(steps, 8 * k, whole) for k in range(dimensions)]
    called = ir.Function(module, ir.FunctionType(ir.IntType(32), [one.type for one in flat]), target)
    builder.ret(builder.call(called, flat))
    return module


def _placed(function: Callable[..., object]) -> Callable[..., object]:
    """Return a function that says of its file no more than folder and name: machine code holds it, in its errors."""
    code, file = function.__code__, Path(function.__code__.co_filename)
    where = f"{file.parent.name}/{file.name}"
    placed = python.FunctionType(
        code.replace(co_filename=where),
        function.__globals__,
        function.__name__,
        function.__defaults__,
        function.__closure__,
    )
    return functools.update_wrapper(placed, function)


def _with_plain_numbers(get_call_template: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    """Have a kernel that another one calls compiled once, not again for every constant and width of whole number.

    Numba gives ``f(0)``, ``f(1)`` and ``f(i)`` a compilation each; that was a quarter of all that is compiled.
    """

    def plain(given: Any) -> Any:
        kind = types.unliteral(given)  # type: ignore[attr-defined]  # numba has no types
        return types.int64 if kind in (types.int8, types.uint8, types.int16, types.int32) else kind

    return lambda args, kws: get_call_template(tuple(map(plain, args)), {name: plain(k) for name, k in kws.items()})


def _at_level(compile_it: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Compile at `LEVEL`; Numba knows one level for a whole process, so it is set back at once."""

    def compile_at_level(signature: Any) -> Any:
        with _compiling:
            usual = config.OPT
            config.OPT = type(usual)(min(int(usual), LEVEL))
            try:
                return compile_it(signature)
            finally:
                config.OPT = usual

    return compile_at_level
