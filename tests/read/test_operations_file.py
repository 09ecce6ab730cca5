"""The file of operations as a table: its rules as fields, and changes of its text."""

from __future__ import annotations

import tomllib

import pytest

from leafcut.errors import DataError
from leafcut.read.operations import RuleFields, names_for, parse_rule, with_rule

RULES = (
    "profile", "bore", "ignore", "engrave 0.3mm", "engrave 0.3mm T5", "pocket 3 mm", "pocket 3mm T5 rest T6",
    "vcarve T6", "vcarve 1mm T6 flat T5", "bore + chamfer 0.5mm T6",
)  # fmt: skip


@pytest.mark.parametrize("rule", RULES)
def test_a_rule_is_the_same_after_a_change_of_its_fields_that_is_undone(rule: str) -> None:
    fields = RuleFields.split(rule)
    assert fields.text == rule
    other = fields.changed(operation="ignore")
    assert other.text == "ignore"
    assert parse_rule("A", fields.text, "") == parse_rule("A", rule, "")


def test_a_change_keeps_only_the_fields_that_mean_the_same() -> None:
    pocket = RuleFields.split("pocket 3mm T5 rest T6")
    assert pocket.changed(operation="engrave").text == "engrave 3mm T5"
    assert pocket.changed(operation="profile").text == "profile"
    assert RuleFields.split("profile + chamfer 0.5mm T6").changed(operation="pocket").text == "pocket"


@pytest.mark.parametrize("value", ["mill 3mm", "a + b", "", 5, "profile + bore", "pocket rest T6"])
def test_an_invalid_rule_stays_as_it_is_written(value: object) -> None:
    fields = RuleFields.split(value)
    with pytest.raises(DataError):
        parse_rule("A", fields.text, "a.toml, line 1")


def test_a_new_rule_keeps_the_rest_of_the_file() -> None:
    text = '# mine\nschema = 1\n\n[layer]\n"CUT" = "profile"  # outside\n"*" = "ignore"\n'
    changed = with_rule(text, "cut", "bore")
    assert changed == text.replace("profile", "bore")
    added = with_rule(changed, 'a "b" ñ', "engrave 1mm")
    assert added.startswith(changed.rstrip())
    assert tomllib.loads(added)["layer"] == {"CUT": "bore", "*": "ignore", 'a "b" ñ': "engrave 1mm"}
    assert tomllib.loads(with_rule(added, "*", ""))["layer"] == {"CUT": "bore", 'a "b" ñ': "engrave 1mm"}
    assert tomllib.loads(with_rule("", "", "profile")) == {"layer": {"": "profile"}}
    assert with_rule('[layer]\nA = "bore"\n', "A", "") == ""


def test_an_exact_name_takes_precedence_over_wildcards() -> None:
    assert names_for("Cut", ["*", "CUT", "C*"]) == ["CUT"]
    assert names_for("hole", ["*", "CUT", "h*"]) == ["*", "h*"]
