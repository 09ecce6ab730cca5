"""The process that the registry chooses for each input, and the message if there is none."""

from __future__ import annotations

import pkgutil
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

import pytest

from leafcut import processes
from leafcut.errors import OptionError
from leafcut.model.outcome import Outcome
from leafcut.model.part import Part
from leafcut.options import JobOptions, MachineOptions, Settings
from leafcut.options.option_spec import OptionGroup, option
from leafcut.processes import registry
from leafcut.processes.base import Process, use
from leafcut.processes.job import Job
from leafcut.processes.settings import collect_settings, settings_for
from leafcut.read.format import Format, Source
from leafcut.read.registry import formats
from packages import Installer

BY_NAME = {one.name: one for one in formats()}


def inputs_of(*names: str) -> list[tuple[Format, Source]]:
    """Return files of some formats."""
    return [(BY_NAME[name], Source(f"a.{name}", b"")) for name in names]


def chosen(asked: str, *names: str) -> str:
    """Return the name of the process for files of some formats."""
    return registry.process_for(inputs_of(*names), asked).name


def test_what_is_made_of_a_file_is_what_is_asked_for_else_what_it_is_good_for_alone_else_drilling() -> None:
    assert {
        (name, asked): chosen(asked, name)
        for name, asked in (
            ("dxf", "auto"),
            ("dxf", "drill"),
            ("dxf", "cut"),
            ("dxf", "pocket"),
            ("svg", "auto"),
            ("picture", "auto"),
            ("picture", "drill"),
            ("wkt", "auto"),
            ("gcode", "auto"),
            ("gcode", "drill"),
            ("gcode", "plasma"),
        )
    } == {
        ("dxf", "auto"): "drill",
        ("dxf", "drill"): "drill",
        ("dxf", "cut"): "cut",
        ("dxf", "pocket"): "pocket",
        ("svg", "auto"): "drill",
        ("picture", "auto"): "pocket",
        ("picture", "drill"): "drill",
        ("wkt", "auto"): "pocket",
        ("gcode", "auto"): "program",
        ("gcode", "drill"): "program",
        ("gcode", "plasma"): "program",
    }
    assert chosen("auto", "excellon", "excellon") == "drill"


@pytest.mark.parametrize(
    ("asked", "names", "words"),
    [
        ("mill", ("dxf",), "mill: the input is a drawing, not a program; use drill, cut, pocket or part"),
        (
            "cut",
            ("gcode",),
            "cut: the input is a program, not a drawing; use leafcut reorder, or --process laser or plasma",
        ),
        ("auto", ("excellon", "dxf"), "only drill files can be combined into one program; a.dxf is not a drill file"),
        ("cut", ("excellon", "excellon"), "--process cut cannot combine them"),
    ],
)
def test_what_nothing_does_is_refused_in_one_line(asked: str, names: tuple[str, ...], words: str) -> None:
    with pytest.raises(OptionError) as refused:
        chosen(asked, *names)
    assert str(refused.value).endswith(words)


def test_an_unknown_process_is_refused_with_all_known_ones() -> None:
    known = "auto, drill, cut, pocket, part, reorder, mill, laser, plasma"
    with pytest.raises(OptionError, match=f"^--process: unknown process 'cat'; choose one of {known}$"):
        registry.check_process_value("cat")


def test_the_registry_has_every_process_of_the_package() -> None:
    modules = pkgutil.iter_modules(processes.__path__)
    packages = {m.name for m in modules if m.ispkg and find_spec(f"{processes.__name__}.{m.name}.process")}
    assert {home.split(".")[2] for home in registry.BUILT_IN.values()} == packages
    assert [process.name for process in registry.processes()] == list(registry.BUILT_IN)


class Engraving(Process):
    """A stranger's process."""

    name = "engrave"
    title = "engraving"
    command = "engrave"
    reads = "drawing"
    uses = use(MachineOptions) | use(JobOptions, "depth")

    def run(self, run: Job, sources: Sequence[Source], asked: str) -> Outcome[Any]:
        raise NotImplementedError

    def preview_part(self, source: Source | str, settings: Settings) -> Part:
        return Part(str(source))


def test_a_process_from_outside_is_asked_for_by_its_own_word(install: Installer) -> None:
    install("toy", {"leafcut.processes": {"engrave": f"{__name__}:Engraving"}})
    assert registry.all_process_values() == (
        "auto",
        "drill",
        "cut",
        "pocket",
        "part",
        "engrave",
        "reorder",
        "mill",
        "laser",
        "plasma",
    )
    assert chosen("engrave", "dxf") == "engrave"
    assert settings_for(collect_settings({"depth": "0.2mm"}), Engraving()).job.depth == 0.2
    with pytest.raises(
        OptionError,
        match="--peck: this option does not apply to engraving, only to drilling and choosing speeds and feeds; ",
    ):
        settings_for(collect_settings({"peck": 2}), Engraving())
    assert registry.work("engrave").preview_part("a.dxf", Settings()).name == "a.dxf"


class Misnamed(Engraving):
    """Its name differs from its entry point."""

    name = "other"


class Mistaken(Engraving):
    """Asked for by a word that is leafcut's own."""

    name = "mistaken"
    command = "mistaken"
    process_values = ("mistaken", "laser")


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
            registry.check_process_value(name)
    assert registry.all_process_values() == (
        "auto",
        "drill",
        "cut",
        "pocket",
        "part",
        "reorder",
        "mill",
        "laser",
        "plasma",
    )
    assert chosen("auto", "dxf") == "drill"
    assert collect_settings({"machine": "haas-vf2"}).machine.machine == "haas-vf2"


@dataclass(frozen=True)
class Loudness(OptionGroup):
    """An option that leafcut does not have."""

    section = "sounding"
    title = "Sounding"

    loudness: float = option("number", 1.0, "how loud")


@dataclass(frozen=True)
class Noise(OptionGroup):
    """The same option once more, in a table of its own."""

    section = "humming"
    title = "Humming"

    loudness: float = option("number", 2.0, "how loud")


class Sounding(Engraving):
    """One process with that option."""

    name = command = "sounding"
    process_values = ("sounding", "loud")
    options = (Loudness,)


class Humming(Engraving):
    """A second process of the same package."""

    name = command = "humming"
    options = (Noise,)


class Shouting(Engraving):
    """One that is asked for by the same word."""

    name = command = "shouting"
    process_values = ("shouting", "loud")


@pytest.mark.parametrize("other, shared", [("Humming", "--loudness"), ("Shouting", "--process loud")])
def test_two_packages_that_have_the_same_are_both_told_of_and_neither_is_used(
    install: Installer, other: str, shared: str
) -> None:
    """Which of them would be meant is nobody's guess; whatever else there is goes on."""
    name = other.lower()
    install("bells", {"leafcut.processes": {"sounding": f"{__name__}:Sounding"}})
    install("horns", {"leafcut.processes": {name: f"{__name__}:{other}"}})
    for one, its, two in (("sounding", "bells", name), (name, "horns", "sounding")):
        words = f"the plug-ins '{one}' and '{two}' of bells and horns both have {shared}; uninstall one of them"
        with pytest.raises(OptionError) as refused:
            registry.check_process_value(one)
        assert str(refused.value) == f"the process '{one}' is a plug-in of {its} that cannot be used ({words})"
        assert (one, f"plug-in of {its} that cannot be used ({words})") in registry.PACKAGED.names_and_descriptions()
    assert registry.all_process_values() == (
        "auto",
        "drill",
        "cut",
        "pocket",
        "part",
        "reorder",
        "mill",
        "laser",
        "plasma",
    )
    with pytest.raises(OptionError, match="unknown option 'loudness'"):
        collect_settings({"loudness": 3})


def test_a_package_that_shares_nothing_with_another_is_used_beside_it(install: Installer) -> None:
    install("bells", {"leafcut.processes": {"sounding": f"{__name__}:Sounding"}})
    install("toy", {"leafcut.processes": {"engrave": f"{__name__}:Engraving"}})
    assert {"sounding", "loud", "engrave"} <= set(registry.all_process_values())


@pytest.mark.parametrize(
    "asked, names, needed",
    [
        ("auto", ("dxf",), ""),
        ("drill", ("dxf",), ""),
        ("pocket", ("dxf",), "pocket"),
        ("cut", ("dxf",), "cut"),
        ("auto", ("gcode",), ""),
        ("reorder", ("gcode",), ""),
        ("mill", ("gcode",), "mill"),
        ("drill", ("gcode",), "drill"),
        ("drill", ("excellon", "excellon"), ""),
    ],
)
def test_a_process_has_to_be_said_again_where_the_input_alone_would_be_taken_for_another(
    asked: str, names: tuple[str, ...], needed: str
) -> None:
    inputs = inputs_of(*names)
    assert registry.needed_process_value(inputs, asked, registry.process_for(inputs, asked)) == needed
