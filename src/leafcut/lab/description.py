"""The description of an experiment in a TOML file: inputs, options and seeds to combine, responses, and analyses."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

from leafcut.errors import OptionError

#: Commands whose runs do not belong to a process.
SOLVE, OPTIMIZE = "solve", "optimize"
#: Maximum number of runs, and maximum number of seeds.
MAX_RUNS, MAX_SEEDS = 100_000, 1000
#: Responses that every command has: wall-clock time and processor time, s.
WALL, PROCESSOR = "wall_s", "processor_s"
#: Prefix of the responses that describe the searches of a run. They are the processor time and the wall-clock time, s.
#: For the last search, they also include the shortest iteration, the shortest time that a worker was idle in an
#: iteration, s, the best cost, and the best cost of the tours that the search itself has built (without an initial
#: tour).
SEARCH = "search"
#: Response that every command with a program has: the total time of rapid moves, including retracts, s.
RAPID = "rapid_s"
#: Responses that measure computing time instead of machine time.
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
    """An input of an experiment, with its own options and known values.

    Attributes
    ----------
    input
        A file, an included example (``example:plate-70``) or a random map (``random:200``).
    facts
        Known values, such as the size of the input or a published result.
    """

    name: str
    input: str
    options: Mapping[str, Any]
    facts: Mapping[str, float]


@dataclass(frozen=True)
class Level:
    """A level of a factor, with the options that it sets. A numeric level also has a value.

    If `folder` is set, the runs of this level read files with the same names from that folder. `without` lists options
    that all other levels share but this level does not use.
    """

    name: str
    options: Mapping[str, Any]
    value: float | None = None
    folder: str = ""
    without: tuple[str, ...] = ()


@dataclass(frozen=True)
class Factor:
    """A factor of the experiment. Each of its levels is combined with every level of all other factors."""

    name: str
    title: str
    levels: tuple[Level, ...]

    @property
    def numeric(self) -> bool:
        """Whether all levels are numbers."""
        return all(level.value is not None for level in self.levels)


@dataclass(frozen=True)
class Response:
    """A value that is measured in each run.

    Attributes
    ----------
    path
        Path in the ``--json`` answer of the command, such as ``after.time_s``. It may also be `WALL`, `PROCESSOR`,
        `RAPID`, or a value of the searches (`SEARCH`). " + " adds values, and "|" selects the first value that exists.
    """

    name: str
    title: str
    unit: str
    path: str
    scale: float = 1.0
    more_is_better: bool = False

    @property
    def heading(self) -> str:
        """Title, followed by the unit."""
        return f"{self.title}, {self.unit}" if self.unit else self.title


@dataclass(frozen=True)
class Analysis:
    """An analysis of a response. `kind` is one of `ANALYSES`.

    Attributes
    ----------
    base
        Reference level of a trend, a projection or a message analysis. A comparison may also have one.
    fact
        Known value of each instance. A comparison uses it as the reference instead of a base level.
    against
        Second response of a Pareto plot. If it is empty, the plot uses the next response. In a message analysis, this
        is the time of an iteration without its ants.
    without
        Instances that are left out of a second report of a trend.
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
    """A planned run of an instance, with one level of each factor and a seed."""

    instance: LabInstance
    levels: Mapping[str, Level]
    seed: int
    options: Mapping[str, Any]

    @property
    def input(self) -> str:
        """Input of the instance. If a level has a folder, this is the file with the same name in that folder."""
        folder = next((level.folder for level in self.levels.values() if level.folder), "")
        return str(Path(folder, Path(self.instance.input).name)) if folder else self.instance.input

    @property
    def label(self) -> str:
        """Name used for the run in messages."""
        return ", ".join([self.instance.name, *(level.name for level in self.levels.values()), f"seed {self.seed}"])


@dataclass(frozen=True)
class Description:
    """An experiment, as described in its TOML file.

    Attributes
    ----------
    command
        ``solve``, ``optimize``, or the command of a process.
    new_process
        Whether each run starts a new operating system process. The measured time then includes its start-up.
    cores
        Name of a factor whose levels are numbers of threads. Levels that exceed the number of cores of this machine are
        skipped.
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
    #: Whether `leafcut lab` lists this experiment by name.
    listed: bool = True
    #: Whether this experiment is included with leafcut.
    shipped: bool = False
    #: The table [reduced] of the file. It describes a short form of the experiment.
    short: Mapping[str, Any] = field(default_factory=dict, repr=False)

    @property
    def storage_key(self) -> str:
        """Name under which the runs are stored. The short form has a different name."""
        return f"{self.name} (reduced)" if self.reduced else self.name

    def response(self, name: str) -> Response:
        """Return the response with this name."""
        return next(response for response in self.responses if response.name == name)

    def factor(self, name: str) -> Factor:
        """Return the factor with this name."""
        return next(factor for factor in self.factors if factor.name == name)

    def runs(self) -> Iterator[RunPlan]:
        """Yield all runs, one seed after the other.

        If the experiment stops early, the completed seeds can still be used.
        """
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
