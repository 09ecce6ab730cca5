"""Options: one frozen dataclass per stage, one definition for five faces.

`AcoOptions.n_ants` is the flag `--n-ants`, the key `n_ants` under `[aco]` in a TOML file, the keyword `n_ants` of
`leafcut.optimize`, and an entry of the studio's form: all are made from the fields below. Values are checked and
converted to inner units when an object is made, so no stage checks again.
"""

from __future__ import annotations

from leafcut.option_spec import flag_name
from leafcut.options.cutting import CutOptions
from leafcut.options.drawings import ORIGINS, ReadOptions, SheetOptions
from leafcut.options.machining import CYCLES, DrillOptions, MachineOptions
from leafcut.options.nests import LARGEST_SHEET, NestOptions, SheetWord, parse_angles, parse_sheet
from leafcut.options.pockets import PocketOptions
from leafcut.options.programs import PostOptions, ResequenceOptions
from leafcut.options.search import ALGORITHM_TITLES, ALGORITHMS, AcoOptions, FireflyOptions, SolveOptions
from leafcut.options.settings import GROUPS, Settings, all_options, group_of, options_of_file
from leafcut.options.usage import settings_for, used_by

__all__ = [
    "ALGORITHMS",
    "ALGORITHM_TITLES",
    "CYCLES",
    "GROUPS",
    "LARGEST_SHEET",
    "ORIGINS",
    "AcoOptions",
    "CutOptions",
    "DrillOptions",
    "FireflyOptions",
    "MachineOptions",
    "NestOptions",
    "PocketOptions",
    "PostOptions",
    "ReadOptions",
    "ResequenceOptions",
    "Settings",
    "SheetOptions",
    "SheetWord",
    "SolveOptions",
    "all_options",
    "flag_name",
    "group_of",
    "options_of_file",
    "parse_angles",
    "parse_sheet",
    "settings_for",
    "used_by",
]
