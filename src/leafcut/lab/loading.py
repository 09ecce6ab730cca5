"""Finds and reads the TOML description of an experiment."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path
from typing import Any

from leafcut.errors import DataError, LeafcutError, OptionError, name_suggestion
from leafcut.files.schemas import EXPERIMENT
from leafcut.files.whole_files import parse_toml, read_toml_text
from leafcut.lab.description import (
    ANALYSES,
    MAX_SEEDS,
    OPTIMIZE,
    RAPID,
    SEARCH,
    SOLVE,
    Analysis,
    Description,
    Factor,
    LabInstance,
    Level,
    Response,
)
from leafcut.message import Message
from leafcut.options.option_spec import flag_name
from leafcut.processes import registry
from leafcut.processes.base import Work
from leafcut.processes.job import machine_of
from leafcut.processes.settings import collect_settings, resolve_files, unused_option_message

#: Experiments that are included with leafcut.
_SHIPPED = resources.files("leafcut.lab") / "shipped"


def value_text(value: Any) -> str:
    """Format the value of a level or a result."""
    return f"{value:g}" if isinstance(value, float) else str(value)


def float_or_none(value: Any) -> float | None:
    """Return a value as float, or None if it is not a number."""
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None


@dataclass(frozen=True)
class DescriptionTable:
    """A table of an experiment file, with its path. Reading a value also checks its type."""

    content: Mapping[str, Any]
    experiment: str
    place: str

    @property
    def name(self) -> str:
        """Last part of the path of the table."""
        return self.place.rpartition(".")[2]

    def error(self, words: str) -> OptionError:
        """Create an error whose message mentions the experiment and the table."""
        return OptionError(f"experiment '{self.experiment}'{f', [{self.place}]' if self.place else ''}: {words}")

    def check_keys(self, known: set[str]) -> None:
        """Raise an error if the table has a key that is not in `known`."""
        for key in self.content:
            if key not in known:
                raise self.error(Message("unknown key '{}'{}", key, name_suggestion(key, sorted(known))))

    def text(self, key: str, default: str | None = None) -> str:
        """Return the text of a key. The key is required if there is no default."""
        value = self.content.get(key, default)
        if not isinstance(value, str):
            raise self.error(f"{key}: a text is needed" + ("" if value is None else f", not {value!r}"))
        return value

    def flag(self, key: str) -> bool:
        """Return the boolean value of a key, or False if the key is missing."""
        value = self.content.get(key, False)
        if not isinstance(value, bool):
            raise self.error(f"{key}: give true or false, not {value!r}")
        return value

    def as_number(self, key: str, value: Any) -> float:
        """Convert a value to a float. Raises an error that mentions `key` if the value is not a number."""
        number = float_or_none(value)
        if number is None:
            raise self.error(f"{key}: a number is needed, not {value!r}")
        return number

    def texts(self, key: str) -> list[str]:
        """Return the list of a key as strings. Numbers are converted."""
        value = self.content.get(key, [])
        if not isinstance(value, list) or any(isinstance(item, dict | list) for item in value):
            raise self.error(f"{key}: a list of texts is needed")
        return [value_text(item) for item in value]

    def table(self, key: str) -> dict[str, Any]:
        """Return the table of a key, or an empty table if the key is missing."""
        value = self.content.get(key, {})
        if not isinstance(value, dict):
            raise self.error(f"{key}: a table is needed")
        return value

    def tables_by_name(self, key: str) -> dict[str, dict[str, Any]]:
        """Return a table that contains only tables."""
        tables = self.table(key)
        for name, entry in tables.items():
            if not isinstance(entry, dict):
                raise self.error(f"{key}.{name}: a table is needed")
        return tables

    def tables(self, key: str) -> list[DescriptionTable]:
        """Return the tables inside a table, in the order of the file."""
        return [
            DescriptionTable(content, self.experiment, f"{key}.{name}")
            for name, content in self.tables_by_name(key).items()
        ]

    def list_of_tables(self, key: str) -> list[DescriptionTable]:
        """Return the tables of an array ([[key]])."""
        value = self.content.get(key, [])
        if not isinstance(value, list) or any(not isinstance(item, dict) for item in value):
            raise self.error(f"{key}: tables [[{key}]] are needed")
        return [DescriptionTable(item, self.experiment, f"{key} {k}") for k, item in enumerate(value, 1)]


def included_names() -> list[str]:
    """Return the sorted names of the included experiments without reading their files."""
    return sorted(file.name.removesuffix(".toml") for file in _SHIPPED.iterdir() if file.name.endswith(".toml"))


def titles_of_included_experiments() -> dict[str, str]:
    """Return the name and the title of each included experiment."""
    return {name: load_experiment(name).title for name in included_names()}


def load_experiment(name: str | Path) -> Description:
    """Load an experiment by its name, or from a TOML file.

    Raises
    ------
    OptionError
        The name is unknown.
    DataError
        The file cannot be read, is not TOML, or has invalid content.
    """
    if str(name).lower().endswith(".toml"):
        path = Path(name)
        text = read_toml_text(path)
        try:
            return experiment_from_toml(parse_toml(text, str(path), EXPERIMENT), path.stem, path.parent)
        except DataError:
            raise
        except OptionError as problem:  # the wrong option is in the file, not on the command line
            raise DataError(str(problem)) from None
    file = _SHIPPED / f"{name}.toml"
    if not re.fullmatch(r"[A-Za-z0-9_-]+", str(name)) or not file.is_file():
        raise OptionError(
            f"unknown experiment '{name}'{name_suggestion(str(name), included_names())}; or give a TOML file"
        )
    return replace(
        experiment_from_toml(parse_toml(file.read_text(encoding="utf-8"), str(name), EXPERIMENT), str(name), None),
        shipped=True,
    )


def experiment_from_toml(content: Mapping[str, Any], name: str, folder: Path | None) -> Description:
    """Create an experiment from parsed TOML.

    File names are relative to `folder`. If `folder` is None, they refer to files that are included with leafcut.

    Raises
    ------
    OptionError
        A key or a name is unknown, a value has the wrong type, or the experiment has no runs.
    """
    folder = folder if folder is not None else Path(str(resources.files("leafcut.lab") / "parts"))
    table = DescriptionTable(content, name, "")
    table.check_keys(
        {"title", "about", "source", "command", "new_process", "cores", "seeds", "options", "instance", "factor"}
        | {"response", "analysis", "notes", "reduced"}
    )
    command = table.text("command", OPTIMIZE)
    commands = [SOLVE, OPTIMIZE, "nest", *(process.command for process in registry.processes())]
    if command not in commands:
        raise table.error(Message("unknown command '{}'{}", command, name_suggestion(command, commands)))
    factors = tuple(_parse_factor(entry, folder) for entry in table.tables("factor"))
    description = Description(
        name=name,
        title=table.text("title", name),
        about=" ".join(table.text("about", "").split()),
        command=command,
        instances=tuple(_parse_instance(entry, folder) for entry in table.list_of_tables("instance")),
        factors=factors,
        responses=tuple(_parse_response(entry) for entry in table.tables("response")),
        seeds=_parse_seeds(table),
        options=_resolve_files(folder, table.table("options")),
        analyses=(),
        source=table.text("source", ""),
        notes=tuple(table.texts("notes")),
        new_process=table.flag("new_process"),
        cores=table.text("cores", ""),
        short=_resolve_short_form(table.table("reduced"), folder),
    )
    if not description.responses:
        raise table.error('no table [response.NAME]: say what is measured, such as path = "after.time_s"')
    for kind, names in (("instance", [i.name for i in description.instances]), ("factor", [f.name for f in factors])):
        if double := next((entry for entry in names if names.count(entry) > 1), None):
            raise table.error(f"two {kind}s are called '{double}'")
    if description.new_process:
        for response in description.responses:
            if re.search(rf"\b(?:{SEARCH}\.|{RAPID}\b)", response.path):
                raise table.error(f"response '{response.path}' is unknown in runs with new_process = true")
    if description.cores and description.cores not in [factor.name for factor in factors if factor.numeric]:
        raise table.error(f"cores = '{description.cores}' is no factor whose levels are numbers")
    description = replace(
        description, analyses=tuple(_parse_analysis(entry, description) for entry in table.list_of_tables("analysis"))
    )
    _check_options(description)
    if description.short:
        reduced_experiment(description)
    return description


def _parse_instance(table: DescriptionTable, folder: Path) -> LabInstance:
    table.check_keys({"name", "input", "options", "facts"})
    source = table.text("input")
    if not re.match(r"[a-z]+:", source):
        source = str(folder / source)
    facts = {name: table.as_number(f"facts.{name}", value) for name, value in table.table("facts").items()}
    return LabInstance(
        table.text("name", Path(source).stem), source, _resolve_files(folder, table.table("options")), facts
    )


def _parse_factor(table: DescriptionTable, folder: Path) -> Factor:
    table.check_keys({"title", "option", "levels", "level"})
    option, levels = table.text("option", ""), table.content.get("levels", [])
    named_levels = [
        _parse_level(name, DescriptionTable(content, table.experiment, f"{table.place}.{name}"), folder)
        for name, content in table.tables_by_name("level").items()
    ]
    if bool(option) != bool(levels) or bool(levels) == bool(named_levels) or not isinstance(levels, list):
        raise table.error("give option = and levels = [...], or tables level.NAME of options")
    simple = [
        Level(value_text(value), _resolve_files(folder, {option: value}), float_or_none(value)) for value in levels
    ]
    all_levels = tuple(named_levels or simple)
    if len({level.name for level in all_levels}) < len(all_levels):
        raise table.error("two levels are the same")
    return Factor(table.name, table.text("title", table.name.replace("_", " ").capitalize()), all_levels)


def _parse_level(name: str, table: DescriptionTable, folder: Path) -> Level:
    options = {option: value for option, value in table.content.items() if option not in ("folder", "without")}
    inputs = str(folder / table.text("folder")) if "folder" in table.content else ""
    value = float(name) if name.isdecimal() else None
    return Level(name, _resolve_files(folder, options), value, inputs, tuple(table.texts("without")))


def _parse_response(table: DescriptionTable) -> Response:
    table.check_keys({"title", "unit", "path", "scale", "more_is_better"})
    return Response(
        table.name,
        table.text("title", table.name.replace("_", " ").capitalize()),
        table.text("unit", ""),
        table.text("path"),
        table.as_number("scale", table.content.get("scale", 1.0)),
        table.flag("more_is_better"),
    )


def _parse_analysis(table: DescriptionTable, description: Description) -> Analysis:
    table.check_keys({"kind", "response", "factors", "alpha", "base", "without", "boards", "against", "fact"})
    kind, response = table.text("kind"), table.text("response", description.responses[0].name)
    responses, instances = ([item.name for item in items] for items in (description.responses, description.instances))
    factors = table.texts("factors") or [factor.name for factor in description.factors]
    alpha = table.as_number("alpha", table.content.get("alpha", 0.05))
    known = {
        "kind": (kind, ANALYSES),
        "response": (response, responses),
        **{f"factor {name}": (name, [f.name for f in description.factors]) for name in factors},
    }
    for kind_of_name, (word, words) in known.items():
        if word not in words:
            raise table.error(Message("unknown {} '{}'{}", kind_of_name.split()[0], word, name_suggestion(word, words)))
    if not 0.0 < alpha < 0.5:
        raise table.error(f"alpha = {alpha:g} is out of range; choose a number between 0 and 0.5")
    needed = {"anova": 1, "compare": 1, "crossed": 2, "speedup": 1, "messages": 2, "trend": 1, "projection": 1}.get(
        kind
    )
    if needed is not None and len(factors) != needed:
        raise table.error(f"'{kind}' is of {needed} factor{'s' * (needed > 1)}; {len(factors)} given")
    base = table.text("base", "")
    if base and base not in [level.name for f in factors for level in description.factor(f).levels]:
        raise table.error(f"base '{base}' is no level of {', '.join(factors)}")
    without = tuple(table.texts("without"))
    for item in without:
        if item not in instances:
            raise table.error(f"unknown instance '{item}'{name_suggestion(item, instances)}")
    if kind == "pareto" and len(responses) < 2:
        raise table.error("'pareto' needs two responses")
    against = table.text("against", "")
    if against and (against == response or against not in responses):
        raise table.error(f"against '{against}': name another response{name_suggestion(against, responses)}")
    boards = table.content.get("boards", [])
    if not isinstance(boards, list) or any(type(count) is not int or count < 1 for count in boards):
        raise table.error("boards: a list of whole numbers from 1 on is needed")
    if kind == "messages" and not against:
        raise table.error("'messages' needs against = the response with the rest of an iteration without its ants")
    if kind in ("trend", "projection", "messages") and not base:
        raise table.error(f"'{kind}' needs base = a level of {factors[0]}, which the others are compared with")
    return Analysis(
        kind,
        response,
        tuple(factors),
        alpha,
        base,
        without,
        tuple(boards),
        against,
        _parse_reference_fact(table, description),
    )


def _parse_reference_fact(table: DescriptionTable, description: Description) -> str:
    """Return the name of the known value that a comparison uses as its reference, or an empty string."""
    fact, known = table.text("fact", ""), {name for instance in description.instances for name in instance.facts}
    if fact and (table.text("kind") != "compare" or table.text("base", "")):
        raise table.error("fact: a comparison takes it, in place of a base")
    if fact and fact not in known:
        raise table.error(f"unknown fact '{fact}'{name_suggestion(fact, known)}")
    return fact


def _parse_seeds(table: DescriptionTable) -> tuple[int, ...]:
    """Return the seeds. The file contains either a list of seeds or their number."""
    given = table.content.get("seeds", 1)
    listed = list(range(1, given + 1)) if type(given) is int and 0 < given <= MAX_SEEDS else given
    if not isinstance(listed, list) or not listed or any(type(seed) is not int or seed < 0 for seed in listed):
        raise table.error(f"seeds: give how many, 1 to {MAX_SEEDS}, or a list of whole numbers from 0 on")
    if len(set(listed)) < len(listed) or len(listed) > MAX_SEEDS:
        raise table.error(f"seeds: each once, and at most {MAX_SEEDS} of them")
    return tuple(listed)


def _select_by_name(items: Sequence[Any], names: Sequence[str], table: DescriptionTable, kind: str) -> tuple[Any, ...]:
    """Select the items with the given names. Without names, select all items."""
    known = [item.name for item in items]
    for name in names:
        if name not in known:
            raise table.error(f"{kind}: unknown '{name}'{name_suggestion(name, known)}")
    return tuple(item for item in items if not names or item.name in names)


def _resolve_files(folder: Path, options: Mapping[str, Any]) -> dict[str, Any]:
    """Resolve the file names in the options relative to `folder`.

    Invalid options remain unchanged. An error message that mentions the run reports them later.
    """
    try:
        return resolve_files(folder, options)
    except OptionError:
        return dict(options)


def _resolve_short_form(table: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    tables = {name: table[name] for name in ("options", "instance_options") if isinstance(table.get(name), dict)}
    return {**table, **{name: _resolve_files(folder, options) for name, options in tables.items()}}


def _check_options(description: Description) -> None:
    used = _find_work(description.command)
    seen = set()
    for run in description.runs():
        shape = (run.instance.name, *(level.name for level in run.levels.values()))
        if shape in seen:
            break
        seen.add(shape)
        try:
            settings = collect_settings(run.options)
            if description.command != SOLVE:
                machine_of(settings)
            for name in run.options:
                if used is not None and name not in used.used():
                    raise OptionError(
                        f"{flag_name(name)}: {unused_option_message(name, used.title, used.otherwise.get(name, ''))}"
                    )
        except LeafcutError as problem:
            raise OptionError(f"experiment '{description.name}', {run.label}: {problem}") from None


def _find_work(command: str) -> Work | None:
    """Return the `Work` of a command, or None if it depends on the input."""
    return next((work for work in registry.works() if work.command == command), None)


def reduced_experiment(description: Description) -> Description:
    """Return the short form of an experiment, with fewer inputs, levels and seeds, and less work per run.

    Raises `OptionError` if the experiment does not have a short form.
    """
    if not description.short:
        raise OptionError(f"experiment '{description.name}' has no reduced form: its file has no table [reduced]")
    table = DescriptionTable(description.short, description.name, "reduced")
    instances = _select_by_name(description.instances, table.texts("instances"), table, "instances")
    instance_options = table.table("instance_options")
    reduced_description = replace(
        description,
        reduced=True,
        options={**description.options, **table.table("options")},
        seeds=_parse_seeds(table) if "seeds" in description.short else description.seeds,
        instances=tuple(replace(i, options={**i.options, **instance_options}) for i in instances),
        factors=tuple(
            replace(
                factor,
                levels=_select_by_name(factor.levels, [*map(value_text, values)], table, f"levels of {factor.name}"),
            )
            if (values := table.table("levels").get(factor.name))
            else factor
            for factor in description.factors
        ),
    )
    for unknown in set(table.table("levels")) - {factor.name for factor in description.factors}:
        raise table.error(
            f"levels of '{unknown}', which is no factor"
            f"{name_suggestion(unknown, [f.name for f in description.factors])}"
        )
    table.check_keys({"options", "seeds", "instances", "levels", "instance_options"})
    _check_options(reduced_description)
    return reduced_description
