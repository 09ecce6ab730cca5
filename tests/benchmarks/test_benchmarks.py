"""The benchmarks run, judge tours by themselves, and write nothing but their own section."""

from __future__ import annotations

import itertools
import math
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarked import benchmark
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.options import SolveOptions
from leafcut.solve import stop
from leafcut.solve.instance import build_instance, path_cost
from leafcut.solve.solve import solve

ROOT = Path(__file__).parents[2]


@pytest.fixture
def run(
    data: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., tuple[str, list[list[str]]]]:
    """Return what runs a script as its command does, and returns what it printed and the rows of its table."""
    monkeypatch.setenv("LEAFCUT_DATA", str(data))
    monkeypatch.setattr(stop, "clock", stop.clock)

    def command(script: str, *arguments: str) -> tuple[str, list[list[str]]]:
        monkeypatch.setattr(sys, "argv", [f"{script}.py", *arguments, "--write", str(tmp_path / "b.md")])
        benchmark(script).main()
        printed = capsys.readouterr().out
        lines = [line for line in printed.splitlines() if line.startswith("| ")]
        return printed, [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]

    return command


def gap_of(cell: str) -> float:
    """Return the gap that stands in a cell; at an early time there may be no tour yet."""
    return math.inf if cell.startswith("–") else float(cell.split(maxsplit=1)[0])


def test_the_table_of_leafcut_has_a_gap_for_every_time(run: Any, tmp_path: Path) -> None:
    text, rows = run("tsplib", "kroA100", "--times", "0.1,0.2", "--seeds", "1")
    head, _, row = rows
    assert head == ["board", "nodes", "compared with", "0.1 s", "0.2 s", "clock, s", "processor, s"]
    assert row[:3] == ["kroA100", "100", "21,282 (optimal)"]
    early, late = gap_of(row[3]), gap_of(row[4])
    assert late >= 0.0
    assert early < 30.0 or math.isinf(early)
    for words in ("Date: 20", "Machine: ", "Versions: Python 3", "Command: `python benchmarks/tsplib.py kroA100"):
        assert words in text
    assert f"<!-- tsplib: begin -->\n{text.strip()}\n<!-- tsplib: end -->" in (tmp_path / "b.md").read_text()


def test_every_peer_has_a_line_whether_it_could_be_run_or_not(run: Any) -> None:
    """A peer that is not installed, or cannot take real distances, says why; no gap is below the optimum."""
    options = "--times", "0.2", "--seeds", "1", "--patience", "20"
    _, (head, _, *rows) = run("peers", "kroA100", "uniform:60", *options)
    assert head == ["board", "solver", "0.2 s", "note"]
    solvers = ["leafcut", "nearest neighbour + 2-opt", "fast-tsp", "LKH (elkai)", "OR-Tools guided local search"]
    assert [row[1] for row in rows] == 2 * solvers
    for board, solver, cell, note in rows:
        if solver in solvers[:2]:
            assert note == ""
        assert note or re.fullmatch(r"(–|-?\d+\.\d{3}) \(\d+\.\d / \d+\.\d\)", cell)
        if board.startswith("uniform") and solver not in solvers[:2]:
            assert note.startswith("not run: ")


def test_the_judge_of_tours_agrees_with_published_optima(data: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from leafcut.read.tsplib import read_tour

    monkeypatch.setenv("LEAFCUT_DATA", str(data))
    boards = benchmark("boards")
    for name in ("kroA100", "pcb442"):
        board, tour = boards.load(name), read_tour(data / "tsplib" / f"{name}.opt.tour")
        assert boards.checked_length(board, tour, stated=board.reference) == board.reference
        assert boards.matrix(board, "int64")[tour, np.roll(tour, -1)].sum() == board.reference
    assert boards.load("mona-lisa100K").reference == 5_757_191


def test_the_judge_of_tours_refuses_what_is_no_tour_or_not_as_long_as_stated() -> None:
    boards = benchmark("boards")
    board = boards.uniform(5)
    length = boards.checked_length(board, [0, 1, 2, 3, 4])
    for tour, stated in (([0, 1, 2, 3], None), ([0, 1, 2, 3, 3], None), ([0, 1, 2, 3, 4], length * 1.000001)):
        with pytest.raises(AssertionError, match="uniform:5: the tour"):
            boards.checked_length(board, tour, stated)


def test_distances_are_rounded_as_tsplib_says() -> None:
    """√2 = 1.41 and √8 = 2.83: to the nearest 1 and 3, upwards 2 and 3."""
    boards = benchmark("boards")
    distances = np.sqrt([2.0, 8.0])
    assert boards.rounded("EUC_2D", distances).tolist() == [1.0, 3.0]
    assert boards.rounded("CEIL_2D", distances).tolist() == [2.0, 3.0]
    assert boards.rounded("EUC_2D", np.array([2.5])).tolist() == [3.0]
    with pytest.raises(ValueError, match="GEO"):
        boards.rounded("GEO", distances)


def test_a_gap_is_read_from_the_history_as_it_was_then() -> None:
    tsplib, boards = benchmark("tsplib"), benchmark("boards")
    run = tsplib.Run(((0.1, 300.0), (0.5, 220.0), (2.0, 210.0)), np.zeros(0, np.int32), 210.0, 2.0, 2.0)
    assert [run.length_at(t) for t in (0.05, 0.1, 0.49, 1.0, 9.0)] == [np.inf, 300.0, 300.0, 220.0, 210.0]
    board = boards.Board("b", np.zeros((3, 2)), "EUC_2D", 200.0, "optimal")
    assert tsplib.gap_words(board, [220.0, 210.0, 200.0]) == "5.000 (0.000 to 10.000)"
    assert tsplib.gap_words(board, [210.0, 210.0, np.inf]) == "5.000 (5.000 to –)"
    assert tsplib.gap_words(board, [np.inf]) == "–"


def test_a_peer_that_fails_says_why_and_a_wrong_tour_ends_the_benchmark(monkeypatch: pytest.MonkeyPatch) -> None:
    peers = benchmark("peers")
    sent: list[Any] = []
    pipe = type("Pipe", (), {"send": lambda _, message: sent.append(message)})()
    task = peers.Task(1.0, 1, 1)

    def answers(answer: Any) -> Any:
        def prepare(*_: object) -> Any:
            if isinstance(answer, Exception):
                raise answer
            return lambda: answer

        return peers.Peer("one", "", lambda board: "", prepare)

    for answer in (MemoryError(), ([0, 1, 2, 2, 4], None), ([0, 1, 2, 3, 4], 7.0), ([0, 1, 2, 3, 4], None)):
        monkeypatch.setattr(peers, "PEERS", (answers(answer),))
        peers.work(pipe, 0, "uniform:5", task)
    failed, _, wrong, _, misstated, _, good = sent
    assert (failed.why, peers.cell([failed])) == ("MemoryError", "–")
    assert isinstance(wrong, AssertionError)
    assert isinstance(misstated, AssertionError)
    assert good.why == ""


def test_a_section_is_replaced_and_the_others_stay(tmp_path: Path) -> None:
    page, file = benchmark("page"), tmp_path / "benchmarks.md"
    page.write_section(file, "one", "first")
    page.write_section(file, "two", "second")
    file.write_text(file.read_text() + "\nby hand\n")
    before = file.read_text()
    page.write_section(file, "one", "first, again")
    assert file.read_text() == before.replace("\nfirst\n", "\nfirst, again\n")
    file.write_text("<!-- one: begin -->\nno end")
    with pytest.raises(ValueError, match="does not end"):
        page.write_section(file, "one", "x")


SECTION = """## Two boards

* Date: {date}
* Machine: a processor, 2 cores
* Versions: Python 3.11.7, leafcut 0.1.0, numpy 2.4.6, commit {commit}
* Command: `python benchmarks/tsplib.py a b`

| board | gap | judged |
| --- | ---: | --- |
| a | {gap} | yes |
| b | 1.5 | yes |
"""


def test_what_is_written_into_the_pages_is_kept_and_shown_side_by_side(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    page, history = benchmark("page"), benchmark("history")
    file = tmp_path / "history.jsonl"
    monkeypatch.setattr(page, "DOCS", tmp_path)
    monkeypatch.setattr(page, "keep", lambda name, text: history.keep(name, text, file))
    for date, commit, gap in (("2026-01-02", "aaa", "0.5"), ("2026-03-04", "bbb", "0.25")):
        page.write_section(tmp_path / "benchmarks.md", "boards", SECTION.format(date=date, commit=commit, gap=gap))
    first, second = history.records(file)
    assert (first["date"], first["version"], first["commit"]) == ("2026-01-02", "0.1.0", "aaa")
    assert second["tables"] == [
        {"head": ["board", "gap", "judged"], "rows": [["a", "0.25", "yes"], ["b", "1.5", "yes"]]}
    ]
    history.import_page(tmp_path / "benchmarks.md", file)
    assert len(history.records(file)) == 2
    assert history.main(["boards", "--history", str(file)]) == 0
    shown = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert shown[0] == ["2026-01-02", "aaa", "2026-03-04", "bbb"]
    assert ["a", "·", "gap", "0.5", "0.25"] in shown
    assert history.main(["boats", "--history", str(file)]) == 2


def test_figures_that_no_page_of_the_documents_holds_are_not_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page, kept = benchmark("page"), []
    monkeypatch.setattr(page, "keep", lambda *record: kept.append(record))
    page.write_section(tmp_path / "benchmarks.md", "boards", SECTION)
    assert kept == []


def test_the_history_holds_what_the_page_shows() -> None:
    """Every section on the page is the last one of its name."""
    history = benchmark("history")
    last = {record["section"]: record for record in history.records()}
    page = (ROOT / "docs" / "benchmarks.md").read_text(encoding="utf-8")
    names = re.findall(r"<!-- (.+): begin -->", page)
    assert len(names) >= 20
    for name in names:
        text = page.partition(f"<!-- {name}: begin -->")[2].partition(f"<!-- {name}: end -->")[0]
        now = history.record_of(name, text)
        assert not now["tables"] or last[name] == now, name


def test_one_thread_and_several_are_compared_on_every_board(run: Any) -> None:
    options = "--times", "0.2", "--seeds", "2"
    _, (head, _, row) = run("threads", "kroA100", *options)
    assert head == ["board", "seconds", "one thread", "2 threads", "ratio", "shorter"]
    assert row[0] == "kroA100"
    assert row[4] == "nan" or 0.7 < float(row[4]) < 1.3 or "–" in row[2] + row[3]
    assert row[5] in ("0 of 2", "1 of 2", "2 of 2")


def test_nests_stand_beside_the_best_known_with_the_density_of_their_length(run: Any) -> None:
    """The pieces of fu cover 1083 of a strip 38.0038 wide; sparrow's record is 30.843 long, 92.39 %."""
    _, (head, _, row) = run("nesting", "fu", "--time", "1")
    assert head[:7] == ["instance", "pieces", "length", "best known", "density, %", "best known, %", "points"]
    assert row[:2] == ["fu", "12"]
    assert float(row[4]) == pytest.approx(100.0 * 1083.0 / (38.0038 * float(row[2])), abs=0.02)
    assert (row[3], row[5]) == ("30.843", "92.39")
    assert float(row[6]) == pytest.approx(float(row[4]) - 92.39, abs=0.011)


def test_the_judge_of_nests_refuses_what_overlaps_is_missing_or_leaves_the_strip() -> None:
    """Two unit squares in a strip of width 1: side by side they fill a length of 2 and the gap between them."""
    from leafcut.model.nest import Layout, Nest, Placement, Stock

    nesting = benchmark("nesting")
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]])
    strip = nesting.Strip("two", 1.0, ((square, 2, (0.0,)),), 2.0, 100.0)
    side, (length, width) = strip.scale, strip.options().sheets[0].size or (0.0, 0.0)

    def judged(*places: tuple[float, float]) -> tuple[float, float]:
        laid = tuple(Placement(0, 0.0, x, y) for x, y in places)
        parts = tuple(strip.parts())
        return strip.judged(Nest(parts, (Stock(length, width),), (Layout(laid),), (2 - len(laid),)))

    assert judged((0.0, 0.0), (side + 0.1, 0.0)) == pytest.approx((2.0 + 0.1 / side, 100.0), rel=1e-4)
    for places in (((0.0, 0.0), (0.9 * side, 0.0)), ((0.0, 0.0),), ((0.0, 0.0), (side + 1.0, 2.0))):
        with pytest.raises(SystemExit, match="two: "):
            judged(*places)


def test_routes_of_sheets_are_beside_the_published_ones(run: Any) -> None:
    """The published tour is counted again; of the sheet whose tour breaks inner before outer both rules are shown."""
    options = "--only", "routes", "--sheets", "8877,E1X_6", "--limit", "0.3"
    _, (head, _, *rows) = run("sheets", *options)
    assert head[:5] == ["sheet", "contours", "places", "published, mm", "leafcut, mm"]
    assert [row[0] for row in rows] == ["8877, looser rule", "8877", "E1X_6"]
    assert rows[0][3] == "7,631 (PCGLNS)"
    assert rows[2][1:3] == ["16", "180"]
    assert int(rows[2][4].replace(",", "")) >= 1513


def test_the_judge_of_sheets_refuses_an_outer_contour_before_its_inner_one() -> None:
    """It shares nothing with the solver: 1 lies in 2, which lies in 3; by the looser rule only 3-1 is refused."""
    places = benchmark("sheets").Places([(0, 0), (3, 4), (3, 0), (0, 4)], [0, 1, 2, 3], [(1, 2), (2, 3)])
    assert places.judged([0, 1, 2, 3], loose=False) == 5 + 4 + 5 + 4
    assert places.judged([2, 3, 0, 1], loose=False) == 18
    with pytest.raises(SystemExit):
        places.judged([0, 1, 3, 2], loose=False)
    with pytest.raises(SystemExit):
        places.judged([0, 3, 1, 2], loose=True)


def test_fireflies_are_judged_on_cities_and_on_grids(run: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """No gap is below the bound beside it; with local search the small circle's grid is ordered as well as can be."""
    monkeypatch.setattr(benchmark("firefly"), "BOUND_S", 0.3)
    options = "--pockets", "p2_circle", "--times", "0.5,0.5", "--seeds", "1"
    text, rows = run("firefly", "kroA100", *options)
    (_, _, city), (head, _, grid) = rows[:3], rows[3:]
    assert city[:2] == ["kroA100", "100"] and float(city[4]) == 0.0 <= float(city[2])
    assert head[:4] == ["instance", "N", "bound, %", "LKH, %"]
    assert grid[:2] == ["p2_circle", "261"]
    assert float(grid[2]) - 0.01 <= float(grid[6]) <= 0.5 and float(grid[6]) <= float(grid[4]) < 5.0
    assert "The mean with local search is 0.000 %." in text


def test_forgetting_is_measured_with_and_without(run: Any) -> None:
    """On seven jobs both find the best order of all."""
    _, (head, _, row) = run("forgetting", "ESC07", "--time", "0.2", "--seeds", "1")
    assert head == ["instance", "pairs", "kicks alone", "kicks and forgetting by turns"]
    assert row[0] == "ESC07"
    assert row[2:] == ["0.00", "0.00"]


def test_the_best_bound_by_one_trees_is_the_optimum_of_five_nodes_and_just_above_leafcuts_of_more() -> None:
    """Of up to five nodes a fractional tour is none (Grötschel and Padberg 1979); brute force has the optimum."""
    ceiling = benchmark("held_karp").ceiling
    for seed in range(5):
        few, more = (
            RoutingProblem.of_points(np.random.default_rng(seed).uniform(0, 100, (n, 2)), Metric(), closed=True)
            for n in (5, 60)
        )
        orders = [np.array((0, *rest), dtype=np.int32) for rest in itertools.permutations(range(1, 5))]
        assert ceiling(build_instance(few, 4)) == pytest.approx(min(path_cost(few, order) for order in orders))
        most = ceiling(build_instance(more, 59))
        found = solve(more, SolveOptions(preset="fast", threads=1))
        assert found.lower_bound is not None
        assert 0.995 * most <= found.lower_bound <= most + 1e-6
        assert most <= found.cost + 1e-6


def test_a_loose_set_is_found_whether_it_is_a_subtour_or_hangs_on_by_half_an_edge() -> None:
    """Two triangles; then joined by two halves, where one edge into each would do."""
    loose_sets = benchmark("held_karp").loose_sets
    triangles = np.array([[0, 0, 1, 3, 3, 4, 2, 0], [1, 2, 2, 4, 5, 5, 3, 5]], dtype=np.int32)
    for joined in (0.0, 0.5):
        taken = np.array([1.0, 1.0, 1.0, 1.0, 1.0, 1.0, joined, joined])
        sets = [set(np.flatnonzero(inside).tolist()) for inside in loose_sets(triangles, taken, 6)]
        assert {frozenset(one) for one in sets} & {frozenset({0, 1, 2}), frozenset({3, 4, 5})}
    whole = np.array([[0, 1, 2, 3, 4, 0], [1, 2, 3, 4, 5, 5]], dtype=np.int32)
    assert loose_sets(whole, np.ones(6), 6) == []


def test_bounds_stand_beside_the_best_by_one_trees(run: Any) -> None:
    _, (head, _, row) = run("held_karp", "lin318")
    assert head == ["board", "nodes", "leafcut", "best by 1-trees"]
    assert row[:2] == ["lin318", "318"]
    # leafcut's is rounded up to a whole number: by 0.003 % at most.
    assert 0.0 < float(row[3]) <= float(row[2]) + 0.003 < 0.4
