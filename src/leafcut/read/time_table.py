"""Parse stop-watch times, and read a CSV table of programs and times."""

from __future__ import annotations

import csv
import io
import re
from pathlib import Path

from leafcut.errors import OptionError, ReadError, printable
from leafcut.files.whole_files import decode_text
from leafcut.message import Message
from leafcut.units import parse_quantity

#: Maximum size of a table, bytes, and maximum number of rows.
_MOST_BYTES, _MOST_ROWS = 1_000_000, 1000

_CLOCK = re.compile(r"\s*(?:(\d{1,3}):)?(\d{1,4}):(\d{1,2}(?:\.\d{1,6})?)\s*\Z")


def parse_stopwatch_time(text: str) -> float:
    """Convert a stop-watch time (``12:34``, ``1:02:03``) or a quantity (``754 s``) to seconds.

    Raises
    ------
    OptionError
        The text has neither form, or the time is not above 0.
    """
    match = _CLOCK.match(text)
    if match:
        hours, minutes, seconds = int(match[1] or 0), int(match[2]), float(match[3])
        if seconds >= 60 or (match[1] and minutes >= 60):
            raise OptionError(f"'{text}' is not a valid time: at most 59 minutes and 59 seconds")
        duration = 3600.0 * hours + 60.0 * minutes + seconds
    else:
        duration = parse_quantity(text, "s")
    if not duration > 0:
        raise OptionError(f"'{text}' is not above 0 s")
    return duration


def read_times(path: str | Path) -> list[tuple[str, float]]:
    """Read a table of programs and times.

    Each row of the result contains the path of a program, relative to the folder of the table, and its time in seconds.
    The separator is a semicolon if the first line contains a semicolon, otherwise a comma. If the first row contains no
    time, it is a header.

    Raises
    ------
    ReadError
        The table cannot be read, is too large or has no rows, or a row has no program or no time.
    """
    file = Path(path)
    try:
        with file.open("rb") as stream:
            data = stream.read(_MOST_BYTES + 1)
    except OSError as problem:
        raise ReadError(path, Message("cannot be read ({})", problem.strerror)) from None
    if len(data) > _MOST_BYTES:
        raise ReadError(path, f"is larger than {_MOST_BYTES // 1000} kB; the limit for a table of times")
    if b"\0" in data:
        raise ReadError(path, "is a binary file; a table of program,seconds was expected")
    text = decode_text(data)[0]
    delimiter = ";" if ";" in text.partition("\n")[0] else ","
    times: list[tuple[str, float]] = []
    for count, row in enumerate(csv.reader(io.StringIO(text), delimiter=delimiter), 1):
        cells = [cell.strip() for cell in row]
        if not any(cells):
            continue
        if len(cells) < 2 or not cells[0]:
            raise ReadError(path, f"'{printable(','.join(cells), 40)}' is not program,seconds", count)
        try:
            seconds = parse_stopwatch_time(cells[1])
        except OptionError as problem:
            if not times and count == 1:
                continue  # the header
            raise ReadError(path, str(problem), count) from None
        times.append((str(file.parent / cells[0]), seconds))
        if len(times) > _MOST_ROWS:
            raise ReadError(path, f"has more than {_MOST_ROWS} rows")
    if not times:
        raise ReadError(path, "has no row of program,seconds")
    return times
