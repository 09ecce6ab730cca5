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
from typing import Any, ClassVar, Literal, get_type_hints

from leafcut.errors import OptionError, nearest
from leafcut.units import BARE_UNIT, FACTORS, parse_point, parse_quantity


@dataclass(frozen=True)
class OptionSpec:
    """What a face needs to know about one option, beside its name and default.

    `kind` is one of ``quantity`` (a float in `unit`), ``number``, ``whole``, ``flag``, ``text``, ``names`` (a comma
    list), ``point`` (two or three lengths) and ``path``.
    """

    help: str
    kind: str
    unit: str = ""
    minimum: float | None = None
    maximum: float | None = None
    choices: tuple[str, ...] = ()
    #: The default in words, where the default value None stands for "as the algorithm recommends" and the like.
    default_words: str = ""
    #: False for what cannot change the program, such as the number of threads: it stays out of the header.
    changes_program: bool = True


def _option(kind: str, default: Any, help: str, **spec: Any) -> Any:
    return field(default=default, metadata={"option": OptionSpec(help=help, kind=kind, **spec)})


class OptionGroup:
    """Base of the option dataclasses: converts and checks every field, and knows how to describe itself."""

    #: The table of a TOML file that holds these options.
    section: ClassVar[str] = ""

    def __post_init__(self) -> None:
        for name, spec in self.specs().items():
            object.__setattr__(self, name, _convert(name, spec, getattr(self, name)))

    @classmethod
    def specs(cls) -> dict[str, OptionSpec]:
        """Return the specification of every field, by field name."""
        return {f.name: f.metadata["option"] for f in fields(cls)}  # type: ignore[arg-type]

    @classmethod
    def defaults(cls) -> dict[str, Any]:
        """Return the default of every field, by field name."""
        return {f.name: f.default for f in fields(cls)}  # type: ignore[arg-type]

    def changed(self) -> dict[str, Any]:
        """Return the options that differ from their defaults, in inner units."""
        reference = type(self)()
        return {n: getattr(self, n) for n in self.specs() if getattr(self, n) != getattr(reference, n)}


def _convert(name: str, spec: OptionSpec, value: Any) -> Any:
    if value is None:
        return None
    flag = flag_name(name)
    try:
        converted = _CONVERTERS[spec.kind](spec, value)
    except (OptionError, TypeError, ValueError, OverflowError) as problem:
        detail = str(problem) if isinstance(problem, OptionError) else f"'{value}' is not {_KIND_WORDS[spec.kind]}"
        raise OptionError(f"{flag}: {detail}") from None
    if spec.choices:
        given = converted if isinstance(converted, tuple) else (converted,)
        for word in given:
            if word not in spec.choices:
                raise OptionError(f"{flag}: unknown value '{word}'{nearest(str(word), spec.choices)}")
    _check_bounds(flag, spec, converted)
    return converted


def _check_bounds(flag: str, spec: OptionSpec, value: Any) -> None:
    if isinstance(value, str | tuple | bool | Path):
        return
    unit = f" {spec.unit}" if spec.unit else ""
    if spec.minimum is not None and value < spec.minimum:
        raise OptionError(f"{flag}: {value:g}{unit} is below the smallest value {spec.minimum:g}{unit}")
    if spec.maximum is not None and value > spec.maximum:
        raise OptionError(f"{flag}: {value:g}{unit} is above the largest value {spec.maximum:g}{unit}")


def _whole(_: OptionSpec, value: Any) -> int:
    if isinstance(value, bool) or float(value) != int(value):
        raise ValueError(value)
    return int(value)


def _number(_: OptionSpec, value: Any) -> float:
    if isinstance(value, bool):
        raise ValueError(value)
    return parse_quantity(value, "rad") if not isinstance(value, str) else _finite(float(value))


def _finite(value: float) -> float:
    if value - value != 0.0:
        raise OptionError(f"'{value}' is not a finite number")
    return value


def _flag(_: OptionSpec, value: Any) -> bool:
    if not isinstance(value, bool):
        raise ValueError(value)
    return value


def _names(_: OptionSpec, value: Any) -> tuple[str, ...]:
    words = value.split(",") if isinstance(value, str) else value
    return tuple(str(word).strip() for word in words if str(word).strip())


def _point(_: OptionSpec, value: Any) -> tuple[float, ...] | None:
    if value == "free":
        return None
    numbers = parse_point(value)
    if len(numbers) not in (2, 3):
        raise OptionError(f"'{value}' is not a point such as '10,20' or '10,20,5'")
    return numbers


def _text(_: OptionSpec, value: Any) -> str:
    if not isinstance(value, str):
        raise ValueError(value)
    return value


_CONVERTERS: dict[str, Any] = {
    "quantity": lambda spec, value: parse_quantity(value, spec.unit),
    "number": _number,
    "whole": _whole,
    "flag": _flag,
    "text": _text,
    "names": _names,
    "point": _point,
    "path": lambda _, value: Path(value),
}
_KIND_WORDS = {
    "quantity": "a number with a unit",
    "number": "a number",
    "whole": "a whole number",
    "flag": "true or false",
    "text": "a text",
    "names": "a list of names",
    "point": "a point",
    "path": "a path",
}

#: What `--algorithm` takes, in words.
ALGORITHM_TITLES = {
    "auto": "leafcut's choice: MAX–MIN ants on up to 1500 nodes, local kicks above",
    "as": "Ant System",
    "eas": "Elitist Ant System",
    "asrank": "rank-based Ant System",
    "mmas": "MAX–MIN Ant System",
    "acs": "Ant Colony System",
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

    units: str | None = _option(
        "text",
        None,
        "units of a file that does not say them",
        choices=("mm", "cm", "m", "in", "mil", "ft"),
        default_words="the file's own, else mm",
    )
    layers: tuple[str, ...] = _option(
        "names", (), "only these layers, with * and ? as wildcards", default_words="all that are on"
    )
    min_diameter: float | None = _option(
        "quantity", None, "leave out holes smaller than this", unit="mm", minimum=0, default_words="none"
    )
    max_diameter: float | None = _option(
        "quantity", None, "leave out holes larger than this", unit="mm", minimum=0, default_words="none"
    )
    merge_tolerance: float = _option(
        "quantity", 0.01, "holes of one diameter closer than this are one hole", unit="mm", minimum=0, maximum=1
    )
    concentric: str = _option(
        "text",
        "smallest",
        "which of several circles with one centre is drilled",
        choices=("smallest", "largest", "all"),
    )
    strict: bool = _option("flag", False, "refuse a file in which anything had to be skipped or repaired")


@dataclass(frozen=True)
class MachineOptions(OptionGroup):
    """Which machine, and where the part lies on it."""

    section: ClassVar[str] = "machine"

    machine: str = _option("text", "linuxcnc-mill", "name of a shipped machine, or the path of a TOML profile")
    work_offset: tuple[float, ...] | None = _option(
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

    tools: Path | None = _option(
        "path", None, "tool library, a TOML file", default_words="a drill per diameter is assumed"
    )
    depth: float | None = _option(
        "quantity",
        None,
        "depth of a blind hole below Z0",
        unit="mm",
        minimum=0.001,
        maximum=1000,
        default_words="from --thickness, else 1 mm (spotting)",
    )
    thickness: float | None = _option(
        "quantity",
        None,
        "thickness of the plate: holes go through it",
        unit="mm",
        minimum=0.001,
        maximum=1000,
        default_words="holes are not through",
    )
    depth_to: str = _option(
        "text",
        "shoulder",
        "what reaches the depth: the full diameter or the point of the drill",
        choices=("shoulder", "tip"),
    )
    break_through: float = _option(
        "quantity", 0.5, "how far below the plate a through hole goes", unit="mm", minimum=0, maximum=100
    )
    clearance_height: float = _option(
        "quantity",
        10.0,
        "initial plane: safe height over the part and its clamps",
        unit="mm",
        minimum=0.1,
        maximum=1000,
    )
    retract_height: float = _option(
        "quantity", 2.0, "R plane: where rapid becomes feed", unit="mm", minimum=0.05, maximum=1000
    )
    tool_change_height: float = _option(
        "quantity",
        25.0,
        "height for changing tools, on a machine that has no safe height of its own",
        unit="mm",
        minimum=0.1,
        maximum=1000,
    )
    retract: str = _option(
        "text", "r", "after a hole: up to the R plane (G99) or to the initial plane (G98)", choices=("r", "initial")
    )
    keep_out: tuple[str, ...] = _option(
        "names",
        (),
        "rectangles 'x0 y0 x1 y1' in mm, such as clamps: nothing is drilled there, moves cross them at the initial "
        "plane only, and the tool's radius is kept away; several with commas",
        default_words="none",
    )
    cycle: str | None = _option(
        "text",
        None,
        "cycle of every drill that the tool library says nothing of",
        choices=CYCLES,
        default_words="G83 with --peck, G82 with --dwell, else G81",
    )
    peck: float | None = _option(
        "quantity",
        None,
        "depth of one peck (Q of G83 and G73)",
        unit="mm",
        minimum=0.01,
        maximum=1000,
        default_words="no pecking",
    )
    dwell: float | None = _option(
        "quantity", None, "wait at the bottom (P of G82)", unit="s", minimum=0, maximum=100, default_words="none"
    )
    feed: float | None = _option(
        "quantity",
        None,
        "feed of assumed drills",
        unit="mm/s",
        minimum=0.001,
        default_words="0.02 diameters a revolution",
    )
    spindle_speed: float | None = _option(
        "quantity",
        None,
        "spindle speed of assumed drills",
        unit="rpm",
        minimum=1,
        default_words="20 m/min at the drill's edge",
    )
    diameter_tolerance: float = _option(
        "quantity", 0.05, "how far a tool may differ from the hole drawn", unit="mm", minimum=0, maximum=5
    )
    centre_drill: bool = _option("flag", False, "first centre every hole with the library's centre drill")
    start_point: tuple[float, ...] | None = _option(
        "point", (0.0, 0.0), "where the tool starts, x,y, or free", unit="mm"
    )
    end_point: tuple[float, ...] | None = _option(
        "point", None, "where the tool ends, x,y, or free", unit="mm", default_words="at the last hole"
    )


@dataclass(frozen=True)
class SolveOptions(OptionGroup):
    """How the order is sought."""

    section: ClassVar[str] = "solve"

    algorithm: str = _option("text", "auto", "name of an algorithm (see `leafcut algorithms`)", choices=ALGORITHMS)
    preset: str = _option(
        "text", "default", "budget of work, the same on every machine", choices=("fast", "default", "thorough")
    )
    objective: Literal["time", "distance"] = _option(
        "text", "time", "what is made small: machine seconds or millimetres of travel", choices=("time", "distance")
    )
    time_limit: float | None = _option(
        "quantity",
        None,
        "stop after this time by the clock",
        unit="s",
        minimum=0.001,
        default_words="the preset's budget of work",
    )
    iterations: int | None = _option(
        "whole", None, "stop after this many iterations", minimum=0, default_words="the preset's"
    )
    seed: int = _option("whole", 1, "start of the random numbers: same seed, same answer", minimum=0, maximum=2**32 - 1)
    threads: int = _option(
        "whole",
        0,
        "threads that ants run in; the answer does not depend on it",
        minimum=0,
        maximum=1024,
        default_words="one per core",
        changes_program=False,
    )
    candidates: int = _option(
        "whole",
        16,
        "length of each node's candidate list; 0 for all nodes, as in the first papers",
        minimum=0,
        maximum=1000,
    )
    local_search: bool = _option("flag", True, "improve every ant's tour by 2-opt and Or-opt")


@dataclass(frozen=True)
class AcoOptions(OptionGroup):
    """The parameters of the ants; each default is the one its authors recommend (`solve.aco.RECOMMENDED`)."""

    section: ClassVar[str] = "aco"

    n_ants: int | None = _option(
        "whole",
        None,
        "ants per iteration",
        minimum=1,
        maximum=1_000_000,
        default_words="one per node; 25 with local search; 10 for acs",
    )
    pheromone_weight: float = _option("number", 1.0, "weight of the pheromone (α)", minimum=0, maximum=20)
    heuristic_weight: float = _option("number", 2.0, "weight of nearness (β)", minimum=0, maximum=20)
    evaporation_rate: float | None = _option(
        "number",
        None,
        "part of the pheromone lost per iteration (ρ)",
        minimum=1e-6,
        maximum=1,
        default_words="0.5 as, eas · 0.1 asrank, acs · 0.02 mmas, 0.2 with local search",
    )
    elitist_weight: float | None = _option(
        "number", None, "deposits of the best tour so far (e of eas)", minimum=0, default_words="the number of ants"
    )
    n_ranks: int = _option("whole", 6, "ranks that deposit (w of asrank)", minimum=1, maximum=1000)
    greedy_probability: float = _option("number", 0.9, "chance to take the best edge (q0 of acs)", minimum=0, maximum=1)
    local_evaporation_rate: float = _option(
        "number", 0.1, "pheromone lost by an edge just used (ξ of acs)", minimum=0, maximum=1
    )
    best_probability: float = _option(
        "number",
        0.05,
        "chance to rebuild the best tour at convergence; sets the trail limits (p_best of mmas)",
        minimum=1e-6,
        maximum=0.999,
    )


@dataclass(frozen=True)
class PostOptions(OptionGroup):
    """How the program is written."""

    section: ClassVar[str] = "post"

    dialect: str | None = _option("text", None, "controller's dialect", default_words="the machine's own")
    output_units: str = _option("text", "mm", "units of the program", choices=("mm", "inch"))
    line_numbers: bool = _option("flag", False, "number the blocks N10, N20, …")
    program_number: int = _option("whole", 1, "number of the program, O0001", minimum=1, maximum=9999)
    header: bool = _option("flag", True, "write the comments at the top: source, options, tools, extents, time")
    date: bool = _option("flag", False, "write the date and time into the header")
    repeat_words: bool = _option("flag", False, "repeat modal words on every block")
    coolant: bool = _option("flag", False, "coolant on while drilling")


GROUPS: tuple[type[OptionGroup], ...] = (
    ReadOptions,
    MachineOptions,
    DrillOptions,
    SolveOptions,
    AcoOptions,
    PostOptions,
)


@dataclass(frozen=True)
class Settings:
    """All options of one run, one group per stage."""

    read: ReadOptions = field(default_factory=ReadOptions)
    machine: MachineOptions = field(default_factory=MachineOptions)
    drill: DrillOptions = field(default_factory=DrillOptions)
    solve: SolveOptions = field(default_factory=SolveOptions)
    aco: AcoOptions = field(default_factory=AcoOptions)
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
            group.section: group(**_as_typed(group, given.get(group.section, {}))) for group in GROUPS
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


def _as_typed(group: type[OptionGroup], given: Mapping[str, Any]) -> dict[str, Any]:
    """Return values with bare numbers as texts: ``feed = 300`` is mm/min, as ``--feed 300`` is, and not mm/s."""
    specs = group.specs()
    return {
        name: repr(float(value))
        if specs[name].kind == "quantity" and isinstance(value, int | float) and not isinstance(value, bool)
        else value
        for name, value in given.items()
    }


def written(spec: OptionSpec, value: Any) -> str:
    """Return an option's value as a person would type it, shop units included."""
    if value is None:
        return "free"
    if spec.kind == "flag":
        return ""
    if spec.kind == "quantity":
        unit = BARE_UNIT[spec.unit]
        return f"{value / FACTORS[spec.unit][unit]:.6g}{unit}"
    if spec.kind in ("names", "point"):
        return ",".join(f"{v:.6g}" if isinstance(v, float) else v for v in value)
    if spec.kind == "path":
        return str(value.name)
    return f"{value:g}" if isinstance(value, float) else str(value)


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


def option_type(group: type[OptionGroup], name: str) -> Any:
    """Return the annotated type of a field, resolved."""
    return get_type_hints(group)[name]


def flag_name(name: str) -> str:
    """Return the command line's flag for a field: ``n_ants`` → ``--n-ants``."""
    return "--" + name.replace("_", "-")


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
