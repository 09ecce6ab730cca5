"""Commands for each process: exactly the process's options, the important ones first."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from leafcut.cli.app import build_app, run
from leafcut.cli.usage import GROUPS
from leafcut.options.option_spec import flag_name
from leafcut.processes import registry

COMMANDS = {one.command: one for one in registry.processes()}
#: Flags of every command that are no options.
OWN = {
    "--output", "--dry-run", "--report", "--options", "--no-defaults", "--json", "--quiet", "--process",
    "--watch", "--every", "--executor", "--workers",
}  # fmt: skip


def helped(
    command: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, flag: str = "--help-all"
) -> dict[str, list[str]]:
    """Return the flags of a command's help: the title of each part → its flags in their order."""
    monkeypatch.setenv("COLUMNS", "250")
    assert run([command, flag]) == 0
    parts: dict[str, list[str]] = {}
    for line in capsys.readouterr().out.splitlines():
        if title := re.match(r"╭─ (.+?) ─+╮", line):
            flags = parts.setdefault(title[1], [])
        elif flag := re.match(r"│ (--[a-z0-9-]+)", line):
            flags.append(flag[1])
    return parts


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_has_the_options_of_its_process_and_no_others(
    command: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    shown = {flag for flags in helped(command, capsys, monkeypatch).values() for flag in flags} - OWN
    assert shown == {flag_name(name) for name in COMMANDS[command].used()}


@pytest.mark.parametrize("command", COMMANDS)
def test_the_main_options_stand_first_and_the_rest_under_more(
    command: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Those that a form of the studio shows open, in its order; --help shows no others."""
    parts = helped(command, capsys, monkeypatch)
    first = [flag_name(name) for name in COMMANDS[command].form[0][1]]
    titles = list(parts)
    assert parts["Main options"] == first and len(first) <= 11
    behind = [title for title in titles[titles.index("Main options") + 1 :] if title != "Many inputs"]
    assert behind and all(title.startswith("More: ") for title in behind)
    short = helped(command, capsys, monkeypatch, "--help")
    assert short["Main options"] == first
    assert set(short) <= {"Arguments", "Parameters", "Main options", "Many inputs"}


def test_no_package_can_take_the_name_of_a_command() -> None:
    """The registry knows all other commands."""
    commands = {name for name in build_app() if not name.startswith("-")}
    assert commands == {*COMMANDS, *registry.OTHER_COMMANDS} - {"auto"}


def test_leafcut_alone_lists_its_commands(capsys: pytest.CaptureFixture[str]) -> None:
    assert run([]) == 0
    listed = capsys.readouterr().out
    assert all(f"│ {name} " in listed for name in ("drill", "cut", "pocket", "reorder", "nest", "machine", "studio"))


def test_the_help_shows_what_kind_of_value_an_option_takes(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["drill", "--help-all"]) == 0
    text = capsys.readouterr().out
    for words in ("--thickness LENGTH", "--tools FILE", "--time-limit TIME", "--machine NAME", "--output -o FILE"):
        assert words in text


@pytest.mark.parametrize(
    "command",
    [*COMMANDS, "optimize", "filter", "simulate", "stock", "verify", "solve", "send", "list", "defaults", "studio",
     *(f"{group} {name}" for group, (_, commands) in GROUPS.items() for name in commands)],
)  # fmt: skip
def test_help_names_types_and_defaults_in_one_style(
    command: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "250")
    assert run([*command.split(), "--help-all"]) == 0
    text = capsys.readouterr().out
    assert "STR" not in text
    assert not re.search(r"\[(default|required)\b", text)
    assert all(line.count("(default:") <= 1 for line in text.splitlines())


@pytest.mark.parametrize(
    "command, foreign",
    [
        ("drill", "times per part|--workpiece|hole in a sheet|for a program"),
        ("cut", r"at the last hole|cutting-data|nesting|to drill|for a program"),
        ("pocket", r"times per part|tools speeds|full slot|each hole|last hole|--workpiece|drill without"),
        ("reorder", r"times per part|tools speeds|assumed drill|\(stock\)|each hole|for sheets"),
        ("nest", r"to drill|for nesting|linuxcnc-mill\)"),
        ("solve", r"to drill|a tenth of --time-limit"),
        ("stock", r"tools speeds|assumed drill|--air|each hole"),
        ("simulate", "tools speeds|pockets|for holes"),
        ("tools speeds", r"cut chart|pocket\b|cutting-data|for sheets"),
    ],
)
def test_help_describes_only_the_command_s_own_work(
    command: str, foreign: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "250")
    assert run([*command.split(), "--help-all"]) == 0
    text = capsys.readouterr().out
    assert not re.findall(f".*(?:{foreign}).*", text)


@pytest.mark.parametrize("command", [*COMMANDS, "nest", "simulate", "stock", "verify"])
@pytest.mark.parametrize("flag", ["--help", "--help-all"])
def test_the_help_of_a_command_has_an_example_that_the_command_accepts(
    command: str, flag: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In an empty folder only its file is missing; a wrong word or option is refused before any file is read."""
    monkeypatch.chdir(tmp_path)
    assert run([command, flag]) == 0
    example = re.search(rf"^Example: leafcut ({command} .+)$", capsys.readouterr().out, re.MULTILINE)
    assert example
    assert run(example[1].split()) != 0
    assert re.search("file not found|No such file", capsys.readouterr().err)


def test_the_help_of_all_commands_tells_what_each_does(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["--help"]) == 0
    words = " ".join(capsys.readouterr().out.replace("│", " ").split())
    for command, process in COMMANDS.items():
        assert f"{command} {process.help}" in words


@pytest.mark.parametrize(
    "words, told",
    [
        (
            "drill plate_10.dxf --kerf 2",
            "--kerf: this option does not apply to drilling, only to cutting a sheet and nesting; ",
        ),
        (
            "reorder cam_121.nc --no-chains",
            "--no-chains: this option does not apply to reordering a program, only to cutting a sheet",
        ),
        (
            "optimize plate_10.dxf --gap=3",
            "--gap: this option does not apply to optimize, only to nesting; leave it out",
        ),
        ("drill plate_10.dxf --speed 1000", r"unknown option '--speed'; did you mean '--spindle-speed'\?$"),
        ("drill plate_10.dxf --config a.toml", r"unknown option '--config' \(see leafcut drill --help\)$"),
        ("drill plate_10.dxf --tool 6", r"unknown option '--tool'; did you mean '--tools'\?$"),
        (
            "drill plate_10.dxf --thickness 6 mm",
            "mm: file not found; write a unit directly after its number, such as 6mm$",
        ),
        ("nest bracket.dxf 20", "20: file not found; add a quantity to its drawing, such as bracket.dxf:20$"),
        ("nest bracket.dxf x20", "x20: file not found; add a quantity to its drawing, such as bracket.dxf:20$"),
        (
            "nest bracket.dxf --quantity 2",
            "--quantity: .*; write the number after the drawing, such as .*:20$",
        ),
        (
            "simulate plate_10.dxf",
            r"plate_10\.dxf: this is a drawing \(dxf\), not a program; create its program first: leafcut",
        ),
        ("send part.nc", r"send needs --machine \(see leafcut send --help\)$"),
        ("send part.nc --machine", r"--machine needs a value \(see leafcut send --help\)$"),
        ("sim part.nc", r"unknown command 'sim'; did you mean 'simulate'\?$"),
        ("mill part.dxf", "there is no command 'mill'; type: leafcut pocket DRAWING, or leafcut reorder PROGRAM$"),
        ("help", "there is no command 'help'; type: leafcut --help, or leafcut COMMAND --help$"),
        ("lab tun x", "unknown command 'lab tun'; did you mean 'tune'"),
        ("cut bracket.dxf --ker 2", r"unknown option '--ker'; did you mean '--kerf'\?$"),
        ("cut bracket.dxf --ker=2", r"unknown option '--ker'; did you mean '--kerf'\?$"),
        ("drill plate_10.dxf --no-thickness", r"unknown option '--no-thickness'; did you mean '--thickness'\?$"),
        ("cut bracket.dxf --no-chain", r"unknown option '--no-chain'; did you mean '--no-chains'\?$"),
        ("nest bracket.dxf --qqq 3", r"unknown option '--qqq' \(see leafcut nest --help\)$"),
        ("drill -z plate_10.dxf", r"unknown option '-z' \(see leafcut drill --help\)$"),
        ("optimise plate_10.dxf", r"unknown command 'optimise'; did you mean 'optimize'\?$"),
        ("Drill plate_10.dxf", r"unknown command 'Drill'; did you mean 'drill'\?$"),
        ("labs plate_10.dxf", "unknown command 'labs'; did you mean 'lab'"),
        ("lab plate_10.dxf", "unknown command 'lab plate_10.dxf'; choose one of list, run, report, tune$"),
        ("lab rn x", "unknown command 'lab rn'; did you mean 'run'"),
        ("lab run", r"lab run needs NAME \(see leafcut lab run --help\)$"),
        ("lab run x --reducd", "unknown option '--reducd'; did you mean '--reduced'"),
        ("lab report x --kerf 2", "unknown option '--kerf'|--kerf: not used"),
        ("lab list all", "lab list takes no input, but was given all; leave it out$"),
        ("machines", r"'leafcut machines' was replaced; enter: leafcut list machines \[NAME\]$"),
        ("batch parts", "'leafcut batch' was replaced; enter: leafcut optimize FOLDER -o OUT$"),
        ("list machnes", "list: unknown kind 'machnes'; did you mean 'machines'"),
        ("list formats dxf", "list formats: these have no files to print; leave dxf out$"),
        ("--versio", r"unknown option '--versio'; did you mean '--version'\?$"),
        ("--quiet drill plate_10.dxf", "'--quiet': name the command or the file first: leafcut drill --quiet$"),
        ("--qqq", "'--qqq': name the command or the file first: leafcut FILE --qqq$"),
        ("--thickness 6 plate_10.dxf", "'--thickness': name the command or the file first: leafcut FILE --thickness$"),
        ("list machines haas", "unknown machine 'haas'; did you mean 'haas-vf2'"),
        ("drill plate_10.dxf --seed 1 --seed 2", "--seed is given twice; leave one out$"),
        ("drill plate_10.dxf --json=ja", "--json: 'ja' is not true or false; --json alone turns it on$"),
        ("drill plate_10.dxf --tools nosuch", "--tools nosuch: file not found$"),
        ("drill plate_10.dxf --tools .", r"--tools \.: this is a folder; name a file in it$"),
        ("drill plate_10.dxf --options nosuch", "--options nosuch: file not found$"),
        ("cut bracket.dxf --thickness 6 --plan nosuch", "--plan nosuch: file not found$"),
        ("drill plate_10.dxf --work-offset G54", "--work-offset: 'G54' is not x,y,z, such as '-400,-200,-300'$"),
        ("drill plate_10.dxf --work-offset 1,2", "--work-offset: '1,2' is not x,y,z, such as"),
        ("drill plate_10.dxf --work-offset free", "--work-offset: 'free' is not x,y,z, such as"),
        ("drill plate_10.dxf --start-point here", "--start-point: 'here' is not a point such as '10,20'"),
        (
            "reorder plate_10.dxf",
            r"plate_10\.dxf: reorder: the input is a drawing, not a program; use drill, cut, pocket or part",
        ),
        ("cut cam_121.nc", r"cam_121\.nc: cut: the input is a program, not a drawing; use leafcut reorder"),
        ("pocket", "pocket needs an INPUT"),
        ("verify cam_121.nc", r"verify needs NEW \(see leafcut verify --help\)"),
        ("drill plate_10.dxf --depth", r"--depth needs a value \(see leafcut drill --help\)"),
    ],
)
def test_what_a_command_is_not_for_is_refused_in_one_line(
    words: str, told: str, examples: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(examples)
    assert run(words.split()) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1
    assert re.match(f"leafcut: {told}", err), err
