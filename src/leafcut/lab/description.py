"""What an experiment is: a TOML description of inputs × options × seeds, what is measured, and how it is judged."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib import resources
from pathlib import Path
from types import MappingProxyType
from typing import Any

from leafcut.errors import OptionError, ReadError, nearest
from leafcut.files import parse_toml, toml_bytes
from leafcut.processes import registry
from leafcut.option_spec import flag_name
from leafcut.processes.base import Work
from leafcut.processes.settings import collect, why_unused

#: What a description is called where it comes with leafcut.
_SHIPPED = resources.files("leafcut.lab") / "shipped"
#: Commands that a run may be, beside those of the processes.
SOLVE, OPTIMIZE = "solve", "optimize"
#: So many runs one experiment may have, and so many seeds.
MOST_RUNS, MOST_SEEDS = 100_000, 1000
#: Measures that every run has, whatever its command: seconds by the clock, and of the processor.
WALL, PROCESSOR = "wall_s", "processor_s"

ANALYSES = ("compare", "anova", "crossed", "speedup", "trend", "pareto")


@dataclass(frozen=True)
class Instance:
    """One input: a file, ``example:plate-70`` or ``random:200``; with options of its own, and figures known of it."""

    name: str
    input: str
    options: Mapping[str, Any]
    facts: Mapping[str, float]


@dataclass(frozen=True)
class Level:
    """One value of a factor: the options that it stands for; `value` where it is a number."""

    name: str
    options: Mapping[str, Any]
    value: float | None = None


@dataclass(frozen=True)
class Factor:
    """What is varied: its levels are crossed with those of all other factors."""

    name: str
    title: str
    levels: tuple[Level, ...]

    @property
    def numeric(self) -> bool:
        """Whether every level is a number."""
        return all(level.value is not None for level in self.levels)


@dataclass(frozen=True)
class Measure:
    """A figure of a run.

    Attributes
    ----------
    path
        Where it stands in the answer of the command with ``--json``, such as ``after.time_s``; or `WALL` or `PROCESSOR`.
    scale
        The figure is multiplied by it, for another unit.
    more_is_better
        Whether the larger figure is the better one.
    """

    name: str
    title: str
    unit: str
    path: str
    scale: float = 1.0
    more_is_better: bool = False

    @property
    def heading(self) -> str:
        """Its title with its unit."""
        return f"{self.title}, {self.unit}" if self.unit else self.title


@dataclass(frozen=True)
class Analysis:
    """How a measure is judged: its kind (of `ANALYSES`), the measure, and the factors."""

    kind: str
    measure: str
    factors: tuple[str, ...] = ()
    alpha: float = 0.05
    base: str = ""
    without: tuple[str, ...] = ()


@dataclass(frozen=True)
class Published:
    """Figures of a publication: a table of texts, with where they come from and what is to be said of them."""

    title: str
    source: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""


@dataclass(frozen=True)
class RunPlan:
    """One run that is to be done: an input, a level of every factor, and a seed."""

    instance: Instance
    levels: Mapping[str, Level]
    seed: int
    options: Mapping[str, Any]

    @property
    def label(self) -> str:
        """What people are told of it."""
        return ", ".join([self.instance.name, *(level.name for level in self.levels.values()), f"seed {self.seed}"])


@dataclass(frozen=True)
class Description:
    """An experiment as its file describes it.

    Attributes
    ----------
    command
        What every run does: ``solve``, ``optimize``, or the command of a process.
    new_process
        Whether each run is a process of its own, so that the time of its start counts.
    cores
        The factor whose levels are numbers of threads; those beyond the cores of the machine are not run. Empty for none.
    """

    name: str
    title: str
    about: str
    command: str
    instances: tuple[Instance, ...]
    factors: tuple[Factor, ...]
    measures: tuple[Measure, ...]
    seeds: tuple[int, ...]
    options: Mapping[str, Any]
    analyses: tuple[Analysis, ...]
    published: tuple[Published, ...]
    source: str = ""
    notes: tuple[str, ...] = ()
    new_process: bool = False
    cores: str = ""
    reduced: bool = False
    #: The short form, as the file has it.
    short: Mapping[str, Any] = field(default_factory=dict, repr=False)

    @property
    def key(self) -> str:
        """The name under which its runs are kept; the short form has another one."""
        return f"{self.name} (reduced)" if self.reduced else self.name

    def measure(self, name: str) -> Measure:
        """Return one of its measures."""
        return next(one for one in self.measures if one.name == name)

    def factor(self, name: str) -> Factor:
        """Return one of its factors."""
        return next(one for one in self.factors if one.name == name)

    def runs(self) -> Iterator[RunPlan]:
        """Yield every run: for each seed all that differ in nothing else, so that an early end leaves whole rounds."""
        for seed in self.seeds:
            for instance in self.instances:
                for levels in itertools.product(*(factor.levels for factor in self.factors)):
                    options = {**self.options, **instance.options}
                    for level in levels:
                        options |= level.options
                    names = {factor.name: level for factor, level in zip(self.factors, levels, strict=True)}
                    yield RunPlan(instance, MappingProxyType(names), seed, MappingProxyType({**options, "seed": seed}))

    @property
    def n_runs(self) -> int:
        """How many runs there are."""
        count = len(self.seeds) * len(self.instances)
        for factor in self.factors:
            count *= len(factor.levels)
        return count

    def in_short(self) -> Description:
        """Return the short form: fewer inputs, levels and seeds, less work in each run.

        Raises
        ------
        OptionError
            The file has none.
        """
        if not self.short:
            raise OptionError(f"experiment '{self.name}' has no reduced form: its file has no table [reduced]")
        table = _Table(self.short, self.name, "reduced")
        names = table.texts("instances")
        made = replace(
            self,
            reduced=True,
            options={**self.options, **table.table("options")},
            seeds=_seeds(table) if "seeds" in self.short else self.seeds,
            instances=_chosen(self.instances, names, table, "instances"),
            factors=tuple(
                replace(one, levels=_chosen(one.levels, [*map(_word, wanted)], table, f"levels of {one.name}"))
                if (wanted := table.table("levels").get(one.name))
                else one
                for one in self.factors
            ),
        )
        over = table.table("instance_options")
        if over:
            made = replace(made, instances=tuple(replace(i, options={**i.options, **over}) for i in made.instances))
        for unknown in set(table.table("levels")) - {one.name for one in self.factors}:
            raise table.wrong(f"levels of '{unknown}', which is no factor{nearest(unknown, [f.name for f in self.factors])}")
        table.check({"options", "seeds", "instances", "levels", "instance_options"})
        _check_options(made)
        return made

    def __post_init__(self) -> None:
        if not self.n_runs:
            raise OptionError(f"experiment '{self.name}' has no run: it needs an instance, a level of each factor, a seed")
        if self.n_runs > MOST_RUNS:
            raise OptionError(f"experiment '{self.name}' has {self.n_runs} runs; at most {MOST_RUNS} are allowed")


def shipped() -> dict[str, str]:
    """Return the experiments that come with leafcut: name → title."""
    names = sorted(file.name.removesuffix(".toml") for file in _SHIPPED.iterdir() if file.name.endswith(".toml"))
    return {name: load(name).title for name in names}


def load(name: str | Path) -> Description:
    """Return an experiment by its name, or by the path of its TOML file.

    Raises
    ------
    OptionError
        There is none of this name, or it cannot be meant; with what is wrong in the file.
    ReadError
        The file cannot be read.
    """
    if str(name).lower().endswith(".toml"):
        path = Path(name)
        try:
            content = toml_bytes(path)
        except OSError as problem:
            raise ReadError(path, f"cannot be read ({problem.strerror})") from None
        return described(parse_toml(content, str(path)), path.stem, path.parent)
    file = _SHIPPED / f"{name}.toml"
    if not re.fullmatch(r"[A-Za-z0-9_-]+", str(name)) or not file.is_file():
        known = [one.name.removesuffix(".toml") for one in _SHIPPED.iterdir() if one.name.endswith(".toml")]
        raise OptionError(f"unknown experiment '{name}'{nearest(str(name), sorted(known))}; or give a TOML file")
    return described(parse_toml(file.read_bytes(), str(name)), str(name), None)


def described(content: Mapping[str, Any], name: str, folder: Path | None) -> Description:
    """Return the experiment that a TOML text describes; files that it names are sought from `folder`.

    Without a folder they are those that come with leafcut.

    Raises
    ------
    OptionError
        A key or a name in it is unknown, a value of another type, or there is nothing to run.
    """
    table = _Table(content, name, "")
    table.check(
        {"title", "about", "source", "command", "new_process", "cores", "seeds", "options", "instance", "factor"}
        | {"measure", "analysis", "published", "notes", "reduced"}
    )
    command = table.text("command", OPTIMIZE)
    commands = [SOLVE, OPTIMIZE, *(one.command for one in registry.processes())]
    if command not in commands:
        raise table.wrong(f"unknown command '{command}'{nearest(command, commands)}")
    factors = tuple(_factor(one, name) for one in table.tables("factor"))
    made = Description(
        name=name,
        title=table.text("title", name),
        about=" ".join(table.text("about", "").split()),
        command=command,
        instances=tuple(_instance(one, folder) for one in table.list_of_tables("instance")),
        factors=factors,
        measures=tuple(_measure(one) for one in table.tables("measure")),
        seeds=_seeds(table),
        options=table.table("options"),
        analyses=(),
        published=tuple(_published(one) for one in table.list_of_tables("published")),
        source=table.text("source", ""),
        notes=tuple(table.texts("notes")),
        new_process=table.flag("new_process"),
        cores=table.text("cores", ""),
        short=table.table("reduced"),
    )
    if not made.measures:
        raise table.wrong("no table [measure.NAME]: say what is measured, such as path = \"after.time_s\"")
    for what, names in (("instance", [i.name for i in made.instances]), ("factor", [f.name for f in factors])):
        if double := next((one for one in names if names.count(one) > 1), None):
            raise table.wrong(f"two {what}s are called '{double}'")
    if made.cores and made.cores not in [one.name for one in factors if one.numeric]:
        raise table.wrong(f"cores = '{made.cores}' is no factor whose levels are numbers")
    made = replace(made, analyses=tuple(_analysis(one, made) for one in table.list_of_tables("analysis")))
    _check_options(made)
    if made.short:
        made.in_short()
    return made


def _instance(table: _Table, folder: Path | None) -> Instance:
    table.check({"name", "input", "options", "facts"})
    source = table.text("input")
    if not re.match(r"[a-z]+:", source):
        source = str((folder if folder is not None else Path(str(resources.files("leafcut.lab") / "parts"))) / source)
    facts = {name: table.as_number(f"facts.{name}", value) for name, value in table.table("facts").items()}
    return Instance(table.text("name", Path(source).stem), source, table.table("options"), facts)


def _factor(table: _Table, experiment: str) -> Factor:
    table.check({"title", "option", "levels", "level"})
    option, levels = table.text("option", ""), table.content.get("levels", [])
    named = [Level(name, options, None) for name, options in table.dicts("level").items()]
    if bool(option) != bool(levels) or bool(levels) == bool(named) or not isinstance(levels, list):
        raise table.wrong("give option = and levels = [...], or tables level.NAME of options")
    simple = [Level(_word(one), {option: one}, _number(one)) for one in levels]
    made = tuple(named or simple)
    if len({one.name for one in made}) < len(made):
        raise table.wrong("two levels are the same")
    return Factor(table.name, table.text("title", table.name), made)


def _measure(table: _Table) -> Measure:
    table.check({"title", "unit", "path", "scale", "more_is_better"})
    return Measure(
        table.name,
        table.text("title", table.name),
        table.text("unit", ""),
        table.text("path"),
        table.as_number("scale", table.content.get("scale", 1.0)),
        table.flag("more_is_better"),
    )


def _analysis(table: _Table, of: Description) -> Analysis:
    table.check({"kind", "measure", "factors", "alpha", "base", "without"})
    kind, measure = table.text("kind"), table.text("measure", of.measures[0].name)
    factors = table.texts("factors") or [one.name for one in of.factors]
    alpha = table.as_number("alpha", table.content.get("alpha", 0.05))
    known = {
        "kind": (kind, ANALYSES),
        "measure": (measure, [one.name for one in of.measures]),
        **{f"factor {one}": (one, [f.name for f in of.factors]) for one in factors},
    }
    for what, (word, words) in known.items():
        if word not in words:
            raise table.wrong(f"unknown {what.split()[0]} '{word}'{nearest(word, words)}")
    if not 0.0 < alpha < 0.5:
        raise table.wrong(f"alpha = {alpha:g} is out of range; choose a number between 0 and 0.5")
    needed = {"anova": 1, "compare": 1, "crossed": 2, "speedup": 1}.get(kind)
    if needed is not None and len(factors) != needed:
        raise table.wrong(f"'{kind}' is of {needed} factor{'s' * (needed > 1)}; {len(factors)} given")
    base = table.text("base", "")
    if base and base not in [one.name for f in factors for one in of.factor(f).levels]:
        raise table.wrong(f"base '{base}' is no level of {', '.join(factors)}")
    without = tuple(table.texts("without"))
    for one in without:
        if one not in [instance.name for instance in of.instances]:
            raise table.wrong(f"unknown instance '{one}'{nearest(one, [i.name for i in of.instances])}")
    if kind == "pareto" and len(of.measures) < 2:
        raise table.wrong("'pareto' needs two measures")
    return Analysis(kind, measure, tuple(factors), alpha, base, without)


def _published(table: _Table) -> Published:
    table.check({"title", "source", "columns", "rows", "note"})
    columns, rows = table.texts("columns"), table.content.get("rows", [])
    if not isinstance(rows, list) or any(not isinstance(row, list) or len(row) != len(columns) for row in rows):
        raise table.wrong(f"each of the rows needs {len(columns)} values, as many as there are columns")
    told = tuple(tuple(_word(value) for value in row) for row in rows)
    return Published(table.text("title"), table.text("source", ""), tuple(columns), told, table.text("note", ""))


def _seeds(table: _Table) -> tuple[int, ...]:
    """Return the seeds: those listed, or 1 to a number of them."""
    given = table.content.get("seeds", 1)
    listed = list(range(1, given + 1)) if type(given) is int and 0 < given <= MOST_SEEDS else given
    if not isinstance(listed, list) or not listed or any(type(one) is not int or one < 0 for one in listed):
        raise table.wrong(f"seeds: give how many, 1 to {MOST_SEEDS}, or a list of whole numbers from 0 on")
    if len(set(listed)) < len(listed) or len(listed) > MOST_SEEDS:
        raise table.wrong(f"seeds: each once, and at most {MOST_SEEDS} of them")
    return tuple(listed)


def _chosen(of: Sequence[Any], names: Sequence[str], table: _Table, what: str) -> tuple[Any, ...]:
    """Return those of some named things that are wanted; all, where none is named."""
    known = [one.name for one in of]
    for name in names:
        if name not in known:
            raise table.wrong(f"{what}: unknown '{name}'{nearest(name, known)}")
    return tuple(one for one in of if not names or one.name in names)


def _check_options(made: Description) -> None:
    """Refuse options that do not exist, have a value that cannot be, or are used by nothing that the command does."""
    used = _work(made.command)
    seen = set()
    for run in made.runs():
        shape = (run.instance.name, *(level.name for level in run.levels.values()))
        if shape in seen:
            break
        seen.add(shape)
        try:
            collect(run.options)
            for name in run.options:
                if used is not None and name not in used.used():
                    raise OptionError(f"{flag_name(name)}: {why_unused(name, used.title, used.otherwise.get(name, ''))}")
        except OptionError as problem:
            raise OptionError(f"experiment '{made.name}', {run.label}: {problem}") from None


def _work(command: str) -> Work | None:
    """Return the kind of work that a command does; None where its input decides."""
    if command == SOLVE:
        return registry.work(SOLVE)
    return next((one for one in registry.processes() if one.command == command), None)


def _word(value: Any) -> str:
    """Return a level or a figure as people write it."""
    return f"{value:g}" if isinstance(value, float) else str(value)


def _number(value: Any) -> float | None:
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None


@dataclass(frozen=True)
class _Table:
    """A table of the file, and where it stands: takes what is of the right type and refuses what is not."""

    content: Mapping[str, Any]
    experiment: str
    place: str

    @property
    def name(self) -> str:
        """The last part of where it stands."""
        return self.place.rpartition(".")[2]

    def wrong(self, words: str) -> OptionError:
        """Return the refusal of what is wrong here."""
        return OptionError(f"experiment '{self.experiment}'{f', [{self.place}]' if self.place else ''}: {words}")

    def check(self, known: set[str]) -> None:
        """Refuse keys that are not known."""
        for key in self.content:
            if key not in known:
                raise self.wrong(f"unknown key '{key}'{nearest(key, sorted(known))}")

    def text(self, key: str, default: str | None = None) -> str:
        """Return a text; without a default there must be one."""
        value = self.content.get(key, default)
        if not isinstance(value, str):
            raise self.wrong(f"{key}: a text is needed" + ("" if value is None else f", not {value!r}"))
        return value

    def flag(self, key: str) -> bool:
        """Return true or false."""
        value = self.content.get(key, False)
        if not isinstance(value, bool):
            raise self.wrong(f"{key}: give true or false, not {value!r}")
        return value

    def as_number(self, key: str, value: Any) -> float:
        """Return a value that must be a number."""
        number = _number(value)
        if number is None:
            raise self.wrong(f"{key}: a number is needed, not {value!r}")
        return number

    def texts(self, key: str) -> list[str]:
        """Return a list of texts, or of numbers as texts."""
        value = self.content.get(key, [])
        if not isinstance(value, list) or any(isinstance(one, dict | list) for one in value):
            raise self.wrong(f"{key}: a list of texts is needed")
        return [_word(one) for one in value]

    def table(self, key: str) -> dict[str, Any]:
        """Return a table as it is."""
        value = self.content.get(key, {})
        if not isinstance(value, dict):
            raise self.wrong(f"{key}: a table is needed")
        return value

    def dicts(self, key: str) -> dict[str, dict[str, Any]]:
        """Return a table of tables."""
        found = self.table(key)
        for name, one in found.items():
            if not isinstance(one, dict):
                raise self.wrong(f"{key}.{name}: a table is needed")
        return found

    def tables(self, key: str) -> list[_Table]:
        """Return the tables of a table, in their order."""
        return [_Table(one, self.experiment, f"{key}.{name}") for name, one in self.dicts(key).items()]

    def list_of_tables(self, key: str) -> list[_Table]:
        """Return the tables of a list of them."""
        value = self.content.get(key, [])
        if not isinstance(value, list) or any(not isinstance(one, dict) for one in value):
            raise self.wrong(f"{key}: tables [[{key}]] are needed")
        return [_Table(one, self.experiment, f"{key} {k}") for k, one in enumerate(value, 1)]
