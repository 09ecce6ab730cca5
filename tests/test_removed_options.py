"""A removed option is refused by name everywhere, with its replacement."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from leafcut import api
from leafcut.cli.app import run
from leafcut.errors import OptionError
from leafcut.options.removed import REMOVED, removal_message
from leafcut.processes.settings import all_options, collect_settings, read_options_file


def test_no_removed_option_exists_and_every_replacement_does() -> None:
    known = {name for _, name, _ in all_options()} | {"report"}
    assert not known & REMOVED.keys()
    values = " ".join(value for _, *values in REMOVED.values() for value in values)
    new = re.findall(r"--([a-z-]+)", values)
    assert new and {name.replace("-", "_") for name in new} <= known


@pytest.mark.parametrize("name", REMOVED)
def test_a_removed_option_is_refused_by_name_in_a_call_and_in_a_file(name: str, tmp_path: Path) -> None:
    line = removal_message(name)
    assert line.startswith(f"--{name.replace('_', '-')} ") and "\n" not in line
    with pytest.raises(OptionError) as refused:
        collect_settings({name: 1})
    assert str(refused.value) == line
    for k, text in enumerate((f"{name} = 1\n", f"[solve]\n{name} = 1\n")):
        file = tmp_path / f"{k}.toml"
        file.write_text(text)
        with pytest.raises(OptionError) as refused:
            read_options_file(file)
        assert str(refused.value) == f"{file}:{k + 1}: {line}"


@pytest.mark.parametrize("flag", ["--milling-feed=300", "--zigzag-angle=30"])
def test_a_removed_flag_is_refused_by_name_on_the_command_line(flag: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["pocket", "none.dxf", flag]) == 2
    assert removal_message(flag[2:].partition("=")[0].replace("-", "_")) in capsys.readouterr().err


def test_a_removed_keyword_of_the_library_is_refused_by_name() -> None:
    with pytest.raises(OptionError, match="--milling-feed is now --feed"):
        api.optimize("example:plate-10", milling_feed=300)  # type: ignore[call-arg]
