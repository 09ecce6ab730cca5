"""Options of the search."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from leafcut.options.option_spec import OptionGroup, option, when_one_of

#: Value of `--algorithm` → description.
ALGORITHM_TITLES = {
    "auto": "the best algorithm for most jobs: colony",
    "colony": "ants improve tours by Lin–Kernighan, then combine them along their trails (edge assembly)",
    "as": "Ant System",
    "eas": "Elitist Ant System",
    "asrank": "rank-based Ant System",
    "mmas": "MAX–MIN Ant System",
    "acs": "Ant Colony System",
    "firefly": "discrete firefly algorithm: tours move towards shorter ones by inversions",
    "kicks": "iterated local search: local kicks, repaired by Lin–Kernighan exchanges of up to five edges",
    "2opt": "nearest neighbour improved by 2-opt and Or-opt",
    "nn": "nearest neighbour",
    "none": "the given order; a program is only timed",
}
ALGORITHMS = tuple(ALGORITHM_TITLES)
#: Algorithms from the literature as their authors describe them. They also order clusters of directed paths.
ANT_ALGORITHMS = ("as", "eas", "asrank", "mmas", "acs")
LITERATURE = (*ANT_ALGORITHMS, "firefly")
#: Entry point group for algorithms of other packages.
ALGORITHM_GROUP = "leafcut.algorithms"

#: Conditions of options that apply to ant or firefly algorithms only.
_ANTS = when_one_of("algorithm", *ANT_ALGORITHMS)
FIREFLIES = when_one_of("algorithm", "firefly")
#: Condition of options of the published firefly algorithm.
_PUBLISHED = (FIREFLIES, when_one_of("variant", "published", "published-complex"))

#: Value of `--n-ants` for one ant per part of a sheet, or per node without parts.
ANTS_AS_PARTS = "parts"
#: Values of `--initial-pheromone` that are no numbers: random for each edge, and the two published values for ACS.
RANDOM_TRAILS, BY_N_RHO_C, BY_N_C = "random", "1/nrC", "1/nC"


@dataclass(frozen=True)
class SolveOptions(OptionGroup):
    """Search algorithm, effort and limits."""

    section: ClassVar[str] = "solve"
    title: ClassVar[str] = "Search"

    algorithm: str = option(
        "text",
        "auto",
        "algorithm (see `leafcut list algorithms`)",
        choices=ALGORITHMS,
        group_of_plugins=ALGORITHM_GROUP,
    )
    preset: str = option(
        "text",
        "default",
        "search effort; the result is the same on every machine",
        choices=("fast", "default", "thorough"),
    )
    objective: Literal["time", "distance"] = option(
        "text",
        "time",
        "quantity to minimise: machine time or travel distance",
        choices=("time", "distance"),
    )
    time_limit: float | None = option(
        "quantity",
        None,
        "time limit for all searches together; they end earlier if five colonies in a row find no improvement",
        unit="s",
        minimum=0.001,
        default_words="set by --preset",
    )
    iterations: int | None = option(
        "whole",
        None,
        "stop after this many iterations",
        minimum=0,
        default_words="set by --preset",
    )
    bound: bool = option(
        "flag",
        True,
        "compute a lower bound and report the gap; a tenth of --time-limit is reserved for the bound",
        changes_program=False,
    )
    seed: int = option(
        "whole",
        1,
        "random seed: same seed, same result",
        minimum=0,
        maximum=2**32 - 1,
    )
    threads: int = option(
        "whole",
        0,
        "number of threads; does not change the result",
        minimum=0,
        maximum=1024,
        default_words="one per core",
        changes_program=False,
    )
    candidates: int | None = option(
        "whole",
        None,
        "candidate list length per node; 0 for all nodes, as in the original papers",
        minimum=0,
        maximum=1000,
        default_words="8 for colony and kicks, else 16",
    )
    local_search: bool = option(
        "flag",
        True,
        "improve the tour of every ant or firefly by local search",
        needs=(when_one_of("variant", "leafcut"),),
    )

    @property
    def keeps_order(self) -> bool:
        """Whether the given order is kept."""
        return self.algorithm == "none"

    @property
    def is_limited(self) -> bool:
        """Whether the search has a time limit or a maximum number of iterations."""
        return self.time_limit is not None or self.iterations is not None


@dataclass(frozen=True)
class AcoOptions(OptionGroup):
    """Parameters of the ant algorithms, with the defaults of their authors (`order.literature.pheromone`)."""

    section: ClassVar[str] = "aco"
    title: ClassVar[str] = "Ant algorithms"

    n_ants: int | str | None = option(
        "whole",
        None,
        "ants per iteration (m); `parts` means one for each part of a sheet, or for each node if the job has no parts",
        words=(ANTS_AS_PARTS,),
        minimum=1,
        maximum=1_000_000,
        default_words="one per node; 25 with local search; 10 for acs",
        needs=(_ANTS,),
    )
    pheromone_weight: float = option("number", 1.0, "pheromone weight (α)", minimum=0, maximum=20, needs=(_ANTS,))
    heuristic_weight: float = option(
        "number", 2.0, "heuristic weight: preference for short edges (β)", minimum=0, maximum=20, needs=(_ANTS,)
    )
    evaporation_rate: float | None = option(
        "number",
        None,
        "evaporation rate: share of pheromone lost per iteration (ρ)",
        minimum=1e-6,
        maximum=1,
        default_words="0.5 as, eas · 0.1 asrank, acs · 0.02 mmas, 0.2 with local search",
        needs=(_ANTS,),
    )
    initial_pheromone: float | str | None = option(
        "number",
        None,
        "pheromone on every edge at the start (τ₀): a number; 1/nC or 1/nrC for n nodes, a nearest-neighbour "
        "cost C and r = ρ; or random, a random share of 1/nC on each edge",
        words=(RANDOM_TRAILS, BY_N_RHO_C, BY_N_C),
        minimum=0,
        maximum=1e30,
        default_words="from the nearest-neighbour tour",
        needs=(_ANTS,),
    )
    parallel: str = option(
        "text",
        "threads",
        "where ants run in parallel: in threads, in processes that receive the pheromone from a master (processes), in "
        "processes that send the changes of their own pheromone to all others (exchange) or to one random other "
        "(partners), or in threads of a CUDA GPU, not with acs (gpu)",
        choices=("threads", "processes", "exchange", "partners", "gpu"),
        needs=(_ANTS,),
    )
    n_processes: int = option(
        "whole",
        2,
        "number of worker processes; changes the result with --parallel exchange or --parallel partners",
        minimum=1,
        maximum=256,
        needs=(_ANTS, when_one_of("parallel", "processes", "exchange", "partners")),
    )
    greedy_probability: float = option(
        "number",
        0.9,
        "probability of taking the best edge (q₀ of acs)",
        minimum=0,
        maximum=1,
        needs=(when_one_of("algorithm", "acs"),),
    )


@dataclass(frozen=True)
class FireflyOptions(OptionGroup):
    """Parameters of the firefly algorithm; n, β₀ and γ are those published for pockets (`order.literature.flight`)."""

    section: ClassVar[str] = "firefly"
    title: ClassVar[str] = "Firefly algorithm"

    variant: str = option(
        "text",
        "leafcut",
        "firefly algorithm: leafcut's own, or the published one for simple or for complex pockets. In the published "
        "ones, every pair makes β₀ inversions, the n shortest tours survive, and there is no local search",
        choices=("leafcut", "published", "published-complex"),
        needs=(FIREFLIES,),
    )
    reading: str = option(
        "text",
        "brighter-tenth",
        "how to read the paper where it is ambiguous. First word: the firefly of a pair that moves first. Second word: "
        "the maximum length of a short inversion, either a tenth of the nodes or the number of places at which two "
        "tours differ (distance)",
        choices=("brighter-tenth", "brighter-distance", "darker-tenth", "darker-distance"),
        needs=_PUBLISHED,
    )
    n_fireflies: int | None = option(
        "whole",
        None,
        "number of fireflies (n)",
        minimum=1,
        maximum=10_000,
        default_words="11; 10 for published-complex",
        needs=(FIREFLIES,),
    )
    attractiveness: float | None = option(
        "number",
        None,
        "attractiveness (β₀): inversions per move towards a near tour; in the published variants, moves of each pair "
        "of fireflies",
        minimum=0,
        maximum=1000,
        default_words="20; 15 for published-complex",
        needs=(FIREFLIES,),
    )
    absorption: float = option(
        "number",
        0.015,
        "absorption: decrease of attractiveness with tour distance (γ)",
        minimum=0,
        maximum=100,
        needs=(FIREFLIES,),
    )
