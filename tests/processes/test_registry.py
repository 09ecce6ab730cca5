"""Which process makes a program of which input, and what a person is told where none does."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import pytest

from leafcut.errors import OptionError
from leafcut.model import Outcome, Part
from leafcut.option_spec import OptionGroup, option
from leafcut.options import JobOptions, MachineOptions, Settings
from leafcut.processes import registry
from leafcut.processes.base import Process, use
from leafcut.processes.course import Run
from leafcut.processes.settings import collect, settings_for
from leafcut.read.format import Source
from leafcut.read.registry import formats
from packages import Installer

BY_NAME = {one.name: one for one in formats()}


def chosen(asked: str, *names: str) -> str:
    """Return the name of the process for files of some formats."""
    return registry.process_for([(BY_NAME[name], Source(f"a.{name}", b"")) for name in names], asked).name


def test_what_is_made_of_a_file_is_what_is_asked_for_else_what_it_is_good_for_alone_else_drilling() -> None:
    assert {(name, asked): chosen(asked, name) for name, asked in (
        ("dxf", "auto"), ("dxf", "drill"), ("dxf", "cut"), ("dxf", "pocket"), ("svg", "auto"), ("picture", "auto"),
        ("picture", "drill"), ("wkt", "auto"), ("gcode", "auto"), ("gcode", "drill"), ("gcode", "plasma"),
    )} == {
        ("dxf", "auto"): "drill", ("dxf", "drill"): "drill", ("dxf", "cut"): "cut", ("dxf", "pocket"): "pocket",
        ("svg", "auto"): "drill", ("picture", "auto"): "pocket", ("picture", "drill"): "drill",
        ("wkt", "auto"): "pocket",
        ("gcode", "auto"): "program", ("gcode", "drill"): "program", ("gcode", "plasma"): "program",
    }  # fmt: skip
    assert chosen("auto", "excellon", "excellon") == "drill"


@pytest.mark.parametrize(
    ("asked", "names", "words"),
    [
        (
            "cat",
            ("dxf",),
            "unknown process 'cat'; choose one of auto, drill, cut, pocket, reorder, mill, laser, plasma",
        ),
        ("mill", ("dxf",), "mill: the input is a drawing, not a program; use drill, cut or pocket"),
        (
            "cut",
            ("gcode",),
            "cut: the input is a program, not a drawing; use leafcut reorder, or --process laser or plasma",
        ),
        ("auto", ("excellon", "dxf"), "only drill files can be combined into one program; a.dxf is not one"),
        ("cut", ("excellon", "excellon"), "--process cut cannot combine them"),
    ],
)
def test_what_nothing_does_is_refused_in_one_line(asked: str, names: tuple[str, ...], words: str) -> None:
    with pytest.raises(OptionError) as refused:
        chosen(asked, *names)
    assert str(refused.value).endswith(words)


class Engraving(Process):
    """A stranger's process."""

    name = "engrave"
    title = "engraving"
    command = "engrave"
    asked_as = ("engrave",)
    reads = "drawing"
    uses = use(MachineOptions) | use(JobOptions, "depth")

    def run(self, run: Run, sources: Sequence[Source], asked: str) -> Outcome[Any]:
        raise NotImplementedError

    def look_at(self, source: Source | str, settings: Settings) -> Part:
        return Part(str(source))


def test_a_process_from_outside_is_asked_for_by_its_own_word(install: Installer) -> None:
    install("toy", {"leafcut.processes": {"engrave": f"{__name__}:Engraving"}})
    assert registry.asked_words() == ("auto", "drill", "cut", "pocket", "engrave", "reorder", "mill", "laser", "plasma")
    assert chosen("engrave", "dxf") == "engrave"
    assert settings_for(collect({"depth": "0.2mm"}), Engraving()).job.depth == 0.2
    with pytest.raises(OptionError, match="--peck: not used for engraving; it applies to drilling; leave it out"):
        settings_for(collect({"peck": 2}), Engraving())
    assert registry.look_at("engrave", "a.dxf", Settings()).name == "a.dxf"


class Misnamed(Engraving):
    """Another name than that of its entry point."""

    name = "other"


class Mistaken(Engraving):
    """Asked for by a word that is leafcut's own."""

    name = "mistaken"
    command = "mistaken"
    asked_as = ("mistaken", "laser")


@dataclass(frozen=True)
class Taken(OptionGroup):
    """An option that leafcut has itself."""

    section = "engrave"
    machine: str = option("text", "mine", "a machine")


class Taking(Engraving):
    """Options of a name that is taken."""

    name = "taking"
    command = "taking"
    options = (Taken,)


class Unknown(Engraving):
    """An option that there is nowhere."""

    name = "unknown"
    command = "unknown"
    form = (("main", ("machine", "loudness")),)


def test_a_broken_process_from_outside_is_told_by_name_and_stops_no_other(install: Installer) -> None:
    here = {
        "misnamed": "Misnamed",
        "mistaken": "Mistaken",
        "taking": "Taking",
        "unknown": "Unknown",
        "function": "chosen",
        "gone": "Gone",
    }
    install("toys", {"leafcut.processes": {name: f"{__name__}:{thing}" for name, thing in here.items()}})
    why = {
        "misnamed": "its name 'other', command 'engrave' and entry point 'misnamed' must be equal",
        "mistaken": "leafcut already has a process 'laser'",
        "taking": "leafcut already has --machine",
        "unknown": "unknown option 'loudness'",
        "function": "a class that inherits from leafcut.processes.base.Process was expected",
        "gone": "has no attribute 'Gone'",
    }
    for name, words in why.items():
        with pytest.raises(
            OptionError, match=f"the process '{name}' is a plug-in of toys that cannot be used .*{words}"
        ):
            registry.check_asked(name)
    assert registry.asked_words() == ("auto", "drill", "cut", "pocket", "reorder", "mill", "laser", "plasma")
    assert chosen("auto", "dxf") == "drill"
    assert collect({"machine": "haas-vf2"}).machine.machine == "haas-vf2"
