"""Machine code on the disk: found in the wheel or kept from the first run on, and checked before it is run.

A file holds the code of one kernel for one kind of arguments. It lies in ``shipped`` beside this module, where a wheel
was built for this kind of machine; else in the first folder that can be written: ``NUMBA_CACHE_DIR``, ``__pycache__``
beside the kernel's source, the user's cache. It is bound by a digest to all sources it could hold a constant or a
function of, to the versions of what compiled it and to the architecture: where one of these differs it is compiled
anew. What is damaged is removed: a wrong bit of machine code would be run.
"""

from __future__ import annotations

import functools
import hashlib
import importlib.util
import os
import platform
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from leafcut.quick_dataclass import dataclass

#: Changed when files written before cannot be read any more.
_FORMAT = b"leafcut kernel 1\n"
_DIGEST = hashlib.sha256().digest_size
#: Settings of Numba that do not change its code for processors: with NUMBA_DISABLE_JIT there is none of it.
_HARMLESS = {
    "NUMBA_CACHE_DIR", "NUMBA_DISABLE_JIT", "NUMBA_ENABLE_CUDASIM", "NUMBA_NUM_THREADS", "NUMBA_THREADING_LAYER",
}  # fmt: skip
_SUFFIX = ".kernel"

#: Code that comes with leafcut.
SHIPPED = Path(__file__).with_name("shipped")

#: Functions whose code could not be kept, by name.
_not_kept: set[str] = set()


def not_kept() -> bool:
    """Return whether compiled code could not be kept on this machine, so that the next run compiles again."""
    return bool(_not_kept)


class MachineCode(NamedTuple):
    """The machine code of a kernel for one kind of arguments.

    Attributes
    ----------
    symbol
        Its name in the object file.
    returns
        Numba's names of what it returns: ``none``, ``float64``, ``(float64, int64)`` …
    object
        An object file, to be linked with the C library only.
    """

    symbol: str
    returns: str
    object: bytes


@dataclass(frozen=True)
class CodePlace:
    """Where the code of one kernel for one kind of arguments is kept.

    Attributes
    ----------
    source
        The file that the kernel is written in.
    name
        Name of the file that the code is kept in.
    stamp
        What the code is bound to.
    """

    source: Path
    name: str
    stamp: bytes

    @classmethod
    def of(cls, function: Callable[..., Any], kinds: str) -> CodePlace:
        """Return the place for a function called with some kinds of arguments, in words."""
        source = Path(function.__code__.co_filename)
        own = f"{source.stem}.{function.__name__}"
        stamp = "\n".join([own, kinds, *map(_digest_of, sorted({Path(__file__).parent, source.parent})), *_made_with()])
        return cls(source, f"{own}-{_short(kinds)}{_SUFFIX}", stamp.encode())

    def load(self) -> MachineCode | None:
        """Return the code, if it is there; what is damaged, or of other sources, is left to be written anew."""
        for folder in (SHIPPED, *folders(self.source)):
            with suppress(OSError, ValueError):
                return self._read((folder / self.name).read_bytes())
        return None

    def save(self, code: MachineCode) -> None:
        """Write the code into the first folder that takes it."""
        if _needs_numba(code) or not any(self._written(folder, code) for folder in folders(self.source)):
            _not_kept.add(self.name)

    def can_be_kept(self) -> bool:
        """Return whether a folder can be written: asked before a minute is spent."""
        return any(_is_writable(folder) for folder in folders(self.source))

    def as_bytes(self, code: MachineCode) -> bytes:
        """Return what a file holds: code, and a digest of it and of what it is bound to."""
        body = b"\n".join((code.symbol.encode(), code.returns.encode(), code.object))
        return _FORMAT + body + hashlib.sha256(self.stamp + body).digest()

    def _read(self, data: bytes) -> MachineCode:
        body, digest = data[len(_FORMAT) : -_DIGEST], data[-_DIGEST:]
        if not data.startswith(_FORMAT) or hashlib.sha256(self.stamp + body).digest() != digest:
            raise ValueError(f"{self.name} is damaged, or of other sources")
        symbol, returns, code = body.split(b"\n", 2)
        return MachineCode(symbol.decode(), returns.decode(), code)

    def _written(self, folder: Path, code: MachineCode) -> bool:
        """Return whether the code could be written into a folder: whole, or not at all."""
        import tempfile  # start-up: code that is found is not written

        try:
            folder.mkdir(parents=True, exist_ok=True)
            handle, name = tempfile.mkstemp(dir=folder, prefix=self.name, suffix=".part")
        except OSError:
            return False
        part = Path(name)
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(self.as_bytes(code))
            part.replace(folder / self.name)
        except OSError:  # the disk is full, or another process has the file open
            with suppress(OSError):
                part.unlink()
            return False
        return True


def folders(source: Path) -> Iterator[Path]:
    """Yield where the code of kernels of a source file may be kept, in the order of preference."""
    of_source = hashlib.sha256(str(source.parent).encode()).hexdigest()[:16]
    if own := os.environ.get("NUMBA_CACHE_DIR"):
        yield Path(own) / f"leafcut-{of_source}"
        return
    yield source.parent / "__pycache__"
    if cache := _users_cache():
        yield cache / "leafcut" / of_source


def _users_cache() -> Path | None:
    """Return the folder for what a user's programs can make again."""
    if own := os.environ.get("LOCALAPPDATA" if os.name == "nt" else "XDG_CACHE_HOME"):
        return Path(own)
    try:
        return Path.home() / ("Library/Caches" if sys.platform == "darwin" else ".cache")
    except RuntimeError:  # a user without a home
        return None


def _is_writable(folder: Path) -> bool:
    """Return whether files can be made in a folder, which is made where it is not there."""
    import tempfile  # as above

    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def _needs_numba(code: MachineCode) -> bool:
    """Return whether code calls functions of Numba's own, which are not there in a process without it."""
    return b"\0numba_" in code.object or b"\0NRT_" in code.object


@functools.cache
def _made_with() -> tuple[str, ...]:
    """Return what machine code depends on besides sources and arguments."""
    settings = sorted(f"{k}={v}" for k, v in os.environ.items() if k.startswith("NUMBA_") and k not in _HARMLESS)
    machine = f"{sys.platform} {platform.machine()} {sys.maxsize} {object.__basicsize__}"
    return (machine, *map(_versioned, ("numba", "llvmlite")), *settings)


def _versioned(package: str) -> str:
    """Return the name and the version of a package: its folder of facts is named so.

    What reads the facts themselves takes longer to import than a kernel to load; it is asked where no one folder tells.
    """
    spec = importlib.util.find_spec(package)
    beside = Path(spec.origin).parents[1] if spec and spec.origin else None
    told = [] if beside is None else [folder.stem for folder in beside.glob(f"{package}-*.dist-info")]
    if len(told) == 1:
        return told[0].replace("-", " ")
    from importlib.metadata import version

    return f"{package} {version(package)}"


@functools.cache
def _digest_of(folder: Path) -> str:
    """Return the digest of all Python files in a folder: kernels of leafcut use nothing of it from elsewhere."""
    total = hashlib.sha256()
    for file in sorted(folder.glob("*.py")):
        text = file.read_bytes()
        total.update(f"{file.name} {len(text)} ".encode() + text)
    return total.hexdigest()


def _short(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]
