"""Plug-ins are found by their entry points; a broken plug-in is reported and stops nothing."""

from __future__ import annotations

from typing import Any

import pytest

from leafcut.errors import OptionError
from leafcut.files.plugins import PluginKind, entry_point_file
from packages import Installer


def lengthened(_: str, found: Any) -> int:
    return len(found) + 1


#: A kind of its own: words, of which what counts is one more than their letters.
WORDS = PluginKind("word", "leafcut.words", lambda: ["and"], lengthened, str)


def test_a_plugin_is_what_its_kind_makes_of_what_the_entry_point_names(install: Installer) -> None:
    install("talk", {"leafcut.words": {"hello": "talk:HELLO"}}, {"talk.py": "HELLO = 'hello'"})
    assert WORDS.names() == ("hello",)
    assert WORDS.load("hello") == 6
    assert [(one.name, one.package, one.adds, one.error) for one in WORDS.plugins()] == [("hello", "talk", 6, "")]
    assert WORDS.names_and_descriptions() == [("hello", "6 (of talk)")]


@pytest.mark.parametrize(
    ("code", "why"),
    [
        ("import no_such_module", "ModuleNotFoundError: No module named 'no_such_module'"),
        ("raise SystemExit(3)", "SystemExit: 3"),
        ("raise ValueError('a\\nb' + 'c' * 900)", "ValueError: a b"),
        ("HELLO = 5", "TypeError: object of type 'int' has no len"),
        ("OTHER = ''", "AttributeError: module 'talk' has no attribute 'HELLO'"),
        ("HELLO = (", "SyntaxError: "),
    ],
)
def test_a_broken_one_is_refused_by_name_told_in_the_list_and_stops_no_other(
    install: Installer, code: str, why: str
) -> None:
    install("talk", {"leafcut.words": {"hello": "talk:HELLO"}}, {"talk.py": code})
    install("more", {"leafcut.words": {"bye": "more:BYE"}}, {"more.py": "BYE = 'bye'"})
    assert WORDS.names() == ("bye", "hello")
    assert WORDS.load("bye") == 4
    with pytest.raises(OptionError) as refused:
        WORDS.load("hello")
    assert str(refused.value).startswith(f"the word 'hello' is a plug-in of talk that cannot be used ({why}")
    assert "\n" not in str(refused.value)
    bye, hello = WORDS.plugins()
    assert (bye.adds, hello.adds) == (4, None)
    assert hello.refusal in str(refused.value)
    assert WORDS.names_and_descriptions() == [("bye", "4 (of more)"), ("hello", hello.refusal)]


def test_nothing_of_a_package_is_imported_to_know_its_names(install: Installer) -> None:
    install("talk", {"leafcut.words": {"hello": "talk:HELLO"}}, {"talk.py": "raise SystemExit"})
    assert WORDS.names() == ("hello",)


def test_none_takes_the_name_of_what_is_built_in_nor_one_that_two_packages_give(install: Installer) -> None:
    for package in ("one", "two"):
        install(package, {"leafcut.words": {"and": "json:dumps", "hello": "json:__name__"}})
    assert WORDS.names() == ("hello",)
    with pytest.raises(OptionError, match="two and one both have a word of this name; uninstall one of them"):
        WORDS.load("hello")
    built_in = [one.error for one in WORDS.plugins() if one.name == "and"]
    assert built_in == ["leafcut already has a word of this name"] * 2


def test_of_a_package_that_lies_there_twice_the_first_counts(install: Installer) -> None:
    install("talk", {"leafcut.words": {"hello": "json:no_more"}})
    install("talk", {"leafcut.words": {"hello": "json:__name__"}})
    assert WORDS.load("hello") == len("json") + 1


def test_a_package_whose_entry_points_cannot_be_read_adds_nothing_and_stops_no_other(install: Installer) -> None:
    folder = install("torn", {"leafcut.words": {"hello": "json:__name__"}})
    (folder / "torn-1.0.dist-info" / "entry_points.txt").write_text("[leafcut.words]\nno equals sign\n")
    install("more", {"leafcut.words": {"bye": "json:__name__"}})
    assert WORDS.names() == ("bye",)


def test_a_file_is_named_by_its_package_by_its_path_or_by_a_function(install: Installer) -> None:
    folder = install("mill", {}, {"mill/__init__.py": "", "mill/my.toml": ""})
    import mill

    assert entry_point_file("my", mill) == folder / "mill" / "my.toml"
    for found in (folder / "a.toml", str(folder / "a.toml"), lambda: folder / "a.toml"):
        assert entry_point_file("my", found) == folder / "a.toml"
    with pytest.raises(TypeError, match="a path was expected, not int"):
        entry_point_file("my", 5)
