"""Description of an experiment: a TOML file with inputs × options × seeds, responses and analyses."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

from leafcut.errors import OptionError

#: Commands of a run that belong to no process.
SOLVE, OPTIMIZE = "solve", "optimize"
#: Maximum number of runs of an experiment, and of seeds.
MAX_RUNS, MAX_SEEDS = 100_000, 1000
#: Responses that every run has, whatever its command: wall-clock time and processor time, s.
WALL, PROCESSOR = "wall_s", "processor_s"
#: Responses of the searches of a run: processor time and wall-clock time, s; the best cost; the best cost of their own
#: tours, without a first tour that was given to them.
SEARCH = "search"
#: Response of every program: time of its rapid moves, with retracts, s.
RAPID = "rapid_s"
#: Responses that measure computing time, not machine time.
TIMES = (WALL, PROCESSOR, "seconds", f"{SEARCH}.processor_s", f"{SEARCH}.seconds")

ANALYSES = ("compare", "anova", "crossed", "speedup", "trend", "pareto", "projection")


@dataclass(frozen=True)
class LabInstance:
    """One input (a file, ``example:plate-70`` or ``random:200``), with its own options and known figures."""

    name: str
    input: str
    options: Mapping[str, Any]
    facts: Mapping[str, float]


@dataclass(frozen=True)
class Level:
    """One level of a factor: its options; `value` if it is a number."""

    name: str
    options: Mapping[str, Any]
    value: float | None = None


@dataclass(frozen=True)
class Factor:
    """A factor, crossed with all other factors."""

    name: str
    title: str
    levels: tuple[Level, ...]

    @property
    def numeric(self) -> bool:
        """Whether every level is a number."""
        return all(level.value is not None for level in self.levels)


@dataclass(frozen=True)
class Response:
    """A measured figure of a run.

    Attributes
    ----------
    path
        Path in the ``--json`` answer of the command, such as ``after.time_s``; or `WALL`, `PROCESSOR`, or a figure of
        the searches (`SEARCH`), or `RAPID`. " + " adds figures; "|" takes the first figure that exists.
    """

    name: str
    title: str
    unit: str
    path: str
    scale: float = 1.0
    more_is_better: bool = False

    @property
    def heading(self) -> str:
        """Title with unit."""
        return f"{self.title}, {self.unit}" if self.unit else self.title


@dataclass(frozen=True)
class Analysis:
    """An analysis of a response: its kind (of `ANALYSES`), the response, and the factors.

    Attributes
    ----------
    base
        Reference level of a trend or a projection, and optionally of a comparison.
    fact
        Known figure of each instance as the reference of a comparison, instead of a base level.
    against
        Second response of a Pareto plot; if empty, the next.
    without
        Instances without which a trend is reported a second time.
    boards
        Batch sizes of a projection.
    """

    kind: str
    response: str
    factors: tuple[str, ...] = ()
    alpha: float = 0.05
    base: str = ""
    without: tuple[str, ...] = ()
    boards: tuple[int, ...] = ()
    against: str = ""
    fact: str = ""


@dataclass(frozen=True)
class Published:
    """Published figures: a table of texts, with its source and a note."""

    title: str
    source: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""


@dataclass(frozen=True)
class RunPlan:
    """One planned run: an input, a level of each factor, and a seed."""

    instance: LabInstance
    levels: Mapping[str, Level]
    seed: int
    options: Mapping[str, Any]

    @property
    def label(self) -> str:
        """Label for messages."""
        return ", ".join([self.instance.name, *(level.name for level in self.levels.values()), f"seed {self.seed}"])


@dataclass(frozen=True)
class Description:
    """An experiment as described by its file.

    `command` is ``solve``, ``optimize``, or the command of a process. `new_process`: each run is a new process, so that
    its start-up time counts. `cores` is the factor whose levels are numbers of threads; levels above the machine's
    cores are skipped.
    """

    name: str
    title: str
    about: str
    command: str
    instances: tuple[LabInstance, ...]
    factors: tuple[Factor, ...]
    responses: tuple[Response, ...]
    seeds: tuple[int, ...]
    options: Mapping[str, Any]
    analyses: tuple[Analysis, ...]
    published: tuple[Published, ...]
    source: str = ""
    notes: tuple[str, ...] = ()
    new_process: bool = False
    cores: str = ""
    reduced: bool = False
    #: Whether `leafcut lab run` lists it by name.
    listed: bool = True
    #: The table of the short form, as in the file.
    short: Mapping[str, Any] = field(default_factory=dict, repr=False)

    @property
    def key(self) -> str:
        """Name under which its runs are stored; the short form has a separate one."""
        return f"{self.name} (reduced)" if self.reduced else self.name

    def response(self, name: str) -> Response:
        """Return a response by name."""
        return next(response for response in self.responses if response.name == name)

    def factor(self, name: str) -> Factor:
        """Return a factor by name."""
        return next(factor for factor in self.factors if factor.name == name)

    def runs(self) -> Iterator[RunPlan]:
        """Yield all runs seed by seed, so that an early end leaves complete rounds."""
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
        """Number of runs."""
        count = len(self.seeds) * len(self.instances)
        for factor in self.factors:
            count *= len(factor.levels)
        return count

    def __post_init__(self) -> None:
        if not self.n_runs:
            raise OptionError(
                f"experiment '{self.name}' has no run: it needs an instance, a level of each factor, a seed"
            )
        if self.n_runs > MAX_RUNS:
            raise OptionError(f"experiment '{self.name}' has {self.n_runs} runs; at most {MAX_RUNS} are allowed")
