"""What an experiment is: a TOML description of inputs × options × seeds, what is measured, and how it is judged."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

from leafcut.errors import OptionError

#: Commands that a run may be, beside those of the processes.
SOLVE, OPTIMIZE = "solve", "optimize"
#: So many runs one experiment may have, and so many seeds.
MOST_RUNS, MOST_SEEDS = 100_000, 1000
#: Measures that every run has, whatever its command: seconds by the clock, and of the processor.
WALL, PROCESSOR = "wall_s", "processor_s"
#: What of an answer is a time of the computer, and not of the machine.
TIMES = (WALL, PROCESSOR, "seconds")

ANALYSES = ("compare", "anova", "crossed", "speedup", "trend", "pareto", "projection")


@dataclass(frozen=True)
class LabInstance:
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
class Response:
    """A figure of a run.

    Attributes
    ----------
    path
        Where it stands in the answer of the command with ``--json``, such as ``after.time_s``; or `WALL`, `PROCESSOR`.
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
    """How a response is judged: its kind (of `ANALYSES`), the response, and the factors.

    Attributes
    ----------
    base
        The level that others are compared with, of a trend or a projection; of a comparison where it is given.
    fact
        The figure known of each instance that a comparison holds the response against, in place of a base level.
    against
        The other response of a Pareto plot; the next one where it is empty.
    without
        Instances without which a trend is told once more.
    boards
        So many pieces a projection is for.
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
    """Figures of a publication: a table of texts, with where they come from and what is to be said of them."""

    title: str
    source: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""


@dataclass(frozen=True)
class RunPlan:
    """One run that is to be done: an input, a level of every factor, and a seed."""

    instance: LabInstance
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
        The factor whose levels are numbers of threads; those beyond the machine's cores are not run. Empty for none.
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
    #: Whether `leafcut lab run` knows it by its name.
    listed: bool = True
    #: The short form, as the file has it.
    short: Mapping[str, Any] = field(default_factory=dict, repr=False)

    @property
    def key(self) -> str:
        """The name under which its runs are kept; the short form has another one."""
        return f"{self.name} (reduced)" if self.reduced else self.name

    def response(self, name: str) -> Response:
        """Return one of its responses."""
        return next(one for one in self.responses if one.name == name)

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

    def __post_init__(self) -> None:
        if not self.n_runs:
            raise OptionError(
                f"experiment '{self.name}' has no run: it needs an instance, a level of each factor, a seed"
            )
        if self.n_runs > MOST_RUNS:
            raise OptionError(f"experiment '{self.name}' has {self.n_runs} runs; at most {MOST_RUNS} are allowed")
