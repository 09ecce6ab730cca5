"""Conversion of the classes of `model` to JSON and back: frozen dataclasses, tuples, arrays, enums and plain values."""

from __future__ import annotations

import dataclasses
import json
import math
import types
from enum import Enum
from functools import cache
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np

T = TypeVar("T")


def to_json(value: Any) -> str:
    """Return an object as JSON text; NaN becomes null, and infinity becomes the text "inf"."""
    return json.dumps(plain(value), allow_nan=False)


def from_json(kind: type[T], text: str) -> T:
    """Return the object of class `kind`, such as `Outcome[DrillingDetail]`, from the text of `to_json`.

    Raises
    ------
    ValueError, TypeError, KeyError
        The text does not describe such an object.
    """
    value: T = _restore(kind, json.loads(text))
    return value


def plain(value: Any) -> Any:
    """Convert a value to lists, dicts, numbers and texts."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {f.name: plain(getattr(value, f.name)) for f in dataclasses.fields(value) if f.init}
    if isinstance(value, np.ndarray):
        return {"dtype": value.dtype.str, "shape": list(value.shape), "values": plain(value.ravel().tolist())}
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, dict):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, tuple | list):
        return [plain(v) for v in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else str(value)
    return value


@cache
def _hints(kind: type) -> dict[str, Any]:
    return get_type_hints(kind)


def _restore(kind: Any, data: Any) -> Any:
    origin, args = get_origin(kind), get_args(kind)
    if origin in (Union, types.UnionType):
        return None if data is None else _restore(next(a for a in args if a is not type(None)), data)
    if isinstance(data, dict) and {"dtype", "shape", "values"} <= data.keys():
        values = [math.nan if v is None else float(v) if isinstance(v, str) else v for v in data["values"]]
        return np.array(values, dtype=np.dtype(data["dtype"])).reshape(data["shape"])
    if origin is tuple:
        inner = [args[0]] * len(data) if len(args) == 2 and args[1] is Ellipsis else args
        return tuple(_restore(k, v) for k, v in zip(inner, data, strict=True))
    if origin is dict:
        return {k: _restore(args[1], v) for k, v in data.items()}
    class_: Any = origin or kind
    if isinstance(class_, type) and dataclasses.is_dataclass(class_):
        if not isinstance(data, dict):
            raise TypeError(f"a {class_.__name__} is a JSON object")
        # Replace the type variables of a generic class by its arguments, as in `Outcome[SheetDetail]`.
        bound = dict(zip(getattr(class_, "__parameters__", ()), args, strict=False))
        hints = {name: bound.get(hint, hint) for name, hint in _hints(class_).items()}
        return class_(**{name: _restore(hints[name], value) for name, value in data.items()})
    if isinstance(kind, type) and issubclass(kind, Enum):
        return kind(data)
    if kind is float:
        return math.nan if data is None else float(data)
    return data
