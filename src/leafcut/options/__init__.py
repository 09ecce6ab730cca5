"""Options shared by several processes: each option is defined once, in a frozen dataclass, for five interfaces.

`AcoOptions.n_ants` is the flag `--n-ants`, the key `n_ants` under `[aco]` in a TOML file, the keyword `n_ants` of
`leafcut.optimize`, a field of the studio's form, and an entry of the reference: all are derived from the fields below.
Values are checked and converted to internal units when an object is created, so that no later stage checks them.
Options of a single process are in the package of that process.
"""

from __future__ import annotations

from leafcut.options.cutting import CutDataOptions, FeedOptions, MillingOptions, SpeedOptions, StockOptions
from leafcut.options.drawings import ORIGINS, PocketDrawingOptions, ReadOptions, SheetOptions
from leafcut.options.job import CYCLES, JobOptions, MachineOptions, PostOptions
from leafcut.options.option_spec import OptionGroup, flag_name
from leafcut.options.quote import QuoteOptions
from leafcut.options.search import (
    ALGORITHM_GROUP,
    ALGORITHM_TITLES,
    ALGORITHMS,
    ANT_ALGORITHMS,
    LITERATURE,
    AcoOptions,
    FireflyOptions,
    SolveOptions,
)
from leafcut.options.settings import Settings

#: Groups shared by processes, in display order.
SHARED: tuple[type[OptionGroup], ...] = (
    ReadOptions,
    SheetOptions,
    MachineOptions,
    JobOptions,
    CutDataOptions,
    PocketDrawingOptions,
    MillingOptions,
    SolveOptions,
    AcoOptions,
    FireflyOptions,
    PostOptions,
    StockOptions,
    FeedOptions,
    SpeedOptions,
    QuoteOptions,
)

__all__ = [
    "ALGORITHMS",
    "ALGORITHM_GROUP",
    "ALGORITHM_TITLES",
    "ANT_ALGORITHMS",
    "CYCLES",
    "LITERATURE",
    "ORIGINS",
    "SHARED",
    "AcoOptions",
    "CutDataOptions",
    "FeedOptions",
    "FireflyOptions",
    "JobOptions",
    "MachineOptions",
    "MillingOptions",
    "PocketDrawingOptions",
    "PostOptions",
    "QuoteOptions",
    "ReadOptions",
    "Settings",
    "SheetOptions",
    "SolveOptions",
    "SpeedOptions",
    "StockOptions",
    "flag_name",
]
