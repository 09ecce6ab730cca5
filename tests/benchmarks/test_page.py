"""Pages of results, and the command `python -m benchmarks`."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks import __main__ as entry
from benchmarks import experiments, page


def test_a_written_page_holds_the_printed_text_and_its_table_reads_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(page, "RESULTS", tmp_path / "results")
    rows = [["a", "1.5", ""], ["b", "2 (1 to 3)", "late"]]
    text = f"# Title\n\n{page.facts('tsplib', ['a b', '--write'], ['leafcut'])}\n\n"
    text += page.table(["board", "gap, %", "note"], rows) + "\n\nThe end."
    page.publish("tsplib", text, write=False)
    assert not page.RESULTS.exists()
    page.publish("tsplib", text, write=True)
    written = (page.RESULTS / "tsplib.md").read_text(encoding="utf-8")
    assert written == f"{text}\n"
    assert capsys.readouterr().out == 2 * f"{text}\n"
    assert "| --- | ---: | --- |" in written
    assert "* Command: `python -m benchmarks tsplib 'a b' --write`" in written
    assert page.rows_of(written) == rows
    assert page.rows_of("") == []


def test_only_new_sections_of_the_experiments_are_replaced() -> None:
    before = "# Results\n\nIntroduction.\n\n## One\n\nfirst\n\n### Part\n\n## Two\n\nsecond\n"
    after = experiments.replaced(before, ["## Two\n\nnew", "## Three\n\nthird"])
    expected = "# Results\n\nIntroduction.\n\n## One\n\nfirst\n\n### Part\n\n## Two\n\nnew\n\n## Three\n\nthird"
    assert after == expected


def test_the_list_names_every_benchmark_with_a_title(capsys: pytest.CaptureFixture[str]) -> None:
    assert entry.main([]) == 0
    lines = capsys.readouterr().out.splitlines()[2:]
    assert [line.split()[0] for line in lines] == sorted(entry.titles())
    assert {"guard", "golden", "tsplib"} <= set(entry.titles())
    assert all(title.endswith(".") for title in entry.titles().values())


def test_an_unknown_benchmark_is_one_line_and_status_2(capsys: pytest.CaptureFixture[str]) -> None:
    assert entry.main(["boats"]) == 2
    written = capsys.readouterr()
    assert (written.out, written.err.count("\n")) == ("", 1)
    assert written.err.startswith("unknown benchmark 'boats'; choose one of ")
    assert "experiments, fuzz, " in written.err


@pytest.mark.parametrize("name", sorted(entry.titles()))
def test_every_benchmark_has_help(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        entry.main([name, "--help"])
    assert end.value.code == 0
    assert capsys.readouterr().out.startswith(f"usage: python -m benchmarks {name} ")
