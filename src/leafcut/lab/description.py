"""Description of an experiment in a TOML file: inputs × options × seeds, responses and analyses."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

from leafcut.errors import OptionError

#: Commands of a run that do not belong to a process.
SOLVE, OPTIMIZE = "solve", "optimize"
#: Maximum number of runs of an experiment, and maximum number of seeds.
MAX_RUNS, MAX_SEEDS = 100_000, 1000
#: Responses that exist for every command: wall-clock time and processor time, s.
WALL, PROCESSOR = "wall_s", "processor_s"
#: Prefix of responses from the searches of a run: processor time and wall-clock time, s; for the last search, shortest
#: iteration and shortest idle time of a single worker in an iteration, s; best cost; and best cost among the tours
#: that the search itself has built, without a given initial tour.
SEARCH = "search"
#: Response of every command that writes a program: total time of rapid moves, including retracts, s.
RAPID = "rapid_s"
#: Responses that measure computing time rather than machine time.
TIMES = (
    WALL,
    PROCESSOR,
    "seconds",
    f"{SEARCH}.processor_s",
    f"{SEARCH}.seconds",
    f"{SEARCH}.iteration_s",
    f"{SEARCH}.rest_s",
)

ANALYSES = ("compare", "anova", "crossed", "speedup", "messages", "trend", "pareto", "projection", "attraction")


@dataclass(frozen=True)
class LabInstance:
    """An input of an experiment with its own options and known data.

    `input` is a file, an included example (``example:plate-70``) or a random map (``random:200``). `facts` contains
    known values, such as the size of the input or a published result.
    """

    name: str
    input: str
    options: Mapping[str, Any]
    facts: Mapping[str, float]


@dataclass(frozen=True)
class Level:
    """A level of a factor: the options that it sets, and its value if it is numeric.

    If `folder` is set, runs of this level read the files of the instances, by name, from that folder instead.
    `without` lists options that are shared by all levels but not used by this level.
    """

    name: str
    options: Mapping[str, Any]
    value: float | None = None
    folder: str = ""
    without: tuple[str, ...] = ()


@dataclass(frozen=True)
class Factor:
    """A factor of the experiment. Each of its levels is combined with each level of all other factors."""

    name: str
    title: str
    levels: tuple[Level, ...]

    @property
    def numeric(self) -> bool:
        """Whether all levels are numbers."""
        return all(level.value is not None for level in self.levels)


@dataclass(frozen=True)
class Response:
    """A value measured in each run.

    Attributes
    ----------
    path
        Path in the ``--json`` answer of the command, such as ``after.time_s``; or `WALL`, `PROCESSOR`, `RAPID`, or a
        value of the searches (`SEARCH`). " + " adds values; "|" selects the first value that exists.
    """

    name: str
    title: str
    unit: str
    path: str
    scale: float = 1.0
    more_is_better: bool = False

    @property
    def heading(self) -> str:
        """Title with the unit."""
        return f"{self.title}, {self.unit}" if self.unit else self.title


@dataclass(frozen=True)
class Analysis:
    """An analysis of a response: its kind (one of `ANALYSES`), the response, and the factors.

    Attributes
    ----------
    base
        Reference level of a trend, a projection or a message analysis, and optionally of a comparison.
    fact
        Known value of each instance, used instead of a base level as the reference of a comparison.
    against
        Second response of a Pareto plot; if empty, the next response. For a message analysis, the time of an iteration
        without its ants.
    without
        Instances to omit in a second report of a trend.
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
class RunPlan:
    """A planned run: an instance, a level of each factor, and a seed."""

    instance: LabInstance
    levels: Mapping[str, Level]
    seed: int
    options: Mapping[str, Any]

    @property
    def input(self) -> str:
        """Input of its instance, or the file with the same name in the folder of a level."""
        folder = next((level.folder for level in self.levels.values() if level.folder), "")
        return str(Path(folder, Path(self.instance.input).name)) if folder else self.instance.input

    @property
    def label(self) -> str:
        """Name of the run in messages."""
        return ", ".join([self.instance.name, *(level.name for level in self.levels.values()), f"seed {self.seed}"])


@dataclass(frozen=True)
class Description:
    """An experiment as described by its TOML file.

    `command` is ``solve``, ``optimize``, or the command of a process. With `new_process`, each run starts a new
    operating system process, and its start-up time counts. `cores` names a factor whose levels are numbers of threads;
    levels above the number of cores of this machine are skipped.
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
    source: str = ""
    notes: tuple[str, ...] = ()
    new_process: bool = False
    cores: str = ""
    reduced: bool = False
    #: Whether `leafcut lab` lists the experiment by name.
    listed: bool = True
    #: Whether the experiment comes with leafcut.
    shipped: bool = False
    #: The table [reduced] of the file, which describes the short form of the experiment.
    short: Mapping[str, Any] = field(default_factory=dict, repr=False)

    @property
    def key(self) -> str:
        """Name under which the runs are stored; the short form has its own name."""
        return f"{self.name} (reduced)" if self.reduced else self.name

    def response(self, name: str) -> Response:
        """Return the response with this name."""
        return next(response for response in self.responses if response.name == name)

    def factor(self, name: str) -> Factor:
        """Return the factor with this name."""
        return next(factor for factor in self.factors if factor.name == name)

    def runs(self) -> Iterator[RunPlan]:
        """Yield all runs, seed by seed. If the experiment ends early, the runs of complete seeds are usable."""
        for seed in self.seeds:
            for instance in self.instances:
                for levels in itertools.product(*(factor.levels for factor in self.factors)):
                    options = {**self.options, **instance.options}
                    for level in levels:
                        options |= level.options
                    for name in itertools.chain.from_iterable(level.without for level in levels):
                        options.pop(name, None)
                    names = {factor.name: level for factor, level in zip(self.factors, levels, strict=True)}
                    yield RunPlan(instance, MappingProxyType(names), seed, MappingProxyType({**options, "seed": seed}))

    @property
    def n_runs(self) -> int:
        """Number of planned runs."""
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
