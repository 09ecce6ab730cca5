"""Options for reordering a program from another CAM system."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from leafcut.options import FeedOptions, Settings, flag_name
from leafcut.options.option_spec import OptionGroup, option


@dataclass(frozen=True)
class ResequenceOptions(OptionGroup):
    """Options for reordering a program from another CAM system."""

    section: ClassVar[str] = "resequence"
    title: ClassVar[str] = "Reordering"

    merge_tools: bool = option("flag", False, "merge sections of the same tool where it is safe", of_file=True)
    allow_reverse: bool = option(
        "flag",
        False,
        "cut open paths of constant depth from either end; only if climb milling and lead-ins do not matter (slots, "
        "engraving, laser)",
        of_file=True,
    )
    mix_operations: bool = option(
        "flag",
        False,
        "reorder across operations that the program's comments separate; cuts that detach a part stay after all "
        "earlier work",
        of_file=True,
    )
    air: bool = option(
        "flag",
        False,
        "replace feed moves in air by rapids where the stock shows that they stay clear of all material",
        of_file=True,
    )
    low_retracts: bool = option(
        "flag",
        False,
        "lower retracts and R planes to just above the material below each move; needs --workpiece, and --keep-out for "
        "clamps",
        of_file=True,
    )


def pace_flags(settings: Settings) -> list[str]:
    """Return the command-line flags that request new speeds or heights."""
    options, feeds = settings.of(ResequenceOptions), settings.of(FeedOptions).feeds
    wanted = {"air": options.air, "feeds": feeds, "low_retracts": options.low_retracts}
    return [flag_name(name) for name, wants in wanted.items() if wants]
