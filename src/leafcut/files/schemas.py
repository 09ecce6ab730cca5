"""Schema numbers (format versions) of leafcut's documents, and the versions that leafcut can read.

See docs/schemas.md.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from leafcut.errors import DataError, printable
from leafcut.message import Message


@dataclass(frozen=True)
class Schema:
    """The schema numbers of one kind of document.

    leafcut writes `current`, and reads all versions since `oldest`. A document without a number is treated as
    `current`.

    Attributes
    ----------
    title
        Kind of document, for messages.
    current
        Schema number that leafcut writes.
    oldest
        Oldest schema number that leafcut can read.
    key
        Name of the field with the schema number.
    """

    title: str
    current: int = 1
    oldest: int = 1
    key: str = "schema"

    @property
    def toml_line(self) -> str:
        """The TOML line that states the current schema."""
        return f"{self.key} = {self.current}"


#: The output of a command with --json, and of the studio's JSON interface.
ANSWER = Schema("JSON answer")
OPTIONS = Schema(Message("file of options"))
MACHINE = Schema(Message("machine profile"))
OPERATIONS = Schema(Message("file of operations"))
#: The file of `leafcut machine new --answers`.
MACHINE_ANSWERS = Schema("file of answers")
TOOLS = Schema(Message("tool library"))
MATERIAL = Schema("material")
DIALECT = Schema(Message("dialect"))
EXPERIMENT = Schema("experiment")
PLAN = Schema(Message("plan file"), key="leafcut_plan")
ORDER = Schema(Message("order file"), key="leafcut_order")
#: Results file of experiments (SQLite; the number is its user_version).
RESULTS = Schema("results file")
#: The stored jobs of the studio (SQLite; the number is its user_version).
HISTORY = Schema("job history", current=2)

SCHEMAS = (
    ANSWER, OPTIONS, OPERATIONS, MACHINE, MACHINE_ANSWERS, TOOLS, MATERIAL, DIALECT, EXPERIMENT, PLAN, ORDER, RESULTS,
    HISTORY,
)  # fmt: skip


def add_schema_number(schema: Schema, document: Mapping[str, Any]) -> dict[str, Any]:
    """Put the schema number first in a document. An existing number is kept."""
    return {schema.key: schema.current, **document}


def check_schema(schema: Schema, number: Any, place: str) -> None:
    """Check that this version of leafcut can read the schema of a document, and warn if the schema is old.

    Messages use `place` as the name of the file. The function raises `DataError` if the number is too new, too old, or
    not a whole number of 1 or more.
    """
    if type(number) is not int or number < 1:
        raise DataError(
            "{}: '{}' is {}, but must be a whole number of 1 or more", place, schema.key, printable(repr(number))
        )
    if number > schema.current:
        raise DataError(
            "{}: '{}' is {}, but the newest {} that this version reads has {}; upgrade leafcut",
            place,
            schema.key,
            number,
            schema.title,
            schema.current,
        )
    if number < schema.oldest:
        raise DataError(
            "{}: '{}' is {}, but the oldest {} that this version reads has "
            "{}; write the file again, or use an older leafcut",
            place,
            schema.key,
            number,
            schema.title,
            schema.oldest,
        )
    if number < schema.current:
        warnings.warn(
            f"{place}: '{schema.key}' is {number}, but a current {schema.title} has {schema.current}; "
            "a later leafcut will refuse this file",
            FutureWarning,
            stacklevel=2,
        )
