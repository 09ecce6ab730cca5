"""Experiments on the user's own part: the settings that can be compared, and the resulting description."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from leafcut.errors import OptionError, name_suggestion
from leafcut.lab.description import (
    MAX_SEEDS,
    PROCESSOR,
    SOLVE,
    Analysis,
    Description,
    Factor,
    LabInstance,
    Level,
    Response,
)
from leafcut.options import ALGORITHM_TITLES
from leafcut.options.option_spec import OptionSpec
from leafcut.processes.settings import group_of

#: Name under which the runs are stored. The hash of the file distinguishes between different parts.
OWN_PART = "open_part"
#: Algorithms that can be compared, because they search for a tour.
COMPARED = tuple(name for name in ALGORITHM_TITLES if name not in ("auto", "none"))

_TIME = Response("time", "Computing time", "s", PROCESSOR)
_PROGRAM = Response("machining", "Machining time", "s", "after.time_s")
_RESPONSES = {
    SOLVE: (Response("length", "Length", "", "length"), _TIME),
    "pocket": (_PROGRAM, Response("length", "Length of the path", "mm", "pocket.length_mm"), _TIME),
}
_USUAL_RESPONSES = (_PROGRAM, Response("travel", "Travel", "mm", "after.travel_mm"), _TIME)


def compared_option_values(command: str) -> tuple[str, tuple[str, ...]]:
    """Return the option to compare and its values. The option is the strategy of a pocket, otherwise the algorithm."""
    if command == "pocket":
        choices = group_of("strategy").specs()["strategy"].all_choices
        return "strategy", tuple(name for name in choices if name != "auto")
    return "algorithm", (*COMPARED, "auto")


def command_responses(command: str) -> tuple[Response, ...]:
    """Return the responses of a command. The first response is the objective."""
    return _RESPONSES.get(command, _USUAL_RESPONSES)


def comparison_experiment(
    name: str, source: str, command: str, options: Mapping[str, Any], values: Sequence[str], runs: int
) -> Description:
    """Create an experiment that runs a part with several values of an option. All values use the same seeds.

    The other `options` apply to all runs, except where a value does not use an option. `values` must come from
    `compared_option_values`.

    Raises
    ------
    OptionError
        There are fewer than two values, a value is unknown, or the number of runs is out of range.
    """
    option, known = compared_option_values(command)
    for value in values:
        if value not in known:
            raise OptionError("unknown {} '{}'{}", option, value, name_suggestion(value, known))
    if len(values) < 2:
        raise OptionError("choose at least two values of {} to compare", option)
    if not 1 <= runs <= MAX_SEEDS:
        raise OptionError("runs of each: choose 1 to {}", MAX_SEEDS)
    first = int(options.get("seed") or 1)
    specs = {key: group_of(key).specs()[key] for key in options if key not in (option, "seed")}
    shared = {key: options[key] for key, spec in specs.items() if not spec.is_output}
    levels = tuple(
        Level(
            value, {option: value}, without=tuple(key for key in shared if not _applies_with(value, option, specs[key]))
        )
        for value in dict.fromkeys(values)
    )
    responses = command_responses(command)
    comparisons = tuple(Analysis("compare", response.name, (option,)) for response in responses[:2])
    pareto = Analysis("pareto", responses[0].name, against=_TIME.name)
    return Description(
        name=OWN_PART,
        title=f"{option.capitalize()} compared on {name}",
        about=f"The part that is open, in {len(levels)} ways with {runs} seeds each, with the settings of the page.",
        command=command,
        instances=(LabInstance(name, source, {}, {}),),
        factors=(Factor(option, option.capitalize(), levels),),
        responses=responses,
        seeds=tuple(range(first, first + runs)),
        options={"threads": 1, **shared},
        analyses=(*comparisons, pareto),
        listed=False,
        notes=("The experiment uses a single part, so its results hold for this part only.",),
    )


def _applies_with(value: str, option: str, spec: OptionSpec) -> bool:
    """Return whether another option has any effect when the compared option has this value."""
    return all(condition.holds(lambda _: value, "") for condition in spec.needs if condition.names == (option,))
