"""Options: one frozen dataclass per stage, one definition for five faces.

`AcoOptions.n_ants` is the flag `--n-ants`, the key `n_ants` under `[aco]` in a TOML file, the keyword `n_ants` of
`leafcut.optimize`, and an entry of the studio's form: all are made from the fields below. Values are checked and
converted to inner units when an object is made, so no stage checks again.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, ClassVar, Literal

from leafcut.errors import OptionError, nearest
from leafcut.option_spec import OptionGroup, OptionSpec, flag_name, option, written

#: What `--algorithm` takes, in words.
ALGORITHM_TITLES = {
    "auto": "leafcut's choice: the colony",
    "colony": "ants that improve tours of their own (Lin–Kernighan), then follow each other's trails (edge assembly)",
    "as": "Ant System",
    "eas": "Elitist Ant System",
    "asrank": "rank-based Ant System",
    "mmas": "MAX–MIN Ant System",
    "acs": "Ant Colony System",
    "firefly": "discrete firefly algorithm: orders fly towards shorter ones",
    "kicks": "one tour, kicked at one place at a time and mended by exchanges of up to five edges (Lin–Kernighan)",
    "2opt": "nearest neighbour, improved by 2-opt and Or-opt",
    "nn": "nearest neighbour",
    "none": "the order of the drawing",
}
ALGORITHMS = tuple(ALGORITHM_TITLES)
CYCLES = ("G81", "G82", "G83", "G73", "G84", "G85")


@dataclass(frozen=True)
class ReadOptions(OptionGroup):
    """What to take from a file."""

    section: ClassVar[str] = "read"

    units: str | None = option(
        "text",
        None,
        "units of a file that does not say them",
        choices=("mm", "cm", "m", "in", "mil", "ft"),
        default_words="the file's own, else mm",
    )
    layers: tuple[str, ...] = option(
        "names", (), "only these layers, with * and ? as wildcards", default_words="all that are on"
    )
    min_diameter: float | None = option(
        "quantity", None, "leave out holes smaller than this", unit="mm", minimum=0, default_words="none"
    )
    max_diameter: float | None = option(
        "quantity", None, "leave out holes larger than this", unit="mm", minimum=0, default_words="none"
    )
    merge_tolerance: float = option(
        "quantity", 0.01, "holes of one diameter closer than this are one hole", unit="mm", minimum=0, maximum=1
    )
    concentric: str = option(
        "text",
        "smallest",
        "which of several circles with one centre is drilled",
        choices=("smallest", "largest", "all"),
    )
    strict: bool = option("flag", False, "refuse a file in which anything had to be skipped or repaired")


@dataclass(frozen=True)
class MachineOptions(OptionGroup):
    """Which machine, and where the part lies on it."""

    section: ClassVar[str] = "machine"

    machine: str = option("text", "linuxcnc-mill", "name of a shipped machine, or the path of a TOML profile")
    work_offset: tuple[float, ...] | None = option(
        "point",
        None,
        "program zero in machine coordinates, x,y,z",
        unit="mm",
        default_words="the machine's own, else unknown",
    )


@dataclass(frozen=True)
class DrillOptions(OptionGroup):
    """How holes become drilling operations."""

    section: ClassVar[str] = "drill"

    tools: Path | None = option(
        "path", None, "tool library, a TOML file", default_words="a drill per diameter is assumed"
    )
    depth: float | None = option(
        "quantity",
        None,
        "depth of a blind hole below Z0",
        unit="mm",
        minimum=0.001,
        maximum=1000,
        default_words="from --thickness, else 1 mm (spotting)",
    )
    thickness: float | None = option(
        "quantity",
        None,
        "thickness of the plate: holes go through it",
        unit="mm",
        minimum=0.001,
        maximum=1000,
        default_words="holes are not through",
    )
    depth_to: str = option(
        "text",
        "shoulder",
        "what reaches the depth: the full diameter or the point of the drill",
        choices=("shoulder", "tip"),
    )
    break_through: float = option(
        "quantity", 0.5, "how far below the plate a through hole goes", unit="mm", minimum=0, maximum=100
    )
    clearance_height: float = option(
        "quantity",
        10.0,
        "initial plane: safe height over the part and its clamps",
        unit="mm",
        minimum=0.1,
        maximum=1000,
    )
    retract_height: float = option(
        "quantity", 2.0, "R plane: where rapid becomes feed", unit="mm", minimum=0.05, maximum=1000
    )
    tool_change_height: float = option(
        "quantity",
        25.0,
        "height for changing tools, on a machine that has no safe height of its own",
        unit="mm",
        minimum=0.1,
        maximum=1000,
    )
    retract: str = option(
        "text", "r", "after a hole: up to the R plane (G99) or to the initial plane (G98)", choices=("r", "initial")
    )
    keep_out: tuple[str, ...] = option(
        "names",
        (),
        "rectangles 'x0 y0 x1 y1' in mm, such as clamps: nothing is drilled there, moves cross them at the initial "
        "plane only, and the tool's radius is kept away; several with commas",
        default_words="none",
    )
    cycle: str | None = option(
        "text",
        None,
        "cycle of every drill that the tool library says nothing of",
        choices=CYCLES,
        default_words="G83 with --peck, G82 with --dwell, else G81",
    )
    peck: float | None = option(
        "quantity",
        None,
        "depth of one peck (Q of G83 and G73)",
        unit="mm",
        minimum=0.01,
        maximum=1000,
        default_words="no pecking",
    )
    dwell: float | None = option(
        "quantity", None, "wait at the bottom (P of G82)", unit="s", minimum=0, maximum=100, default_words="none"
    )
    feed: float | None = option(
        "quantity",
        None,
        "feed of assumed drills",
        unit="mm/s",
        minimum=0.001,
        default_words="0.02 diameters a revolution",
    )
    spindle_speed: float | None = option(
        "quantity",
        None,
        "spindle speed of assumed drills",
        unit="rpm",
        minimum=1,
        default_words="20 m/min at the drill's edge",
    )
    diameter_tolerance: float = option(
        "quantity", 0.05, "how far a tool may differ from the hole drawn", unit="mm", minimum=0, maximum=5
    )
    centre_drill: bool = option("flag", False, "first centre every hole with the library's centre drill")
    start_point: tuple[float, ...] | None = option(
        "point", (0.0, 0.0), "where the tool starts, x,y, or free", unit="mm"
    )
    end_point: tuple[float, ...] | None = option(
        "point", None, "where the tool ends, x,y, or free", unit="mm", default_words="at the last hole"
    )


@dataclass(frozen=True)
class ResequenceOptions(OptionGroup):
    """How a program of another CAM is put in order."""

    section: ClassVar[str] = "resequence"

    merge_tools: bool = option("flag", False, "join separated sections of one tool, where nothing forbids it")
    allow_reverse: bool = option(
        "flag",
        False,
        "cut open lines of one depth from either end (slots, engraving, laser), where neither climb milling nor a "
        "lead-in matters; the tool may then go down at what was the end",
    )
    keep_order: bool = option("flag", False, "leave the program as it is, and only measure it")
    renumber: bool = option("flag", False, "give the blocks new N-numbers, in steps of 10")


@dataclass(frozen=True)
class SolveOptions(OptionGroup):
    """How the order is sought."""

    section: ClassVar[str] = "solve"

    algorithm: str = option("text", "auto", "name of an algorithm (see `leafcut algorithms`)", choices=ALGORITHMS)
    preset: str = option(
        "text",
        "default",
        "budget of work, the same on every machine; the search ends sooner when the colonies agree",
        choices=("fast", "default", "thorough"),
    )
    objective: Literal["time", "distance"] = option(
        "text", "time", "what is made small: machine seconds or millimetres of travel", choices=("time", "distance")
    )
    time_limit: float | None = option(
        "quantity",
        None,
        "stop after this time by the clock, or sooner, when five colonies in a row find nothing better",
        unit="s",
        minimum=0.001,
        default_words="the preset's budget of work",
    )
    iterations: int | None = option(
        "whole", None, "stop after this many iterations", minimum=0, default_words="the preset's"
    )
    target_gap: float | None = option(
        "percent",
        None,
        "stop at this gap to the lower bound, in percent; it is found first",
        minimum=0,
        default_words="none",
    )
    bound: bool = option(
        "flag", True, "find a lower bound and tell the gap to it, outside the time limit", changes_program=False
    )
    seed: int = option("whole", 1, "start of the random numbers: same seed, same answer", minimum=0, maximum=2**32 - 1)
    threads: int = option(
        "whole",
        0,
        "threads that ants run in; the answer does not depend on it",
        minimum=0,
        maximum=1024,
        default_words="one per core",
        changes_program=False,
    )
    candidates: int | None = option(
        "whole",
        None,
        "length of each node's candidate list; 0 for all nodes, as in the first papers",
        minimum=0,
        maximum=1000,
        default_words="8 for colony and kicks, else 16",
    )
    local_search: bool = option("flag", True, "improve every ant's tour by 2-opt and Or-opt")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.target_gap is not None and not self.bound:
            raise OptionError("--target-gap needs the lower bound; leave out --no-bound")


@dataclass(frozen=True)
class AcoOptions(OptionGroup):
    """The parameters of the ants; each default is the one its authors recommend (`solve.aco.RECOMMENDED`)."""

    section: ClassVar[str] = "aco"

    n_ants: int | None = option(
        "whole",
        None,
        "ants per iteration",
        minimum=1,
        maximum=1_000_000,
        default_words="one per node; 25 with local search; 10 for acs",
    )
    pheromone_weight: float = option("number", 1.0, "weight of the pheromone (α)", minimum=0, maximum=20)
    heuristic_weight: float = option("number", 2.0, "weight of nearness (β)", minimum=0, maximum=20)
    evaporation_rate: float | None = option(
        "number",
        None,
        "part of the pheromone lost per iteration (ρ)",
        minimum=1e-6,
        maximum=1,
        default_words="0.5 as, eas · 0.1 asrank, acs · 0.02 mmas, 0.2 with local search",
    )
    elitist_weight: float | None = option(
        "number", None, "deposits of the best tour so far (e of eas)", minimum=0, default_words="the number of ants"
    )
    n_ranks: int = option("whole", 6, "ranks that deposit (w of asrank)", minimum=1, maximum=1000)
    greedy_probability: float = option("number", 0.9, "chance to take the best edge (q0 of acs)", minimum=0, maximum=1)
    local_evaporation_rate: float = option(
        "number", 0.1, "pheromone lost by an edge just used (ξ of acs)", minimum=0, maximum=1
    )
    best_probability: float = option(
        "number",
        0.05,
        "chance to rebuild the best tour at convergence; sets the trail limits (p_best of mmas)",
        minimum=1e-6,
        maximum=0.999,
    )


@dataclass(frozen=True)
class FireflyOptions(OptionGroup):
    """The parameters of the fireflies."""

    section: ClassVar[str] = "firefly"

    n_fireflies: int = option("whole", 20, "fireflies in the swarm", minimum=1, maximum=10_000)
    attractiveness: float = option(
        "number", 1.0, "share of its steps that a brighter order gives one beside it (β0)", minimum=0, maximum=1
    )
    absorption: float = option(
        "number",
        0.05,
        "how fast that falls with the distance of two orders (γ): ten when no step is the same",
        minimum=0,
        maximum=100,
    )
    random_moves: int = option(
        "whole", 2, "clusters that move at random after every flight (α)", minimum=0, maximum=1000
    )


@dataclass(frozen=True)
class PostOptions(OptionGroup):
    """How the program is written."""

    section: ClassVar[str] = "post"

    dialect: str | None = option("text", None, "controller's dialect", default_words="the machine's own")
    output_units: str = option("text", "mm", "units of the program", choices=("mm", "inch"))
    line_numbers: bool = option("flag", False, "number the blocks N10, N20, …")
    program_number: int = option("whole", 1, "number of the program, O0001", minimum=1, maximum=9999)
    header: bool = option("flag", True, "write the comments at the top: source, options, tools, extents, time")
    date: bool = option("flag", False, "write the date and time into the header")
    repeat_words: bool = option("flag", False, "repeat modal words on every block")
    coolant: bool = option("flag", False, "coolant on while drilling")


GROUPS: tuple[type[OptionGroup], ...] = (
    ReadOptions,
    MachineOptions,
    DrillOptions,
    ResequenceOptions,
    SolveOptions,
    AcoOptions,
    FireflyOptions,
    PostOptions,
)


@dataclass(frozen=True)
class Settings:
    """All options of one run, one group per stage."""

    read: ReadOptions = field(default_factory=ReadOptions)
    machine: MachineOptions = field(default_factory=MachineOptions)
    drill: DrillOptions = field(default_factory=DrillOptions)
    resequence: ResequenceOptions = field(default_factory=ResequenceOptions)
    solve: SolveOptions = field(default_factory=SolveOptions)
    aco: AcoOptions = field(default_factory=AcoOptions)
    firefly: FireflyOptions = field(default_factory=FireflyOptions)
    post: PostOptions = field(default_factory=PostOptions)

    @classmethod
    def collect(cls, values: Mapping[str, Any], file: Path | None = None) -> Settings:
        """Return the settings of a TOML `file` (if any), overridden by `values`.

        `values` maps option names to values; None stands for "not given". A number without a unit means the same
        here, in the file and on the command line (`units.BARE_UNIT`).

        Raises
        ------
        OptionError
            An unknown name (the nearest known one is named), or a value out of its bounds.
        """
        given = {group.section: dict(table) for group, table in _file_tables(file)} if file else {}
        for name, value in values.items():
            if value is not None:
                given.setdefault(group_of(name).section, {})[name] = value
        made: dict[str, Any] = {
            group.section: group(**group.as_typed(given.get(group.section, {}))) for group in GROUPS
        }
        return cls(**made)

    def changed(self) -> dict[str, str]:
        """Return every option that is not at its default and can change the program: flag → value as one types it."""
        return {
            flag_name(name if value is not False else f"no_{name}"): written(group.specs()[name], value)
            for group in (getattr(self, f.name) for f in fields(self))
            for name, value in group.changed().items()
            if group.specs()[name].changes_program
        }


def all_options() -> Iterator[tuple[type[OptionGroup], str, OptionSpec]]:
    """Yield every option as (group, name, specification), in the order of the stages."""
    for group in GROUPS:
        for name, spec in group.specs().items():
            yield group, name, spec


def group_of(name: str) -> type[OptionGroup]:
    """Return the group that holds the option `name`, or raise `OptionError` with the nearest name."""
    names = {option: group for group, option, _ in all_options()}
    if name not in names:
        raise OptionError(f"unknown option '{name}'{nearest(name, names)}")
    return names[name]


def _file_tables(file: Path) -> Iterator[tuple[type[OptionGroup], dict[str, Any]]]:
    try:
        data = tomllib.loads(file.read_text(encoding="utf-8"))
    except OSError as problem:
        raise OptionError(f"{file}: cannot be read ({problem.strerror})") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as problem:
        raise OptionError(f"{file}: not a TOML file ({problem})") from None
    sections = {group.section: group for group in GROUPS}
    for section, table in data.items():
        if section not in sections:
            raise OptionError(f"{file}: unknown table [{section}]{nearest(section, sections)}")
        if not isinstance(table, dict):
            raise OptionError(f"{file}: '{section}' is not a table; write [{section}]")
        for name in table:
            if name not in sections[section].specs():
                raise OptionError(
                    f"{file}: unknown option '{name}' in [{section}]{nearest(name, sections[section].specs())}"
                )
        yield sections[section], table
