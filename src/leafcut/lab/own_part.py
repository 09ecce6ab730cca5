"""An experiment on a part of one's own: what may be compared there, and the description that compares it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from leafcut.errors import OptionError, nearest
from leafcut.lab.description import (
    MOST_SEEDS,
    PROCESSOR,
    SOLVE,
    Analysis,
    Description,
    Factor,
    LabInstance,
    Level,
    Response,
)
from leafcut.lab.experiment import COMPARED
from leafcut.processes.settings import group_of

#: Its name, under which its runs are kept: those of different parts differ by what the files hold.
OWN_PART = "open_part"

_TIME = Response("time", "Time of the computer", "s", PROCESSOR)
_PROGRAM = Response("machining", "Machining time", "s", "after.time_s")
_RESPONSES = {
    SOLVE: (Response("length", "Length", "", "length"), _TIME),
    "pocket": (_PROGRAM, Response("length", "Length of the path", "mm", "pocket.length_mm"), _TIME),
}
_USUAL_RESPONSES = (_PROGRAM, Response("travel", "Travel", "mm", "after.travel_mm"), _TIME)


def what_differs(command: str) -> tuple[str, tuple[str, ...]]:
    """Return the option that ways of a command differ in, and its values: strategies of pockets, else algorithms."""
    if command == "pocket":
        choices = group_of("strategy").specs()["strategy"].all_choices
        return "strategy", tuple(name for name in choices if name != "auto")
    return "algorithm", (*COMPARED, "auto")


def responses_of(command: str) -> tuple[Response, ...]:
    """Return what is measured of a command; the first is what it is for."""
    return _RESPONSES.get(command, _USUAL_RESPONSES)


def compare_on(
    name: str, source: str, command: str, options: Mapping[str, Any], ways: Sequence[str], runs: int
) -> Description:
    """Return the experiment that does a part in several ways, each with as many seeds.

    Options that only some ways have are left out: each way has its own as recommended.

    Parameters
    ----------
    name, source
        What a person calls the part, and where it is.
    command
        What is done: ``solve``, ``optimize``, or the command of a process.
    ways
        Values of `what_differs`.

    Raises
    ------
    OptionError
        No way is chosen or an unknown one, or the number of runs is out of range.
    """
    option, known = what_differs(command)
    for way in ways:
        if way not in known:
            raise OptionError(f"unknown {option} '{way}'{nearest(way, known)}")
    if len(ways) < 2:
        raise OptionError(f"choose at least two values of {option} to compare")
    if not 1 <= runs <= MOST_SEEDS:
        raise OptionError(f"runs of each: choose 1 to {MOST_SEEDS}")
    first = int(options.get("seed") or 1)
    specs = {key: group_of(key).specs()[key] for key in options if key not in (option, "seed")}
    shared = {
        key: options[key]
        for key, spec in specs.items()
        if not spec.is_output and not any(option in one.names for one in spec.needs)
    }
    levels = tuple(Level(way, {option: way}) for way in dict.fromkeys(ways))
    responses = responses_of(command)
    judged = tuple(Analysis("compare", one.name, (option,)) for one in responses[:2])
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
        analyses=(*judged, pareto),
        published=(),
        listed=False,
        notes=("One part: what is proved holds for it alone.",),
    )
