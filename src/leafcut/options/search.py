"""Options of the search."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from leafcut.errors import OptionError
from leafcut.option_spec import OptionGroup, option

#: What `--algorithm` takes, in words.
ALGORITHM_TITLES = {
    "auto": "leafcut's choice: the colony",
    "colony": "ants that improve tours of their own (Lin–Kernighan), then follow each other's trails (edge assembly)",
    "as": "Ant System",
    "eas": "Elitist Ant System",
    "asrank": "rank-based Ant System",
    "mmas": "MAX–MIN Ant System",
    "acs": "Ant Colony System",
    "firefly": "discrete firefly algorithm: tours fly towards shorter ones by inversions",
    "kicks": "one tour, kicked at one place at a time and mended by exchanges of up to five edges (Lin–Kernighan)",
    "2opt": "nearest neighbour, improved by 2-opt and Or-opt",
    "nn": "nearest neighbour",
    "none": "the order of the drawing",
}
ALGORITHMS = tuple(ALGORITHM_TITLES)
#: Where the packages of other people name theirs.
ALGORITHM_GROUP = "leafcut.algorithms"

#: Only these have ants; only that has fireflies.
_ANTS = "algorithm=as|eas|asrank|mmas|acs"
_FIREFLIES = "algorithm=firefly"


@dataclass(frozen=True)
class SolveOptions(OptionGroup):
    """How the order is sought."""

    section: ClassVar[str] = "solve"
    title: ClassVar[str] = "Search"

    algorithm: str = option(
        "text",
        "auto",
        "name of an algorithm (see `leafcut algorithms`)",
        choices=ALGORITHMS,
        group_of_plugins=ALGORITHM_GROUP,
    )
    preset: str = option(
        "text",
        "default",
        "budget of work, the same on every machine; the search ends sooner when the colonies agree, and but for "
        "thorough when more of it would take longer than it saves",
        choices=("fast", "default", "thorough"),
    )
    objective: Literal["time", "distance"] = option(
        "text",
        "time",
        "what is made small: machine seconds or millimetres of travel",
        choices=("time", "distance"),
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
        "whole",
        None,
        "stop after this many iterations",
        minimum=0,
        default_words="the preset's",
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
    seed: int = option(
        "whole",
        1,
        "start of the random numbers: same seed, same answer",
        minimum=0,
        maximum=2**32 - 1,
    )
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
    local_search: bool = option("flag", True, "improve the tour of every ant or firefly by exchanges of edges")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.target_gap is not None and not self.bound:
            raise OptionError("--target-gap needs the lower bound; leave out --no-bound")


@dataclass(frozen=True)
class AcoOptions(OptionGroup):
    """The parameters of the ants; each default is the one its authors recommend (`solve.aco.RECOMMENDED`)."""

    section: ClassVar[str] = "aco"
    title: ClassVar[str] = "Ants"

    n_ants: int | None = option(
        "whole",
        None,
        "ants per iteration",
        minimum=1,
        maximum=1_000_000,
        default_words="one per node; 25 with local search; 10 for acs",
        needs=_ANTS,
    )
    pheromone_weight: float = option("number", 1.0, "weight of the pheromone (α)", minimum=0, maximum=20, needs=_ANTS)
    heuristic_weight: float = option("number", 2.0, "weight of nearness (β)", minimum=0, maximum=20, needs=_ANTS)
    evaporation_rate: float | None = option(
        "number",
        None,
        "part of the pheromone lost per iteration (ρ)",
        minimum=1e-6,
        maximum=1,
        default_words="0.5 as, eas · 0.1 asrank, acs · 0.02 mmas, 0.2 with local search",
        needs=_ANTS,
    )
    elitist_weight: float | None = option(
        "number",
        None,
        "deposits of the best tour so far (e of eas)",
        minimum=0,
        default_words="the number of ants",
        needs="algorithm=eas",
    )
    n_ranks: int = option(
        "whole", 6, "ranks that deposit (w of asrank)", minimum=1, maximum=1000, needs="algorithm=asrank"
    )
    greedy_probability: float = option(
        "number", 0.9, "chance to take the best edge (q0 of acs)", minimum=0, maximum=1, needs="algorithm=acs"
    )
    local_evaporation_rate: float = option(
        "number", 0.1, "pheromone lost by an edge just used (ξ of acs)", minimum=0, maximum=1, needs="algorithm=acs"
    )
    best_probability: float = option(
        "number",
        0.05,
        "chance to rebuild the best tour at convergence; sets the trail limits (p_best of mmas)",
        minimum=1e-6,
        maximum=0.999,
        needs="algorithm=mmas",
    )


@dataclass(frozen=True)
class FireflyOptions(OptionGroup):
    """The parameters of the fireflies; defaults are those published for pockets (`solve.firefly.MODES`)."""

    section: ClassVar[str] = "firefly"
    title: ClassVar[str] = "Fireflies"

    firefly_mode: str = option(
        "text",
        "simple",
        "which of the published settings stand for what is not given: those for simple or for complex pockets",
        choices=("simple", "complex"),
        needs=_FIREFLIES,
    )
    n_fireflies: int | None = option(
        "whole",
        None,
        "fireflies in the swarm (n)",
        minimum=1,
        maximum=10_000,
        default_words="11 in simple mode, 10 in complex",
        needs=_FIREFLIES,
    )
    attractiveness: float | None = option(
        "number",
        None,
        "inversions of one flight towards a tour close by (β0)",
        minimum=0,
        maximum=1000,
        default_words="20 in simple mode, 15 in complex",
        needs=_FIREFLIES,
    )
    absorption: float = option(
        "number",
        0.015,
        "how fast they become fewer with the distance of two tours (γ): 10 when no edge is the same",
        minimum=0,
        maximum=100,
        needs=_FIREFLIES,
    )
    switch_at: float | None = option(
        "percent",
        None,
        "share of the iterations, or of the time limit, after which inversions are short",
        minimum=0,
        maximum=100,
        default_words="27 in simple mode, 37 in complex",
        needs=_FIREFLIES,
    )
    short_inversion: int | None = option(
        "whole",
        None,
        "nodes of the longest of the short inversions; long ones have as many as two tours have different edges",
        minimum=2,
        default_words="a quarter of all; 50 with local search",
        needs=_FIREFLIES,
    )
    firefly_patience: int | None = option(
        "whole",
        None,
        "iterations without a shorter tour after which the search ends",
        minimum=1,
        default_words="20; with --time-limit none",
        needs=_FIREFLIES,
    )
    firefly_start: str = option(
        "text",
        "greedy",
        "what fireflies begin with: greedy tours, each with edges changed a little, or tours at random",
        choices=("greedy", "random"),
        needs=_FIREFLIES,
    )
