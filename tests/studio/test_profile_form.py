"""Form of a machine or a tool: input changes the same text, and a problem is shown at its line."""

from __future__ import annotations

import tomllib
from typing import Any

import pytest

from leafcut.errors import DataError, OptionError
from leafcut.model.tool import CONES
from leafcut.read.machine import shipped_machines
from leafcut.read.machine_keys import PROFILE_KEYS, ProfileKey
from leafcut.read.tool_keys import HOLE_KEYS, TOOL_KEYS
from leafcut.studio.page import library, profile_form
from leafcut.studio.page.profile_form import add_entry, array_entries, form_groups, form_values, remove_entry, set_value
from leafcut.studio.wording import words

TOOLS = library.shipped_text("tools", "example")
GRBL = library.shipped_text("machines", "grbl-3018")
FLAME = library.shipped_text("machines", "plasma-table")


def said(text: str, name: str) -> Any:
    """Return the value of a key, ``table.key``, in a text."""
    value: Any = tomllib.loads(text)
    for part in name.split("."):
        value = value[part]
    return value


def changed_lines(before: str, after: str) -> set[str]:
    return {*after.splitlines()} - {*before.splitlines()}


@pytest.mark.parametrize("name", shipped_machines())
def test_to_type_what_stands_there_already_changes_no_machine(name: str) -> None:
    text = library.shipped_text("machines", name)
    shown = form_values("", tomllib.loads(text))
    assert len(shown) > 10
    made = text
    for key, value in shown.items():
        made = set_value(made, "", 0, key, value)
    before, after = tomllib.loads(text), tomllib.loads(made)
    before.pop("sources"), after.pop("sources")
    assert after == before
    library.check_profile("machines", name, made)


def test_to_type_what_stands_there_already_changes_no_tool() -> None:
    made = TOOLS
    for array in ("tool", "hole"):
        for number, entry in enumerate(array_entries(tomllib.loads(TOOLS), array)):
            for key, value in form_values(array, entry).items():
                made = set_value(made, array, number, key, value)
    assert made == TOOLS  # with its comments and their places


@pytest.mark.parametrize(
    ("name", "typed", "stands"),
    [
        ("max_feed", "900", "900 mm/min"),
        ("max_feed", "1/2 in/s", "1/2 in/s"),
        ("rapid.velocity", ["2000"], "2000 mm/min"),
        ("rapid.velocity", ["2000", "2000", "1 m/min"], ["2000 mm/min", "2000 mm/min", "1 m/min"]),
        ("tool_change.automatic", True, True),
        ("acceleration_factor", "0.9", 0.9),
        ("safe_z", "-1", "-1 mm"),
        ("process", "laser", "laser"),
        ("tool_change.position", ["-10", "-20"], ["-10 mm", "-20 mm"]),
    ],
)
def test_what_is_typed_stands_in_the_file_with_its_unit_and_comments_stay(name: str, typed: Any, stands: Any) -> None:
    text = "# our shop's\n" + GRBL.replace("max_feed = ", "# measured\nmax_feed = ")
    made = set_value(text, "", 0, name, typed)
    assert said(made, name) == stands
    library.check_profile("machines", "mine", made)
    assert {line for line in text.splitlines() if line.startswith("#")} <= {*made.splitlines()}
    assert len(changed_lines(text, made)) <= 2  # its own line, and that of its source
    if name in tomllib.loads(text)["sources"]:
        assert tomllib.loads(made)["sources"][name] == "set by hand"


def test_an_empty_field_takes_its_key_out_and_a_table_that_is_empty_then() -> None:
    assert "safe_z" not in set_value(set_value(GRBL, "", 0, "safe_z", "0"), "", 0, "safe_z", "")
    probing = set_value(GRBL, "", 0, "probe.feed", "200")
    assert said(probing, "probe.feed") == "200 mm/min"
    library.check_profile("machines", "mine", probing)
    assert "probe" not in tomllib.loads(set_value(probing, "", 0, "probe.feed", ""))


def test_tools_and_recipes_are_added_and_taken_out() -> None:
    more = add_entry(add_entry(TOOLS, "tool"), "hole")
    library.check_profile("tools", "mine", set_value(more, "hole", 3, "layer", "*X*"))
    tools = array_entries(tomllib.loads(more), "tool")
    assert (tools[-1]["number"], len(tools)) == (17, 17)
    assert remove_entry(remove_entry(more, "tool", 16), "hole", 3).split() == TOOLS.split()
    assert array_entries(tomllib.loads(add_entry("", "tool")), "tool") == [{"number": 1, "diameter": "6 mm"}]


@pytest.mark.parametrize(
    ("text", "array", "name", "line"),
    [
        ("tool_change = 3", "", "tool_change.position", "'tool_change' is not a table; write [tool_change]"),
        ("tool = 3", "tool", "diameter", "'tool' has no entry 1"),
        ("tool = [1, 2]", "tool", "diameter", "'tool' has no entry 1"),
        ("", "tool", "diameter", "'tool' has no entry 1"),
    ],
)
def test_where_nothing_can_be_put_that_is_said(text: str, array: str, name: str, line: str) -> None:
    with pytest.raises(OptionError) as refused:
        set_value(text, array, 0, name, ["1", "2"] if not array else "6")
    assert str(refused.value) == line
    if array:
        with pytest.raises(OptionError, match="has no entry 1"):
            remove_entry(text, array, 0)


def test_an_entry_is_counted_among_the_entries_alone() -> None:
    text = 'tool = [1, {diameter = "5 mm"}]'
    assert said(set_value(text, "tool", 0, "diameter", "6"), "tool") == [1, {"diameter": "6 mm"}]
    assert said(remove_entry(text, "tool", 0), "tool") == [1]


def wrong_value(key: ProfileKey) -> str:
    return {"flag": '"yes"', "number": '"half"', "whole": "0", "wholes": '"1"'}.get(key.kind, "17.5")


@pytest.mark.parametrize("key", PROFILE_KEYS, ids=lambda key: key.name)
def test_what_is_wrong_with_a_key_of_a_machine_is_marked_at_its_line(key: ProfileKey) -> None:
    """Wherever the key is, its own line is marked, and the message names the field."""
    text = set_value(FLAME, "", 0, "probe.feed", "1 m/min")
    filler = {"quantity": "1", "axes": ["1"] * key.size, "flag": True, "number": "1", "text": "x"}
    value = form_values("", tomllib.loads(text)).get(key.name) or filler.get(key.kind, (*key.choices, "")[0])
    lines = set_value(text, "", 0, key.name, value).splitlines()
    heads = [0, *(k for k, line in enumerate(lines) if line.startswith("["))]
    head = lines.index(f"[{key.table}]") if key.table else 0
    end = next((k for k in heads if k > head), len(lines))
    at = next(k for k in range(head, end) if lines[k].startswith(f"{key.key} ="))
    lines[at] = f"{key.key} = {wrong_value(key)}"
    broken = "\n".join(lines)
    with pytest.raises(DataError) as refused:
        library.check_profile("machines", "mine", broken)
    place = refused.value
    assert (place.line, f"{place.table}.{place.key}".strip(".")) == (at + 1, key.name)


@pytest.mark.parametrize("key", [*TOOL_KEYS, *HOLE_KEYS], ids=lambda key: key.name)
def test_what_is_wrong_with_a_tool_is_marked_in_that_tool(key: ProfileKey) -> None:
    array, number = ("tool", 4) if key in TOOL_KEYS else ("hole", 1)
    lines = TOOLS.splitlines()
    heads = [at for at, line in enumerate(lines) if line == f"[[{array}]]"]
    start = heads[number]
    lines = [line for at, line in enumerate(lines) if not (start < at < start + 9 and line.startswith(f"{key.key} ="))]
    lines.insert(start + 1, f"{key.key} = {wrong_value(key)}")
    with pytest.raises(DataError) as refused:
        library.check_profile("tools", "mine", "\n".join(lines))
    place = refused.value
    assert (place.table, place.number, place.key, place.line) == (array, number + 1, key.key, start + 2)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (GRBL.replace("[rapid]", "[rapid"), 9),
        (GRBL.replace('style = "linear"', 'stile = "linear"'), 10),
        (GRBL.replace('controller = "grbl"\n', ""), 1),
        (GRBL.replace('velocity = "800 mm/min"\n', ""), 9),
        (GRBL.replace('controller = "grbl"', 'controler = "grbl"', 1), 4),
        (GRBL.replace('controller = "grbl"', 'controller = ""', 1), 4),
    ],
)
def test_a_file_that_cannot_be_read_is_marked_where_it_breaks(text: str, line: int) -> None:
    with pytest.raises(DataError) as refused:
        library.check_profile("machines", "mine", text)
    assert refused.value.line == line


@pytest.mark.parametrize("language", ["en", "es"])
def test_every_key_has_a_field_with_its_help_in_the_language_that_is_spoken(language: str) -> None:
    w = words(language)
    for array, keys in (("", PROFILE_KEYS), *profile_form.ARRAYS.items()):
        fields = {field["name"]: field for group in form_groups(w, array, {}) for field in group["fields"]}
        assert list(fields) == [key.name for key in keys]
        for key in keys:
            stem = f"{array}." if array else ""
            for kind, english in (("profile_help", key.help), ("profile_why", key.why), ("profile_bounds", key.bounds)):
                own = w.translated.get(f"{kind}.{stem}{key.name}", "")
                assert bool(own) is (bool(english) and language == "es"), (kind, key.name)
            assert (key.help in fields[key.name]["help"]) is (language == "en")
            assert fields[key.name]["kind"] == key.kind
    if language == "es":
        known = {
            f"{array}.{key.name}".strip(".")
            for array, keys in (("", PROFILE_KEYS), *profile_form.ARRAYS.items())
            for key in keys
        }
        assert {k.partition(".")[2] for k in w.translated if k.startswith("profile_")} <= known


def test_the_choices_of_a_field_are_those_that_the_reader_takes() -> None:
    for key in PROFILE_KEYS:
        for word in key.choices:
            library_text = set_value(GRBL, "", 0, key.name, word)
            library.check_profile("machines", "mine", library_text)
    for key in TOOL_KEYS:
        for word in key.choices:
            text = f'[[tool]]\nnumber = 1\ndiameter = "6 mm"\n{key.name} = "{word}"\n'
            text += 'peck = "1 mm"\ndwell = "1 s"\n' if word in ("G83", "G73", "G82") else ""
            text += 'kind = "tap"\npitch = "1 mm"\n' if word == "G84" else 'pitch = "1 mm"\n' if word == "tap" else ""
            text += 'point_angle = "90deg"\n' if word in CONES else ""
            library.check_profile("tools", "mine", text)
