"""Programs of other CAMs as a whole: in, put in order, proved, out."""

from __future__ import annotations

import hashlib
import io
import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import leafcut
from leafcut.cli.app import run
from leafcut.errors import LeafcutError, PostError, ReadError
from leafcut.gcode import control_flow
from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.program import Program
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.model.heartbeat import Progress
from leafcut.model.sequence import Sequence
from leafcut.order import solve as solving
from leafcut.processes.program import planning as resequencing
from leafcut.processes.program import proving
from leafcut.processes.program.post.rewriter import rewrite
from leafcut.processes.program.proving import with_comments
from leafcut.processes.registry import report_of
from leafcut.report.wording import operation_work_words
from rewriting import work_of


def boards_program(seed: int, n: int = 97, end: str = "\n") -> str:
    """Return a program that drills a random board in random order."""
    xy = np.random.default_rng(seed).uniform(0, 200, (n, 2))
    first, *rest = [f"X{x:.3f} Y{y:.3f}" for x, y in xy.tolist()]
    top = ["%", "(ÜBERSICHT)", "G21 G90 G17 G94", "T1 M6", "S3000 M3", "G0 Z20."]
    return end.join([*top, f"G99 G81 {first} Z-3. R1. F200.", *rest, "G80", "G0 Z20.", "M5", "M30", "%", ""])


def written(tmp_path: Path, text: str, name: str = "board.nc", encoding: str = "utf-8") -> Path:
    """Write a program and return its path."""
    path = tmp_path / name
    path.write_bytes(text.encode(encoding))
    return path


@pytest.mark.parametrize("line", [":0097", "$X", "$H", "$30=12000", "$110=500"])
def test_a_colon_number_and_commands_of_the_board_stay_and_the_rest_is_ordered(tmp_path: Path, line: str) -> None:
    """A colon stands for O on a Fanuc; senders pass lines with a dollar sign to GRBL."""
    text = boards_program(5, 20).replace("(ÜBERSICHT)", line)
    found = leafcut.optimize(written(tmp_path, text))
    assert found.after.travel_mm < 0.6 * found.before.travel_mm
    assert found.text.splitlines().count(line) == 1
    old, new = written(tmp_path, text), written(tmp_path, found.text, "new.nc")
    assert leafcut.verify(old, new).same
    if line.startswith("$"):
        assert not leafcut.verify(old, written(tmp_path, found.text.replace(line, ""), "less.nc")).same


@pytest.mark.parametrize("library", [False, True])
def test_the_diameter_of_undescribed_mills_frees_passes_that_lie_farther_apart(tmp_path: Path, library: bool) -> None:
    """Pairs of lines at two depths, 5 mm apart, in an order that crosses the plate; a mill of 3 mm cuts no two.

    A library with a wider tool holds the pairs, since that tool may be the mill.
    """
    places = [(10 * (k // 2), *((0, -1), (5, -2))[k % 2]) for k in (5 * i % 16 for i in range(16))]
    cuts = "".join(f"G0 X{x} Y{y}\nG1 Z{z} F100\nX{x + 4}\nG0 Z5\n" for x, y, z in places)
    file = written(tmp_path, f"G21 G90 G17 G94\nT1 M6\nS3000 M3\nG0 Z5\n{cuts}G0 Z20\nM5\nM30\n")
    tools = written(tmp_path, '[[tool]]\nnumber = 9\nkind = "end-mill"\ndiameter = "6 mm"\n', "tools.toml")
    unknown = leafcut.optimize(file, process="reorder")
    known = leafcut.optimize(file, process="reorder", tool_diameter=3, **({"tools": tools} if library else {}))
    new = written(tmp_path, known.text, "new.nc")
    assert known.detail.certificate.same
    assert known.after.travel_mm < unknown.after.travel_mm
    assert leafcut.verify(file, new, tool_diameter=3).same
    assert leafcut.verify(file, new).same is library


@pytest.mark.parametrize("n", [97, *(pytest.param(n, marks=pytest.mark.slow) for n in (121, 200))])
def test_random_order_loses_most_of_its_travel(tmp_path: Path, n: int) -> None:
    """62 % at least, and within the certified gap of the least possible; the holes are the same."""
    path = written(tmp_path, boards_program(n, n))
    found = leafcut.optimize(path)
    assert found.after.travel_mm <= 0.38 * found.before.travel_mm
    assert found.gap is not None
    assert found.gap <= 0.02
    assert found.process == "drill"
    words = load_dialect("linuxcnc")
    new = interpret_program(found.text, words)
    assert work_of(new) == work_of(interpret_program(path.read_text(), words))
    assert found.detail.certificate.same
    assert found.detail.certificate.before.holes == n


@pytest.mark.parametrize("encoding", ["utf-8", "latin-1", "utf-8-sig"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_letters_and_line_ends_stay_as_they_were(tmp_path: Path, encoding: str, end: str) -> None:
    """Every line of the new program is one of the old, or the proof at its top."""
    path, out = written(tmp_path, boards_program(3, 20, end), encoding=encoding), tmp_path / "new.nc"
    leafcut.optimize(path, out)
    old, new = path.read_bytes(), out.read_bytes()
    assert new.startswith(old[: old.index(b"\n") + 1])
    lines = [line for line in new.splitlines(keepends=True) if b"leafcut" not in line]
    assert len(lines) == len(old.splitlines())
    assert "ÜBERSICHT".encode("utf-8" if encoding != "latin-1" else "latin-1") in new
    assert new.count(b"\r\n") == (new.count(b"\n") if end == "\r\n" else 0)


def test_algorithm_none_returns_the_bytes_of_the_input(tmp_path: Path) -> None:
    path, out = written(tmp_path, boards_program(5, 30)), tmp_path / "same.nc"
    found = leafcut.optimize(path, out, algorithm="none")
    assert out.read_bytes() == path.read_bytes()
    assert found.after == found.before


def test_the_same_seed_gives_the_same_program(tmp_path: Path) -> None:
    path = written(tmp_path, boards_program(6, 60))
    one, two = (leafcut.optimize(path, threads=threads, preset="fast") for threads in (1, 2))
    assert one.text == two.text


def test_what_is_not_the_same_work_is_not_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A rewriter that drills one hole deeper: the program stays unchanged, and the reason is shown."""
    path, out = written(tmp_path, boards_program(7, 12)), tmp_path / "new.nc"
    right = rewrite
    monkeypatch.setattr(proving, "rewrite", lambda *a, **k: right(*a, **k).replace("Z-3.", "Z-3.1", 1))
    found = leafcut.optimize(path, out)
    assert out.read_bytes() == path.read_bytes()
    assert found.after == found.before
    issues = [i for i in found.issues if i.code == "L505"]
    assert issues
    assert all("depth -3 became -3.1" in i.message for i in issues)
    assert any(s.reason == "refused" for s in found.detail.staying)
    assert found.gap is None


TWO_SECTIONS = (
    "G21 G90 / T1 M6 / S900 M3 / G0 Z5 / G99 G81 X0 Y0 Z-2 R1 F100 / X50 / X20 / X70 / X10 / G80 / G0 Z20 / "
    "T2 M6 / S900 M3 / G0 Z5 / G81 X0 Y0 Z-4 R1 F100 / X50 / X20 / X70 / X10 / G80 / G0 Z20 / M5 / M2 / "
).replace(" / ", "\n")


def spoilt_second_section(monkeypatch: pytest.MonkeyPatch, error: PostError | None = None) -> None:
    """Have the rewriter drill too deep, or give up, whenever the second section is in another order than its own."""
    right = rewrite

    def wrong(program: Program, sequence: Sequence, orders: list, **options: bool) -> str:
        text = right(program, sequence, orders, **options)
        if (np.diff(orders[1]) == 1).all():
            return text
        if error is not None:
            raise error
        return text.replace("Z-4", "Z-4.1", 1)

    monkeypatch.setattr(proving, "rewrite", wrong)


@pytest.mark.parametrize("error", [None, PostError("no words for it", section=1)])
def test_a_section_that_cannot_be_written_or_proved_keeps_its_own_order(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: PostError | None
) -> None:
    """The other section is put in order all the same."""
    path = written(tmp_path, TWO_SECTIONS)
    spoilt_second_section(monkeypatch, error)
    found = leafcut.optimize(path)
    assert found.after.time_s < found.before.time_s
    lines = [line for line in found.text.splitlines() if "leafcut" not in line]
    assert lines[12:] == TWO_SECTIONS.splitlines()[12:]
    assert lines[4:9] != TWO_SECTIONS.splitlines()[4:9]
    issues = [i for i in found.issues if i.code == "L505"]
    assert {i.place for i in issues} <= {f"line {n}" for n in range(15, 20)}
    assert all(("no words for it" in i.message) == (error is not None) for i in issues)


def test_only_the_piece_that_the_proof_names_keeps_its_place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The rewriter spoils the feed of the fifth of nine holes unless it is fifth: four and four are ordered."""
    drilled = [0, 50, 20, 70, 10, 90, 40, 80, 30]
    lines = [f"G0 X{x} Y0\nG1 Z-2 F{100 + x}\nG0 Z5" for x in drilled]
    path = written(tmp_path, "\n".join(["G21 G90", "T1 M6", "S900 M3", "G0 Z5", *lines, "G0 Z20", "M5", "M2", ""]))
    right = rewrite

    def wrong(program: Program, sequence: Sequence, orders: list, **options: bool) -> str:
        text = right(program, sequence, orders, **options)
        return text if np.flatnonzero(orders[0] == 4) == 4 else text.replace("F110", "F111")

    monkeypatch.setattr(proving, "rewrite", wrong)
    found = leafcut.optimize(path)
    places = [int(float(x)) for x in re.findall(r"^(?:G0 )?X(\S+)", found.text, re.MULTILINE)]
    assert places == [0, 20, 50, 70, 10, 30, 40, 80, 90]
    (issue,) = (i for i in found.issues if i.code == "L505")
    assert issue.place == "line 17"
    assert [(one.reason, one.count) for one in found.detail.staying if one.reason == "refused"] == [("refused", 1)]
    assert found.gap is None


def test_an_option_that_cannot_be_followed_is_refused_not_left_out(tmp_path: Path) -> None:
    """New N-numbers in a program that jumps to one."""
    path = written(tmp_path, "N1 G21 G90\n" + TWO_SECTIONS + "GOTO 1\n")
    with pytest.raises(PostError, match="--line-numbers"):
        leafcut.optimize(path, line_numbers=True)


def lines_program(seed: int, n: int = 30) -> str:
    """Return a laser's program of n lines in random places."""
    rng = np.random.default_rng(seed)
    begin = rng.uniform(0, 200, (n, 2))
    ends = np.stack([begin, begin + rng.normal(0, 25, (n, 2))], axis=1).reshape(n, 4).tolist()
    cut = "G0 X{:.3f} Y{:.3f}\nM3\nG1 X{:.3f} Y{:.3f} F3000\nM5"
    return "\n".join(["G21 G90 G17 G94", "S500", *(cut.format(*e) for e in ends), "M2", ""])


def test_lines_from_either_end_need_less_travel_and_the_proof_says_how_many_were_turned(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, out = written(tmp_path, lines_program(1)), tmp_path / "new.nc"
    one_way = leafcut.optimize(path, preset="fast")
    either = leafcut.optimize(path, out, allow_reverse=True, preset="fast")
    assert either.after.travel_mm < one_way.after.travel_mm < one_way.before.travel_mm
    assert (one_way.detail.certificate.allow_reverse, one_way.detail.certificate.reversed_cuts) == (False, 0)
    turned = either.detail.certificate.reversed_cuts
    assert turned > 3
    assert f"reversed cuts: {turned}, --allow-reverse" in out.read_text()
    assert run(["verify", str(path), str(out)]) == 1
    assert run(["verify", str(path), str(out), "--allow-reverse"]) == 0
    assert f"the same work, {turned} cuts reversed" in capsys.readouterr().out


@pytest.mark.parametrize("power", ["S500", ""])
@pytest.mark.parametrize("way", ["G0", "G1 F9000"])
def test_a_way_at_feed_with_the_beam_off_is_travel_and_the_cutting_stays_what_it_is(
    tmp_path: Path, way: str, power: str
) -> None:
    text = lines_program(3).replace("S500", power).replace("G0", way)
    found = leafcut.optimize(written(tmp_path, text), process="laser", preset="fast")
    places = np.array(re.findall(r"X(\S+) Y(\S+)", text), dtype=float).reshape(-1, 2, 2)
    cutting = float(np.hypot(*(places[:, 1] - places[:, 0]).T).sum())
    assert found.after.cut_mm == pytest.approx(found.before.cut_mm) == pytest.approx(cutting)
    assert found.after.travel_mm < found.before.travel_mm


def test_every_hole_of_a_tool_is_counted_also_the_first_one_of_its_cycle_that_stays(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of two tools that drill the same board, the first hole of each comes with the cycle and keeps its place."""
    first, *rest = (f"X{k * 37 % 100} Y{k * 61 % 90}" for k in range(12))
    lines = ["%", "G21 G90 G17 G94"]
    for tool in (1, 2):
        top = [f"T{tool} M6", "S3000 M3", f"G0 G54 {first}", f"G43 H{tool} Z25."]
        lines += [*top, f"G99 G81 {first} Z-3. R2. F200.", *rest, "G80", "G0 Z25.", "M5"]
    path = written(tmp_path, "\n".join([*lines, "M30", "%", ""]))
    assert run(["optimize", str(path), "-o", str(tmp_path / "new.nc"), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["counts"]["holes"] == 24
    assert [(t["number"], t["holes"], t["staying"]) for t in answer["tools"]] == [(1, 12, 1), (2, 12, 1)]
    outcome = leafcut.optimize(path)
    assert len(outcome.part.holes) == 24
    assert [operation_work_words(o) for o in outcome.operations] == ["12 holes, 1 in its place"] * 2
    assert sorted(hole for o in outcome.operations for hole in o.holes) == list(range(24))


def test_a_section_begins_where_the_one_before_it_now_ends(tmp_path: Path) -> None:
    """The tool is changed in place. The second row of holes starts at the end where the first row ends."""
    found = leafcut.optimize(written(tmp_path, TWO_SECTIONS))
    first, second = ([c for c, _ in zip(o.hole_order, range(5), strict=True)] for o in found.operations)
    x = [h.x for h in found.part.holes]
    assert x[second[0]] == x[first[-1]]


def test_the_command_line_orders_a_program_and_answers_with_the_keys_of_the_contract(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, out, page = written(tmp_path, boards_program(8, 40)), tmp_path / "new.nc", tmp_path / "page.html"
    assert run(["optimize", str(path), "-o", str(out), "--report", str(page), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    keys = {"input", "output", "process", "counts", "before", "after", "saved_percent", "lower_bound", "gap_percent"}
    assert keys | {"verified", "issues", "certificate"} <= found.keys()
    assert found["counts"]["holes"] == 40
    assert found["after"]["time_s"] < found["before"]["time_s"]
    assert "same work" in page.read_text()
    digest = hashlib.sha256(out.read_bytes()).hexdigest()
    assert found["program_sha256"] == digest and f">{digest}<" in page.read_text()
    assert run(["verify", str(path), str(out), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["same"]
    assert run(["simulate", str(out), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["time_s"] == pytest.approx(found["after"]["time_s"])


def test_a_merged_tool_is_changed_once_and_it_is_said(tmp_path: Path) -> None:
    drill = "G99 G81 X{0} Y0 Z-2 R1 F100 / X{0} Y9 / X{0} Y5 / G80 / G0 Z20"
    change = "M5 / T{0} M6 / S1000 M3 / G0 Z20"
    blocks = ["G21 G90 G17 G94 G54", change.format(1), drill.format(10), change.format(2), drill.format(40)]
    text = " / ".join([*blocks, change.format(1), drill.format(70), "M5", "M30", ""]).replace(" / ", "\n")
    found = leafcut.optimize(written(tmp_path, text), merge_tools=True)
    assert found.detail.certificate.before.tool_changes == 3
    assert found.detail.certificate.after.tool_changes == 2
    assert found.after.time_s < found.before.time_s
    assert "L503" in {i.code for i in found.issues}


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"\0\1\2G0 X1", "binary"),
        (b"G21\nG0 X1\nG1 Y2 (oops\nM2\n", ":3: .*not closed"),
        (b"G21\nG1 X1\nM2\n", ":2: .*feed"),
        (b"G21\nG0 X0 Y0\nG2 X10 Y0 I2 J0 F100\nM2\n", ":3: .*radius"),
        (b"G21\n#1=0\no100 while [1]\n#1=[#1+1]\no100 endwhile\nM2\n", "loop"),
        (b"Dear Sir,\nplease find attached\nthe drawing.\n", "line|understood|number"),
        (b"G21 " + b"X1" * 400_000 + b"\n", "characters"),
    ],
)
def test_bad_programs_get_one_clear_line_and_write_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, data: bytes, words: str
) -> None:
    monkeypatch.setattr(control_flow, "MAX_REPEATED", 100_000)  # a sixtieth of the expected number
    path, out = tmp_path / "bad.nc", tmp_path / "new.nc"
    path.write_bytes(data)
    with pytest.raises(LeafcutError, match=words) as caught:
        leafcut.optimize(path, out)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 400
    assert not out.exists()


def test_a_process_is_what_was_said() -> None:
    with pytest.raises(LeafcutError, match="--process"):
        leafcut.optimize("example:plate-10", process="knitting")
    with pytest.raises(LeafcutError, match="laser: the input is a drawing, not a program"):
        leafcut.optimize("example:plate-10", process="laser")


def test_the_proof_stands_below_the_percent_sign_and_the_number() -> None:
    text = with_comments("%\r\nO0001 (X)\r\nG21\r\n", ["one", "two"], load_dialect("haas"))
    assert text == "%\r\nO0001 (X)\r\n(one)\r\n(two)\r\nG21\r\n"


def test_a_binary_file_is_no_program(tmp_path: Path) -> None:
    (file := tmp_path / "x.nc").write_bytes(b"G0\0")
    with pytest.raises(ReadError, match="binary"):
        leafcut.optimize(file)


@pytest.mark.parametrize("stage", ["reading", "finding tasks to reorder", "ordering section 1", "writing", "verifying"])
def test_every_stage_names_itself_and_who_is_told_can_end_it_while_it_goes_on(
    stage: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("leafcut.model.heartbeat._REPORT_INTERVAL", 0.0)
    told: list[str] = []

    class Cancelled(Exception):
        pass

    def tell(progress: Progress) -> None:
        told.append(progress.step)
        if told.count(stage) == 3:
            raise Cancelled

    cuts = "".join(f"G0 X{37 * k % 40} Y{k % 7}\nM3\nG1 X{k}\nM5\n" for k in range(20))
    source = written(tmp_path, f"G21 G90\nF1000 S500\n{cuts}M2\n")
    with pytest.raises(Cancelled):
        leafcut.optimize(source, tmp_path / "new.nc", progress=tell, iterations=2)
    assert told[-1] == stage
    assert not (tmp_path / "new.nc").exists()


def test_the_way_from_where_the_tool_stands_to_the_first_cut_counts(tmp_path: Path) -> None:
    """Three cuts in a row with a torch at the zero, at the far end, or at an unknown position."""
    cut = "G0 X{0} Y0\nM3\nG1 X{0} Y10\nM5\n"
    text = "G21 G90\nF600\n" + "".join(cut.format(x) for x in (300, 100, 200)) + "M2\n"
    path = written(tmp_path, text)
    found = {
        start: leafcut.optimize(path, objective="distance", start_point=start) for start in ("0,0", "400,0", "free")
    }
    assert [round(f.before.travel_mm - 2 * 10, 0) for f in found.values()] == pytest.approx([580, 380, 280], abs=2)
    assert [f.text.index("X100 Y0") < f.text.index("X300 Y0") for f in found.values()][:2] == [True, False]
    assert found["0,0"].after.travel_mm == pytest.approx(100 + 2 * math.hypot(100, 10))
    assert found["400,0"].after.travel_mm == pytest.approx(100 + 2 * math.hypot(100, 10))
    assert found["0,0"].gap == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("end", ["", "M5\n", "M2\n"])
def test_the_way_counts_behind_switches_and_a_program_needs_no_end(tmp_path: Path, end: str) -> None:
    """M52 P1 moves nothing; where the tool is after a last M5 is where its last cut ended."""
    cut = "G0 X{0} Y0\nM3 $0 S1\nG1 X{0} Y10\nM5 $0\n"
    text = "G21 G90\nM52 P1\nF600\n" + "".join(cut.format(x) for x in (300, 100, 200)) + end
    found = leafcut.optimize(written(tmp_path, text), objective="distance")
    assert found.before.travel_mm == pytest.approx(300 + math.hypot(200, 10) + math.hypot(100, 10))
    assert found.after.travel_mm == pytest.approx(100 + 2 * math.hypot(100, 10))
    assert found.detail.pieces == 3 and not found.detail.staying


def test_a_program_that_is_too_large_to_plan_keeps_its_order(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(resequencing, "MOST_STEPS", 3)
    path = written(tmp_path, boards_program(3, 20))
    found = leafcut.optimize(path)
    assert found.text == path.read_text()
    assert "L507" in {issue.code for issue in found.issues}
    assert found.operations == ()


def test_a_program_is_planned_whole_whatever_the_time_limit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its search has nine tenths of the limit, its lower bound one."""
    limits: list[float | None] = []
    inner = solving.solve

    def spy(problem: Any, options: Any, *rest: Any, **words: Any) -> Any:
        limits.append(options.time_limit)
        return inner(problem, options, *rest, **words)

    monkeypatch.setattr(solving, "solve", spy)
    found = leafcut.optimize(written(tmp_path, boards_program(3, 20)), time_limit="1ms")
    assert found.detail.certificate.same
    assert limits == [pytest.approx(0.001)]
    assert found.after.time_s < found.before.time_s


def test_every_face_says_how_many_pieces_stay_and_why_with_the_line(tmp_path: Path) -> None:
    """Three holes, one of them alone behind M8; and the same with --algorithm none."""
    from rich.console import Console

    from leafcut.report.json_answer import program_as_json
    from leafcut.report.page import report_page_html
    from leafcut.report.summary import print_summary

    body = "G0 X0 Y0\nG1 Z-1 F100\nG0 Z5\nX30\nG1 Z-1\nG0 Z5\nM8\nX9 Y9\nG1 Z-1\nG0 Z5\n"
    file = tmp_path / "holes.ngc"
    file.write_text(f"G21 G90 G94 G17\nT1 M6\nS1000 M3\nG43 H1\nG0 Z5\n{body}M5\nM2\n")
    outcome = leafcut.optimize(file, machine="linuxcnc-mill")
    answer = program_as_json(report_of(outcome))
    assert answer["counts"]["pieces"] == 3
    (group,) = answer["staying"]
    text = "alone between barriers (coolant is switched on or off): M8 at line 12"
    assert group == {"reason": "alone", "count": 1, "first_line": 12, "word": "M8", "text": text}
    assert f"<li><bdi>1 {text}</bdi></li>" in report_page_html(report_of(outcome))
    console = Console(width=400, record=True, file=io.StringIO())
    print_summary(report_of(outcome), console)
    said = console.export_text()
    assert f"1 of 3 pieces stays: 1 {text}" in said
    assert "2 of 3 pieces of work can be reordered" in said
    outcome = leafcut.optimize(file, machine="linuxcnc-mill", algorithm="none")
    kept = program_as_json(report_of(outcome))
    print_summary(report_of(outcome), console)
    assert "order unchanged" in console.export_text()
    assert [(g["reason"], g["count"]) for g in kept["staying"]] == [("keep-order", 2), ("alone", 1)]


def test_the_spindle_changes_speed_no_more_often_than_before(tmp_path: Path) -> None:
    """Tasks at alternating speeds: each keeps its speed, and all tasks of one speed come before the next."""
    from leafcut.model.toolpath import Kind
    from rewriting import work_of

    places = [(0, 0), (80, 5), (3, 9), (90, 0), (12, 3), (85, 12), (6, 4), (70, 3)]
    body = "".join(
        f"G0 X{x} Y{y}\nS{2000 + 1000 * (k % 2)}\nG1 Z-1 F300\nX{x + 5}\nG0 Z5\n" for k, (x, y) in enumerate(places)
    )
    file = tmp_path / "speeds.ngc"
    file.write_text(f"G21 G90 G94 G17\nT1 M6\nS1000 M3\nG43 H1\nG0 Z5\n{body}M5\nM2\n")
    outcome = leafcut.optimize(file, machine="linuxcnc-mill")
    assert not outcome.detail.staying and outcome.after.time_s < outcome.before.time_s
    texts = (file.read_text(), outcome.text)
    old, new = (interpret_program(text, load_dialect("linuxcnc")) for text in texts)
    assert work_of(new) == work_of(old)
    speeds = [p.path.value[p.path.kind == Kind.SPINDLE] for p in (old, new)]
    changes = [int((np.diff(speed) != 0).sum()) for speed in speeds]
    assert changes[0] == 9 and changes[1] == 3


def test_a_tool_change_that_merging_saves_stays_saved_if_the_order_of_the_input_wins(tmp_path: Path) -> None:
    """Merging lengthens the travel, so with --objective distance the input's order is written, with one change less."""
    blocks = "".join(
        f"T{tool} M6\nS1000 M3\nG43 H{tool} G0 Z5.\nG99 G81 X0. Y{y}. Z-3. R1. F100.\nX20. Y{y}.\nG80\nG0 Z20.\nM5\n"
        for tool, y in ((1, 0), (2, 50), (1, 100))
    )
    file = written(tmp_path, f"G21 G90 G17\n{blocks}M30\n")
    outcome = leafcut.reorder(file, process="drill", merge_tools=True, objective="distance", machine="haas-vf2")
    assert outcome.text.count(" M6") == 2
    assert any(issue.code == "L503" for issue in outcome.issues)


def test_lines_are_numbered_anew_although_nothing_can_be_reordered(tmp_path: Path) -> None:
    file = written(tmp_path, "N5 G21 G90\nN6 M3 S100\nN7 G0 X0. Y0.\nN17 G1 X10. F500.\nN9 M5\nN10 M2\n")
    outcome = leafcut.reorder(file, process="laser", line_numbers=True, machine="laser-table")
    assert re.findall(r"^N(\d+)", outcome.text, re.MULTILINE) == ["5", "6", "7", "8", "9", "10"]


def test_a_shorter_order_that_alternates_between_speeds_is_grouped_by_speed(tmp_path: Path) -> None:
    """Each task has another speed than the one to its left; the input changes the speed every second time."""
    from leafcut.model.toolpath import Kind

    slow, fast = [(0, 20), (60, 40), (80, 100)], [(10, 30), (50, 70), (90, 110)]
    runs = [
        (speed, run) for pair in zip(slow, fast, strict=True) for speed, run in zip((2000, 3000), pair, strict=True)
    ]
    body = "".join(f"G0 X{x} Y0\nS{speed}\nG1 Z-1 F300\nY5\nG0 Z5\n" for speed, run in runs for x in run)
    file = tmp_path / "speeds.ngc"
    file.write_text(f"G21 G90 G94 G17\nT1 M6\nS1000 M3\nG43 H1\nG0 Z5\n{body}M5\nM2\n")
    outcome = leafcut.optimize(file, machine="linuxcnc-mill")
    path = interpret_program(outcome.text, load_dialect("linuxcnc")).path
    changes = np.diff(path.value[path.kind == Kind.SPINDLE]) != 0
    assert outcome.after.time_s < outcome.before.time_s
    assert changes[1:-1].sum() == 1


@pytest.mark.parametrize(
    "head", ["G0 G43 Z15 H1", "G0 X0 Y0\nG0 Z15", "G0 X0 Y0\nG43 H1 Z15 T2", "G0 X0 Y0\nG43 H1\nG0 Z15"]
)
@pytest.mark.parametrize("approach", [2, 5])
def test_no_ordinary_head_keeps_an_order(head: str, approach: int, tmp_path: Path) -> None:
    """Neither a header that crosses before its height is set, nor a first task with a shorter descent than the others.

    Six slots, alternating between far and near: the shortest path is less than half as long.
    """
    lines = ["G21 G90 G17 G40 G49 G80 G94", "T1 M6", "S2000 M3", "G54", head]
    for k, at in enumerate((100, 10, 90, 20, 80, 30)):
        down = f"Z{2 if k else approach}"
        lines += [f"G0 X{at} Y{at}", down, "G1 Z-1 F100", f"X{at + 5} F300", "G0 Z15"]
    file = tmp_path / "p.ngc"
    file.write_text("\n".join([*lines, "G28 G91 Z0", "G90", "M5", "M30"]) + "\n")
    outcome = leafcut.optimize(file, machine="linuxcnc-mill", iterations=50)
    assert outcome.verified
    assert outcome.after.travel_mm < 0.5 * outcome.before.travel_mm


def test_a_rapid_that_was_made_without_power_is_so_in_another_order(tmp_path: Path) -> None:
    """The power of a laser by S alone, M3 throughout: if a controller does not darken rapids, each states its own
    power.
    """
    text = "G21 G90\nM3 S0\nG0 X0 Y0\n"
    for x, y, power in ((0, 0, 500), (50, 50, 800), (12, 2, 300), (70, 52, 800)):
        text += f"G0 X{x} Y{y}\nS{power}\nG1 X{x + 10} F1000\nS0\n"
    text += "G0 X14 Y3\nG1 X24 S300\n"
    file = tmp_path / "p.ngc"
    file.write_text(f"{text}G0 X52 Y53 S0\nG1 X62 S300\nS0\nG0 X0 Y0\nM5\nM2\n")
    outcome = leafcut.optimize(file, machine="linuxcnc-mill", iterations=50)
    assert outcome.verified and outcome.after.travel_mm < outcome.before.travel_mm
    power, dark = 0.0, []
    for line in outcome.text.splitlines():
        power = float(found.group(1)) if (found := re.search(r"S([0-9.]+)", line)) else power
        dark += [power == 0.0] if line.startswith("G0") else []
    assert len(dark) == 8 and all(dark)


@pytest.mark.parametrize(
    "text", ["G21 G90 G94 G17\nG0 Z5.\nG0 X10. Y10.\nX50.\nM30\n", "%\nT1C0.5\nX1.0Y2.0\nM3 S900\nM30\n"]
)
def test_a_program_that_cuts_nothing_says_so_beside_verified(text: str, tmp_path: Path, capsys: Any) -> None:
    path = tmp_path / "empty.nc"
    path.write_text(text)
    assert run(["optimize", str(path), "--machine", "haas-vf2", "-o", str(tmp_path / "new.nc")]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "verified yes, but no cut and no hole was found in this program" in told
    assert "same work" not in told
    assert "L502 the program has no cuts and no holes: check that this is the intended file" in told


def test_units_that_are_assumed_are_no_change_of_units(tmp_path: Path, capsys: Any) -> None:
    """The block with the first length stays, and the reason names the missing word."""
    path = tmp_path / "bare.nc"
    path.write_text("G90 G94 G17\nS900 M3\nG0 X-1 Y0 Z5\nG1 Z-1 F20\nX9\nG0 Z5\nM5\nM2\n")
    assert run(["optimize", str(path), "--machine", "linuxcnc-mill", "-o", str(tmp_path / "new.nc")]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "with a block that stays (the units are assumed: G20 or G21 is missing)" in told


@pytest.mark.parametrize("machine", ["grbl-3018", "linuxcnc-mill"])
@pytest.mark.parametrize("places", [[(90, 60)], [(90, 60), (20, 20), (60, 90)]])
def test_reorder_and_simulate_state_one_time_for_a_program(machine: str, places: list[Any], tmp_path: Path) -> None:
    """Both count the first move, from X0 Y0, whether or not anything can be reordered."""
    path = tmp_path / "contour.nc"
    cuts = "".join(f"G0 X{x} Y{y}\nG1 Z-1 F300\nX{x + 5}\nG0 Z15\n" for x, y in places)
    path.write_text(f"G21 G90 G94 G17\nT1 M6\nS5000 M3\nG0 Z15\n{cuts}M5\nM30\n")
    simulated = leafcut.simulate(path, machine=machine).measure
    outcome = leafcut.optimize(path, machine=machine)
    assert bool(outcome.operations) == (len(places) > 1)
    assert outcome.before.time_s == pytest.approx(simulated.time_s)
