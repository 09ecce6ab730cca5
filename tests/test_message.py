"""`Message`: the English text, its template and values, and its stored form."""

from __future__ import annotations

import copy
import json
import pickle

import pytest
from hypothesis import given
from hypothesis import strategies as st

from leafcut.errors import PlanError, ReadError, shorten_message
from leafcut.message import Message, map_text, messages_from_json, messages_to_json
from leafcut.model.issue import Issue

TEXTS = st.text()
MESSAGES = st.recursive(
    st.builds(Message, st.just("tool {} is too long for {:.3g} mm"), TEXTS, st.floats()),
    lambda inner: st.builds(Message, st.just("{}: the '{}' is wrong{}"), inner, TEXTS, inner),
    max_leaves=5,
)


def parts(text: str) -> tuple[object, ...]:
    """All that a message holds."""
    return (text.text, text.template, *map(parts, text.values)) if isinstance(text, Message) else (text,)


@given(TEXTS, st.integers(), st.floats())
def test_a_message_reads_like_the_f_string_that_it_replaces(name: str, number: int, size: float) -> None:
    message = Message("{}: {:,} holes of {:.3g} mm, {!r}, {{}}", name, number, size, name)
    assert message == f"{name}: {number:,} holes of {size:.3g} mm, {name!r}, {{}}"
    assert message.template == "{}: {} holes of {} mm, {}, {{}}"
    assert message.template.format(*message.values) == message


@given(MESSAGES)
def test_a_message_is_unchanged_by_pickle_copy_and_json(message: Message) -> None:
    for other in (pickle.loads(pickle.dumps(message)), copy.deepcopy(message)):
        assert parts(other) == parts(message)
    stored = json.dumps(messages_to_json({"issues": [{"message": message, "lines": (1, 2)}]}))
    assert parts(messages_from_json(stored)["issues"][0]["message"]) == parts(message)
    assert json.loads(json.dumps(message)) == message.text


@pytest.mark.parametrize("values", [(), (1, 2)])
def test_each_gap_has_one_value(values: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match="zip"):
        Message("tool {}", *values)


def test_errors_and_issues_keep_the_template() -> None:
    reason = Message("tool {} is unknown", 3)
    error = ReadError("a.nc", reason, 12)
    assert str(error) == "a.nc:12: tool 3 is unknown"
    for text in (str(PlanError(reason)), Issue("L401", reason).message, error.reason, str(error).values[1]):  # type: ignore[attr-defined]
        assert isinstance(text, Message)
        assert (text.template, text.values) == (reason.template, reason.values)
    assert Message("{}; {}", PlanError(reason), "x").values[0].values == ("3",)  # type: ignore[attr-defined]


def test_messages_are_joined() -> None:
    message = Message("tool {}", 3)
    message += "; "
    joined = "a: " + message + Message("see {}", "b")
    assert joined == "a: tool 3; see b"
    assert isinstance(joined, Message)
    assert joined.template == "{}{}"


def test_a_shortened_message_has_shortened_values() -> None:
    name = "a name with many words " * 5
    shortened = shorten_message(Message("'{}' is no {}", name, Message("drill: {}", "x" * 200)))
    assert shortened == shorten_message(f"'{name}' is no drill: {'x' * 200}")
    assert isinstance(shortened, Message)
    assert shortened.template.format(*shortened.values) == shortened


def test_a_message_with_literal_braces_can_be_shortened() -> None:
    message = Message(
        "row {}: {{'operation': number, 'holes': [numbers]}} was expected, but '{}' was found", 1, "x" * 80
    )
    shortened = shorten_message(message)
    assert shortened == shorten_message(message.text)
    assert isinstance(shortened, Message)
    assert shortened.values[0] == "1"


def test_a_function_is_applied_to_plain_texts_and_to_all_values() -> None:
    assert map_text("a", str.upper) == "A"
    mapped = Message("the {} '{}'", Message("hole {}", "b"), "c").map(lambda text: text.replace("b", "B"))
    assert mapped == "the hole B 'c'"
    assert parts(mapped.values[0]) == ("hole B", "hole {}", ("B",))
