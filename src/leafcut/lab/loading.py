"""Find and read the TOML description of an experiment."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Any

from leafcut.errors import DataError, LeafcutError, OptionError, ReadError, nearest
from leafcut.files.schemas import EXPERIMENT
from leafcut.files.whole_files import parse_toml, toml_bytes
from leafcut.lab.description import (
    ANALYSES,
    MOST_SEEDS,
    OPTIMIZE,
    SOLVE,
    Analysis,
    Description,
    Factor,
    LabInstance,
    Level,
    Published,
    Response,
)
from leafcut.lab.description_table import DescriptionTable, number_of, word_of
from leafcut.options.option_spec import flag_name
from leafcut.processes import registry
from leafcut.processes.base import Work
from leafcut.processes.job import machine_of
from leafcut.processes.settings import collect, placed_in, why_unused

#: Experiments that come with leafcut.
_SHIPPED = resources.files("leafcut.lab") / "shipped"


def shipped_names() -> list[str]:
    """Return the names of the included experiments, without reading them."""
    return sorted(file.name.removesuffix(".toml") for file in _SHIPPED.iterdir() if file.name.endswith(".toml"))


def shipped() -> dict[str, str]:
    """Return the included experiments: name → title."""
    return {name: load(name).title for name in shipped_names()}


def load(name: str | Path) -> Description:
    """Return an experiment by its name, or by the path of its TOML file.

    Raises
    ------
    OptionError
        The name is unknown.
    DataError
        The file is not TOML, or its content is invalid.
    ReadError
        The file cannot be read.
    """
    if str(name).lower().endswith(".toml"):
        path = Path(name)
        try:
            content = toml_bytes(path)
        except OSError as problem:
            raise ReadError(path, f"cannot be read ({problem.strerror})") from None
        try:
            return described(parse_toml(content, str(path), EXPERIMENT), path.stem, path.parent)
        except DataError:
            raise
        except OptionError as problem:  # the command line is right, the file is not
            raise DataError(str(problem)) from None
    file = _SHIPPED / f"{name}.toml"
    if not re.fullmatch(r"[A-Za-z0-9_-]+", str(name)) or not file.is_file():
        raise OptionError(f"unknown experiment '{name}'{nearest(str(name), shipped_names())}; or give a TOML file")
    return described(parse_toml(file.read_bytes(), str(name), EXPERIMENT), str(name), None)


def described(content: Mapping[str, Any], name: str, folder: Path | None) -> Description:
    """Return the experiment in a parsed TOML file; its files are relative to `folder`.

    Without a folder, they are those included with leafcut.

    Raises
    ------
    OptionError
        A key or a name is unknown, a value has the wrong type, or there is nothing to run.
    """
    folder = folder if folder is not None else Path(str(resources.files("leafcut.lab") / "parts"))
    table = DescriptionTable(content, name, "")
    table.check(
        {"title", "about", "source", "command", "new_process", "cores", "seeds", "options", "instance", "factor"}
        | {"response", "analysis", "published", "notes", "reduced"}
    )
    command = table.text("command", OPTIMIZE)
    commands = [SOLVE, OPTIMIZE, *(one.command for one in registry.processes())]
    if command not in commands:
        raise table.wrong(f"unknown command '{command}'{nearest(command, commands)}")
    factors = tuple(_factor(one, folder) for one in table.tables("factor"))
    made = Description(
        name=name,
        title=table.text("title", name),
        about=" ".join(table.text("about", "").split()),
        command=command,
        instances=tuple(_instance(one, folder) for one in table.list_of_tables("instance")),
        factors=factors,
        responses=tuple(_response(one) for one in table.tables("response")),
        seeds=_seeds(table),
        options=_placed(folder, table.table("options")),
        analyses=(),
        published=tuple(_published(one) for one in table.list_of_tables("published")),
        source=table.text("source", ""),
        notes=tuple(table.texts("notes")),
        new_process=table.flag("new_process"),
        cores=table.text("cores", ""),
        short=_short(table.table("reduced"), folder),
    )
    if not made.responses:
        raise table.wrong('no table [response.NAME]: say what is measured, such as path = "after.time_s"')
    for what, names in (("instance", [i.name for i in made.instances]), ("factor", [f.name for f in factors])):
        if double := next((one for one in names if names.count(one) > 1), None):
            raise table.wrong(f"two {what}s are called '{double}'")
    if made.cores and made.cores not in [one.name for one in factors if one.numeric]:
        raise table.wrong(f"cores = '{made.cores}' is no factor whose levels are numbers")
    made = replace(made, analyses=tuple(_analysis(one, made) for one in table.list_of_tables("analysis")))
    _check_options(made)
    if made.short:
        in_short(made)
    return made


def _instance(table: DescriptionTable, folder: Path) -> LabInstance:
    table.check({"name", "input", "options", "facts"})
    source = table.text("input")
    if not re.match(r"[a-z]+:", source):
        source = str(folder / source)
    facts = {name: table.as_number(f"facts.{name}", value) for name, value in table.table("facts").items()}
    return LabInstance(table.text("name", Path(source).stem), source, _placed(folder, table.table("options")), facts)


def _factor(table: DescriptionTable, folder: Path) -> Factor:
    table.check({"title", "option", "levels", "level"})
    option, levels = table.text("option", ""), table.content.get("levels", [])
    named = [Level(name, _placed(folder, options), None) for name, options in table.dicts("level").items()]
    if bool(option) != bool(levels) or bool(levels) == bool(named) or not isinstance(levels, list):
        raise table.wrong("give option = and levels = [...], or tables level.NAME of options")
    simple = [Level(word_of(one), _placed(folder, {option: one}), number_of(one)) for one in levels]
    made = tuple(named or simple)
    if len({one.name for one in made}) < len(made):
        raise table.wrong("two levels are the same")
    return Factor(table.name, table.text("title", table.name.replace("_", " ").capitalize()), made)


def _response(table: DescriptionTable) -> Response:
    table.check({"title", "unit", "path", "scale", "more_is_better"})
    return Response(
        table.name,
        table.text("title", table.name.replace("_", " ").capitalize()),
        table.text("unit", ""),
        table.text("path"),
        table.as_number("scale", table.content.get("scale", 1.0)),
        table.flag("more_is_better"),
    )


def _analysis(table: DescriptionTable, of: Description) -> Analysis:
    table.check({"kind", "response", "factors", "alpha", "base", "without", "boards", "against", "fact"})
    kind, response = table.text("kind"), table.text("response", of.responses[0].name)
    factors = table.texts("factors") or [one.name for one in of.factors]
    alpha = table.as_number("alpha", table.content.get("alpha", 0.05))
    known = {
        "kind": (kind, ANALYSES),
        "response": (response, [one.name for one in of.responses]),
        **{f"factor {one}": (one, [f.name for f in of.factors]) for one in factors},
    }
    for what, (word, words) in known.items():
        if word not in words:
            raise table.wrong(f"unknown {what.split()[0]} '{word}'{nearest(word, words)}")
    if not 0.0 < alpha < 0.5:
        raise table.wrong(f"alpha = {alpha:g} is out of range; choose a number between 0 and 0.5")
    needed = {"anova": 1, "compare": 1, "crossed": 2, "speedup": 1, "trend": 1, "projection": 1}.get(kind)
    if needed is not None and len(factors) != needed:
        raise table.wrong(f"'{kind}' is of {needed} factor{'s' * (needed > 1)}; {len(factors)} given")
    base = table.text("base", "")
    if base and base not in [one.name for f in factors for one in of.factor(f).levels]:
        raise table.wrong(f"base '{base}' is no level of {', '.join(factors)}")
    without = tuple(table.texts("without"))
    for one in without:
        if one not in [instance.name for instance in of.instances]:
            raise table.wrong(f"unknown instance '{one}'{nearest(one, [i.name for i in of.instances])}")
    if kind == "pareto" and len(of.responses) < 2:
        raise table.wrong("'pareto' needs two responses")
    against = table.text("against", "")
    if against and (against == response or against not in [one.name for one in of.responses]):
        raise table.wrong(
            f"against '{against}': name another response{nearest(against, [r.name for r in of.responses])}"
        )
    boards = table.content.get("boards", [])
    if not isinstance(boards, list) or any(type(one) is not int or one < 1 for one in boards):
        raise table.wrong("boards: a list of whole numbers from 1 on is needed")
    if kind in ("trend", "projection") and not base:
        raise table.wrong(f"'{kind}' needs base = a level of {factors[0]}, which the others are compared with")
    return Analysis(kind, response, tuple(factors), alpha, base, without, tuple(boards), against, _fact(table, of))


def _fact(table: DescriptionTable, of: Description) -> str:
    """Return the known figure that is the reference of a comparison; empty for none."""
    fact, known = table.text("fact", ""), {name for one in of.instances for name in one.facts}
    if fact and (table.text("kind") != "compare" or table.text("base", "")):
        raise table.wrong("fact: a comparison takes it, in place of a base")
    if fact and fact not in known:
        raise table.wrong(f"unknown fact '{fact}'{nearest(fact, known)}")
    return fact


def _published(table: DescriptionTable) -> Published:
    table.check({"title", "source", "columns", "rows", "note"})
    columns, rows = table.texts("columns"), table.content.get("rows", [])
    if not isinstance(rows, list) or any(not isinstance(row, list) or len(row) != len(columns) for row in rows):
        raise table.wrong(f"each of the rows needs {len(columns)} values, as many as there are columns")
    told = tuple(tuple(word_of(value) for value in row) for row in rows)
    return Published(table.text("title"), table.text("source", ""), tuple(columns), told, table.text("note", ""))


def _seeds(table: DescriptionTable) -> tuple[int, ...]:
    """Return the seeds: a list, or 1 to a given number."""
    given = table.content.get("seeds", 1)
    listed = list(range(1, given + 1)) if type(given) is int and 0 < given <= MOST_SEEDS else given
    if not isinstance(listed, list) or not listed or any(type(one) is not int or one < 0 for one in listed):
        raise table.wrong(f"seeds: give how many, 1 to {MOST_SEEDS}, or a list of whole numbers from 0 on")
    if len(set(listed)) < len(listed) or len(listed) > MOST_SEEDS:
        raise table.wrong(f"seeds: each once, and at most {MOST_SEEDS} of them")
    return tuple(listed)


def _chosen(of: Sequence[Any], names: Sequence[str], table: DescriptionTable, what: str) -> tuple[Any, ...]:
    """Return the named items, or all items if no name is given."""
    known = [one.name for one in of]
    for name in names:
        if name not in known:
            raise table.wrong(f"{what}: unknown '{name}'{nearest(name, known)}")
    return tuple(one for one in of if not names or one.name in names)


def _placed(folder: Path, options: Mapping[str, Any]) -> dict[str, Any]:
    """Return options with file paths relative to a folder; unknown options are refused later, with their run."""
    try:
        return placed_in(folder, options)
    except OptionError:
        return dict(options)


def _short(table: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """Return the table of the reduced form with file paths relative to a folder."""
    tables = {name: table[name] for name in ("options", "instance_options") if isinstance(table.get(name), dict)}
    return {**table, **{name: _placed(folder, options) for name, options in tables.items()}}


def _check_options(made: Description) -> None:
    """Refuse options that are unknown, have an invalid value, or are not used by the command."""
    used = _work(made.command)
    seen = set()
    for run in made.runs():
        shape = (run.instance.name, *(level.name for level in run.levels.values()))
        if shape in seen:
            break
        seen.add(shape)
        try:
            settings = collect(run.options)
            if made.command != SOLVE:
                machine_of(settings)
            for name in run.options:
                if used is not None and name not in used.used():
                    raise OptionError(
                        f"{flag_name(name)}: {why_unused(name, used.title, used.otherwise.get(name, ''))}"
                    )
        except LeafcutError as problem:
            raise OptionError(f"experiment '{made.name}', {run.label}: {problem}") from None


def _work(command: str) -> Work | None:
    """Return the kind of work of a command; None if its input decides."""
    if command == SOLVE:
        return registry.work(SOLVE)
    return next((one for one in registry.processes() if one.command == command), None)


def in_short(of: Description) -> Description:
    """Return the short form: fewer inputs, levels and seeds, and less work per run.

    Raises
    ------
    OptionError
        The file has no short form.
    """
    if not of.short:
        raise OptionError(f"experiment '{of.name}' has no reduced form: its file has no table [reduced]")
    table = DescriptionTable(of.short, of.name, "reduced")
    names = table.texts("instances")
    made = replace(
        of,
        reduced=True,
        options={**of.options, **table.table("options")},
        seeds=_seeds(table) if "seeds" in of.short else of.seeds,
        instances=_chosen(of.instances, names, table, "instances"),
        factors=tuple(
            replace(one, levels=_chosen(one.levels, [*map(word_of, wanted)], table, f"levels of {one.name}"))
            if (wanted := table.table("levels").get(one.name))
            else one
            for one in of.factors
        ),
    )
    over = table.table("instance_options")
    if over:
        made = replace(made, instances=tuple(replace(i, options={**i.options, **over}) for i in made.instances))
    for unknown in set(table.table("levels")) - {one.name for one in of.factors}:
        raise table.wrong(f"levels of '{unknown}', which is no factor{nearest(unknown, [f.name for f in of.factors])}")
    table.check({"options", "seeds", "instances", "levels", "instance_options"})
    _check_options(made)
    return made
