"""One-line messages for invalid command lines. The parser's own messages would name its internals."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from leafcut.errors import OptionError, closest_names, did_you_mean, name_suggestion, printable
from leafcut.message import Message
from leafcut.options.option_spec import OptionSpec
from leafcut.options.removed import removal_message

if TYPE_CHECKING:
    from cyclopts import CycloptsError, UnknownOptionError

#: Commands with subcommands: their help, and the function of each subcommand.
GROUPS = {
    "machine": (
        "Make a machine profile, and check it with a stop-watch.",
        {
            "import": "leafcut.cli.machine:import_machine",
            "new": "leafcut.cli.machine:new_machine",
            "check": "leafcut.cli.machine:check_machine",
        },
    ),
    "tools": (
        "Make a tool library from one of another program, and choose speeds and feeds.",
        {"import": "leafcut.cli.machine:import_tools", "speeds": "leafcut.cli.tools:tool_speeds"},
    ),
    "install": (
        "Install add-ons, completion of your shell, and compiled kernels.",
        {
            "addon": "leafcut.cli.install:install_addon",
            "completion": "leafcut.cli.install:install_completion",
            "kernels": "leafcut.cli.install:install_kernels",
        },
    ),
    "lab": (
        "Repeat published experiments, and your own, with statistics.",
        {
            "list": "leafcut.cli.lab:list_experiments",
            "run": "leafcut.cli.lab:run_experiment",
            "report": "leafcut.cli.lab:report_experiment",
            "tune": "leafcut.cli.lab:tune_parameters",
        },
    ),
}

#: Standard input or output, and its placeholder: the parser would read the dash as a flag, so an impossible file name
#: replaces it.
DASH, HELD = "-", "\0"


#: (flag, name of the option) → reason why the command lacks the option.
WhyUnused = Callable[[str, str], str]


def refuse_standard_input(flag: str, *words: str | None) -> None:
    """Raise OptionError if one of the words is ``-``; `flag` is an argument or flag that accepts only files."""
    if any(word in (DASH, HELD) for word in words):
        raise OptionError("{} -: cannot be read from standard input; name a file", flag)


def command_name(arguments: Sequence[str]) -> str:
    """Return the command in a command line, such as ``lab run``, or ""."""
    words = [word for word in arguments if not word.startswith("-")][:2]
    return " ".join(words[: 1 + (len(words) > 1 and words[1] in _group_commands(words[0]))])


def _group_commands(group: str) -> Iterable[str]:
    return GROUPS[group][1] if group in GROUPS else ()


def usage_message(
    problem: CycloptsError,
    command: str,
    commands: Iterable[str],
    options: Mapping[str, OptionSpec],
    reason_unused: WhyUnused,
) -> str:
    """Return the message for a command line that the parser refuses.

    `command` is the requested command, or "". `reason_unused` returns the reason why an option exists only for other
    commands, or "" if this command has it.
    """
    from cyclopts import (
        CoercionError,
        MissingArgumentError,
        RepeatArgumentError,
        UnknownCommandError,
        UnknownOptionError,
        UnusedCliTokensError,
    )

    help_of = (
        f"(see leafcut {command} --help)" if command.split(" ", maxsplit=1)[0] in commands else "(see leafcut --help)"
    )
    match problem:
        case UnknownCommandError():
            word = (problem.unused_tokens or [""])[0]
            if command in GROUPS:
                return f"unknown command '{command} {printable(word)}'{name_suggestion(word, _group_commands(command))}"
            return _unknown_command(word, command, commands)
        case UnknownOptionError():
            return _unknown_option(problem, options, reason_unused, help_of)
        case UnusedCliTokensError():
            words = ", ".join(printable(word) for word in problem.unused_tokens or ())
            return f"{command} takes no input, but was given {words}; leave it out"
        case RepeatArgumentError():
            return f"{problem.token.keyword if problem.token else ''} is given twice; leave one out"
        case MissingArgumentError():
            name = problem.keyword or (problem.argument.name if problem.argument else "")
            return f"{name} needs a value {help_of}" if problem.keyword else f"{command} needs {name} {help_of}"
        case CoercionError() if problem.token is not None and problem.target_type is bool:
            flag = problem.token.keyword
            return f"{flag}: '{printable(problem.token.value)}' is not true or false; {flag} alone turns it on"
    return " ".join(str(problem).split()) + f" {help_of}"


def _unknown_command(word: str, command: str, commands: Iterable[str]) -> str:
    if word.startswith("-"):
        if near := closest_names(word, ["--help", "--version"]):
            return Message("unknown option '{}'{}", printable(word), did_you_mean(near))
        first = command if command in commands else "FILE"
        return f"'{printable(word)}': name the command or the file first: leafcut {first} {printable(word)}"
    return Message("unknown command '{}'{}", printable(word), name_suggestion(word, commands))


def _unknown_option(
    problem: UnknownOptionError, options: Mapping[str, OptionSpec], reason_unused: WhyUnused, help_of: str
) -> str:
    flag = (problem.token.keyword or problem.token.value).partition("=")[0]
    name = flag.removeprefix("--").replace("-", "_")
    positive = name.removeprefix("no_")
    if positive in options and (name == positive or options[positive].kind == "flag"):
        reason = reason_unused(flag, positive)
        if reason:
            return reason
    if message := removal_message(name):
        return message
    # Compare the names without dashes, which all flags share.
    names = [entry for argument in problem.argument_collection for entry in argument.names if entry.startswith("-")]
    known = {entry.lstrip("-"): entry for entry in names}
    closest = [known[name] for name in closest_names(flag.lstrip("-"), known)]
    return f"unknown option '{printable(flag)}'" + (did_you_mean(closest) if closest else f" {help_of}")
