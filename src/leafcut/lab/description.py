"""Description of an experiment, read from a TOML file: inputs × options × seeds, responses and analyses."""

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
#: Prefix of the responses of the searches of a run: processor time and wall-clock time, s; shortest iteration
#: of the last search, and its part in which a single worker does nothing, s; best cost; best cost of the tours that the
#: search itself built, excluding a given initial tour.
SEARCH = "search"
#: Response of every command that writes a program: time of its rapid moves, including retracts, s.
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
    """An input of an experiment with its own options and known figures.

    `input` is a file, an included example (``example:plate-70``) or a random map (``random:200``). `facts` are known
    figures, for example the size or a published result.
    """

    name: str
    input: str
    options: Mapping[str, Any]
    facts: Mapping[str, float]


@dataclass(frozen=True)
class Level:
    """A level of a factor: the options that it sets, and its number if it is numeric.

    With a `folder`, runs of the level read the files of that folder which have the names of the instances' files. Runs
    of the level leave out the options `without`, which other levels set.
    """

    name: str
    options: Mapping[str, Any]
    value: float | None = None
    folder: str = ""
    without: tuple[str, ...] = ()


@dataclass(frozen=True)
class Factor:
    """A factor of the experiment; its levels are crossed with those of all other factors."""

    name: str
    title: str
    levels: tuple[Level, ...]

    @property
    def numeric(self) -> bool:
        """Whether all levels are numbers."""
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
        Reference level of a trend, a projection or messages, and optionally of a comparison.
    fact
        Known figure of each instance as the reference of a comparison, instead of a base level.
    against
        Second response of a Pareto plot; if empty, the next. For messages, the rest of an iteration without its ants.
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
class RunPlan:
    """A planned run: an instance, a level of each factor, and a seed."""

    instance: LabInstance
    levels: Mapping[str, Level]
    seed: int
    options: Mapping[str, Any]

    @property
    def input(self) -> str:
        """Input of the run: that of its instance, or the file of the same name in the folder of a level."""
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
    process, whose start-up time counts. `cores` names a factor whose levels are numbers of threads; levels above the
    number of cores of this machine are skipped.
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
    #: The table [reduced] of the file, which describes the short form.
    short: Mapping[str, Any] = field(default_factory=dict, repr=False)

    @property
    def key(self) -> str:
        """Name under which the runs are stored. The short form has a name of its own."""
        return f"{self.name} (reduced)" if self.reduced else self.name

    def response(self, name: str) -> Response:
        """Return the response with this name."""
        return next(response for response in self.responses if response.name == name)

    def factor(self, name: str) -> Factor:
        """Return the factor with this name."""
        return next(factor for factor in self.factors if factor.name == name)

    def runs(self) -> Iterator[RunPlan]:
        """Yield all runs, one seed after the other. If the experiment ends early, all complete rounds are usable."""
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
