"""Compiled code on the disk: kept where a folder can be written, checked before it is run, removed where it is damaged.

Numba keeps a function's code beside its source, in the user's cache, or in ``NUMBA_CACHE_DIR``; where none of these can
be written it would refuse the function, and where a file is damaged every run would end in an error, or in none. It
looks at the function's own file only: what compiled code holds of another file, a constant or a function that it calls,
would stay as it was. So code is kept under the digest of all kernels: where one has changed all are compiled anew.
"""

from __future__ import annotations

import functools
import hashlib
import pickle
from contextlib import suppress
from pathlib import Path
from typing import Any

from numba.core.caching import IndexDataCacheFile

_DIGEST = hashlib.sha256().digest_size
#: Functions whose code could not be kept, by name.
_not_kept: set[str] = set()


def not_kept() -> bool:
    """Return whether compiled code could not be kept on this machine, so that the next run compiles again."""
    return bool(_not_kept)


def keep(compiled: Any) -> Any:
    """Return a compiled function that keeps its code on disk, if any folder can be written."""
    if not hasattr(compiled, "enable_caching"):  # compiling is off
        return compiled
    try:
        compiled.enable_caching()
    except (RuntimeError, OSError):  # no folder can be written
        _not_kept.add(compiled.__name__)
        return compiled
    cache = compiled._cache
    folders = {Path(__file__).parent, Path(compiled.py_func.__code__.co_filename).parent}
    stamp = (cache._impl.locator.get_source_stamp(), *map(_digest_of, sorted(folders)))
    file = cache._cache_file = _Checked(cache._cache_path, cache._impl.filename_base, stamp)
    load, save = cache.load_overload, cache.save_overload

    def load_or_remove(signature: Any, context: Any) -> Any:
        try:
            return load(signature, context)
        except Exception:  # pickle raises nearly anything on damaged bytes
            file.remove()
            return None

    def save_if_possible(signature: Any, data: Any) -> None:
        try:
            save(signature, data)
        except OSError:  # the disk is full, the folder is gone or may not be written any more
            _not_kept.add(compiled.__name__)
        except Exception:  # what is already there is damaged
            file.remove()
            with suppress(Exception):
                save(signature, data)

    cache.load_overload, cache.save_overload = load_or_remove, save_if_possible
    return compiled


@functools.cache
def _digest_of(folder: Path) -> str:
    """Return the digest of all Python files in a folder: kernels of leafcut use nothing of it from elsewhere."""
    total = hashlib.sha256()
    for file in sorted(folder.glob("*.py")):
        text = file.read_bytes()
        total.update(f"{file.name} {len(text)} ".encode() + text)
    return total.hexdigest()


class _Checked(IndexDataCacheFile):  # type: ignore[misc]  # numba has no types
    """Numba's files of one function, each with a digest behind it: a wrong bit of machine code would be run.

    The digest holds the sources, too: while leafcut is upgraded an older process may still write beside a newer one.
    """

    def _dump(self, obj: Any) -> bytes:
        data: bytes = super()._dump(obj)
        return data + self._digest(data)  # pickle does not look behind its end

    def _load_data(self, name: str) -> Any:
        whole = Path(self._data_path(name)).read_bytes()
        data = whole[:-_DIGEST]
        if self._digest(data) != whole[-_DIGEST:]:
            raise ValueError(f"{name} is damaged, or of other sources")
        return pickle.loads(data)

    def _digest(self, data: bytes) -> bytes:
        return hashlib.sha256(repr(self._source_stamp).encode() + data).digest()

    def remove(self) -> None:
        """Remove all files of the function."""
        index = Path(self._index_path)
        for path in (index, *index.parent.glob(f"{index.stem}.*.nbc")):
            with suppress(OSError):
                path.unlink()
