"""Answers about a machine: the like machine of each controller, and the whole refusal of each wrong answer."""

from __future__ import annotations

import re
from typing import Any

import pytest

from leafcut.errors import OptionError
from leafcut.read.controllers.importing import ImportedMachine
from leafcut.read.controllers.questions import machine_from_answers
from leafcut.read.controllers.values import ValueOrigin

#: Machine whose values are estimates → controllers.
LIKE = {
    "haas-vf2": "haas fanuc", "grbl-3018": "grbl", "linuxcnc-mill": "linuxcnc", "mach3-router": "mach3",
    "mach4-router": "mach4", "fagor-8055": "fagor8055", "plasma-table": "qtplasmac plasma", "uccnc-router": "uccnc",
    "edingcnc-router": "edingcnc", "masso-router": "masso", "centroid-mill": "centroid", "marlin-mpcnc": "marlin",
    "duet-router": "rrf", "siemens-828d": "siemens siemens-iso", "heidenhain-tnc": "heidenhain",
    "laser-table": "fanuc-laser", "grbl-laser-20w": "grbl-laser", "flame-table": "flame", "water-table": "waterjet",
}  # fmt: skip
ANSWERS: dict[str, Any] = {"name": "Mill", "controller": "haas", "rapid": "10 m/min"}


def answered(**more: Any) -> ImportedMachine:
    return machine_from_answers({**ANSWERS, **more})


@pytest.mark.parametrize("machine", LIKE)
def test_estimates_are_those_of_a_machine_with_the_same_controller(machine: str) -> None:
    for controller in LIKE[machine].split():
        found = answered(controller=controller.upper())
        assert set(re.findall(r'as ([a-z0-9-]+)[:"]', found.text)) == {machine}
        assert found.machine.controller == controller and found.machine.description == f"Mill ({controller})"
        assert next(value.how for value in found.values if value.key == "controller") is ValueOrigin.TAKEN


@pytest.mark.parametrize(
    ("given", "automatic"), [(True, True), (False, False), ("yes", True), ("n", False), ("Y", True), ("No", False)]
)
def test_a_tool_changer_may_be_answered_by_a_flag_or_a_word(given: bool | str, automatic: bool) -> None:
    assert answered(**{"tool-changer": given}).machine.tool_changer is automatic


LONG = "9" * 50
SHOWN = f"{'9' * 39}…"


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"rapid": f"{LONG},1"}, f"--rapid: '{SHOWN}' is 2 values, but must be one, or x,y,z"),
        ({"rapid": "0,0,0 mm/min"}, "--rapid: 0,0,0 mm/min: must be above 0"),
        ({"rapid": "11 m/s"}, "--rapid: 11 m/s: no machine has more than 10000 mm/s"),
        ({"acceleration": "101 m/s2"}, "--acceleration: 101 m/s2: no machine has more than 100000 mm/s²"),
        ({"travel": f"{LONG},1"}, f"--travel: '{SHOWN}' must be lengths of x,y,z, or unknown"),
        ({"travel": "1,2,0"}, "--travel: 1,2,0: lengths must be above 0 and at most 100 m"),
        ({"travel": "1,2,101 m"}, "--travel: 1,2,101 m: lengths must be above 0 and at most 100 m"),
        ({"name": "  "}, "--name: '' is not an answer"),
        ({"name": "a\tb"}, "--name: 'a b' is not an answer"),
        ({"spindle-speed": "0"}, "--spindle-speed: 0 is not above 0"),
        ({"process": "hammer"}, "--process: 'hammer' is unknown; choose one of spindle, torch, laser, flame, water"),
        ({"units": "feet"}, "--units: 'feet' is unknown; choose one of mm, in"),
    ],
)
def test_a_wrong_answer_is_refused_in_full(given: dict[str, str], words: str) -> None:
    with pytest.raises(OptionError) as refused:
        answered(**given)
    assert str(refused.value) == words


def test_the_fastest_and_longest_machine_is_taken() -> None:
    found = answered(rapid="10 m/s", acceleration="100 m/s2", travel="100 m, 100 m, 100 m").machine
    assert found.rapid_velocity == (10_000,) * 3 and found.acceleration == (100_000,) * 3
    assert found.travel_min == (-100_000,) * 3
