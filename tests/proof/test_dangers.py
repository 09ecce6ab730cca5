"""Dangers of programs that others wrote: one line for each kind, the same by `simulate` and by `optimize`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import leafcut
from leafcut.errors import VerifyError
from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.model.issue import Issue, Severity
from leafcut.proof.dangers import find_dangers
from leafcut.read.machine import load_machine
from leafcut.timing.toolpath import measure_toolpath

HEAD = "G21 G90 G17\nM3 S1000\nG0 Z5\nG0 X0 Y0\n"


def dangers(text: str, process: str = "mill", words: str = "linuxcnc") -> list[Issue]:
    """Return the dangers reported for a program."""
    return find_dangers(interpret_program(HEAD + text, load_dialect(words)), load_machine("linuxcnc-mill"), process)


def codes(text: str, process: str = "mill", words: str = "linuxcnc") -> list[str]:
    """Return the codes of it."""
    return [issue.code for issue in dangers(text, process, words)]


@pytest.mark.parametrize(
    "text, found",
    [
        ("G1 Z-1 F100\nX10\nG0 X20\nG0 Z5", ["L801"]),
        ("G1 Z-1 F100\nX10\nG0 Z-0.5\nX20\nX30\nX40\nG0 Z5", ["L801"]),
        ("G0 X20\nG0 Z-1\nG1 X30 F100\nG0 Z5", ["L802"]),
        ("G1 Z-1 F100\nM5\nG1 X10\nX20\nG0 Z5", ["L803"]),
        ("T2 M6\nG1 Z-1 F100\nG0 Z5", ["L803"]),
        ("G1 Z-1 F100\nG0 Z1\nG0 Z-1\nG1 Z-2\nG0 Z5", []),
        ("G1 Z-1 F100\nX10\nG0 Z5\nX0 Y0\nZ-1\nG1 Z-2\nX10\nG0 Z5", []),
        ("G1 Z-1 F100\nX10\nG0 Z5\nX0 Y0\nZ-1.1\nG1 Z-2\nX10\nG0 Z5", ["L802"]),
        ("G81 X5 Y5 Z-3 R1 F100\nX9\nG80", []),
        ("M5\nM3\nG1 Z-1 F100\nG0 Z5", []),
        ("M5\nM3 S0\nG1 Z-1 F100\nX9\nG0 Z5", ["L803"]),
        ("S0\nG1 Z-1 F100\nG0 Z5", ["L803"]),
        ("S0.\nS0500\nG1 Z-1 F100\nG0 Z5", []),
        ("G1 Z-1 F100\nX9\nG53 G0 X0 Y0", ["L801"]),
        ("G1 Z-1 F100\nX9\nG53 G0 X0 Y0 Z0", ["L801"]),
        ("G1 Z-1 F100\nX9\nG53 G0 Z0\nG53 G0 X0 Y0", []),
        ("G1 Z-1 F100\nX9\nG0 Z5\nG53 G0 X0 Y0", []),
        ("M98 P77\nG90 G17 G40 G94\nG0 X1 Y1 Z5\nG1 Z-1 F100\nG0 Z5", ["L808"]),
        ("M5\nM98 P77\nG90 G17 G40 G94\nG0 X1 Y1 Z5\nM5\nG1 Z-1 F100\nG0 Z5", ["L803", "L808"]),
    ],
)
def test_each_kind_of_danger_is_told_once_and_what_is_safe_is_not(text: str, found: list[str]) -> None:
    """Rapids below the surface, cuts with the spindle off: by hand; the effect of M98 is reported as unknown."""
    assert codes(text + "\nM2\n") == found


@pytest.mark.parametrize("r, told", [("-1", ["L801"]), ("1", [])])
def test_a_series_of_cycles_rises_on_a_slant_in_linuxcnc_for_dangers_and_times_alike(r: str, told: list[str]) -> None:
    """From an R plane in a recess, the move to a higher plane passes through the edge; the points are from rs274."""
    series = f"G1 X5 F100\nG0 Z5\nG99 G81 X5 Y0 Z-3 R{r} F100\nX25 R4\nG80\nG0 Z5\n"
    moves = f"G1 X5 F100\nG61\nG0 Z{r}\nG1 Z-3\nG0 Z{r}\nG0 X25 Z4\nG1 Z-3\nG0 Z4\nG64\nG0 Z5\n"
    recess = "G1 Z-1 F100\n" if r == "-1" else ""
    head = f"G0 X5\n{recess}G0 Z5\nG0 X0\n"
    assert [issue.code for issue in dangers(f"{head}{series}M2\n")] == told
    machine = load_machine("linuxcnc-mill")
    slanting, written = (
        measure_toolpath(interpret_program(f"{HEAD}{text}M2\n", load_dialect("linuxcnc")).path, machine)
        for text in (series, moves)
    )
    assert (slanting.travel_mm, slanting.cut_mm) == pytest.approx((written.travel_mm, written.cut_mm))
    assert slanting.time_s == pytest.approx(written.time_s, abs=0.02)


#: Two passes of a slot, Y24.288 and Y25.712, to Z-9; then a rapid down between them, to Z-2.
SLOT = """(T1 D=3.175 CR=0. - flat end mill)
T1 M6
M3 S1000
G0 X20 Y24.288 Z15
G1 Z-9 F300
X100
Y25.712
X20
G0 Z15
"""
DOWN = "X93.816 Y25\nG0 Z-2\nG1 Z-3 F100\nG0 Z15\n"
OTHER = "(T2 D={} CR=0. - flat end mill)\nT2 M6\nM3 S1000\nG0 Z15\n"


@pytest.mark.parametrize(
    "text",
    [
        SLOT + DOWN,
        SLOT + OTHER.format(3) + DOWN,
        SLOT + OTHER.format(4.5) + DOWN,
        SLOT.replace("flat end", "ball end") + DOWN.replace("Y25", "Y25.712"),
        SLOT.replace("X100\nY25.712\nX20", "G2 X80 I30\nG2 X20 I-30") + DOWN.replace("X93.816 Y25", "X50 Y54.288"),
        SLOT.replace("X100\nY25.712", "X100 Z-1.5\nY25.712") + DOWN.replace("X93.816 Y25", "X20 Y24.288"),
    ],
    ids=[
        "between passes",
        "narrower tool",
        "as wide as both",
        "ball on its pass",
        "on an arc",
        "at the end of a slope",
    ],
)
def test_a_rapid_down_into_a_place_that_is_cut_as_deep_and_as_wide_is_no_danger(text: str) -> None:
    """The position is air: earlier cuts have swept everything that the tool sweeps there."""
    assert codes(text + "M2\n") == []


@pytest.mark.hazard
@pytest.mark.parametrize(
    "text",
    [
        SLOT + DOWN.replace("Z-2", "Z-9.1"),
        SLOT + DOWN.replace("Y25", "Y26"),
        SLOT + DOWN.replace("X93.816", "X100.5"),
        SLOT + OTHER.format(5) + DOWN,
        SLOT + OTHER.format(6) + DOWN.replace("X93.816 Y25", "X100 Y25.712"),
        SLOT + "T2 M6\nM3 S1000\n" + DOWN,
        SLOT.replace("Y25.712", "Y27.6") + DOWN.replace("Y25", "Y26"),
        SLOT.replace("flat end", "ball end") + DOWN,
        SLOT.replace("CR=0.", "CR=1.") + DOWN,
        SLOT.replace("(T1 D=3.175 CR=0. - flat end mill)", "") + DOWN,
        SLOT.replace("X100\n", "X100 Z-1\n") + DOWN.replace("Y25", "Y24.288"),
        SLOT.replace("X100\n", "G41 D1 X100\n").replace("X20\nG0", "X20\nG40\nG0") + DOWN,
        SLOT.replace("G1 Z-9 F300\nX100", "G53 G0 Z0\nG1 X100 Z-9 F300") + DOWN.replace("Y25", "Y24.288"),
        SLOT + "G55\nG0 Z15\n" + DOWN,
        SLOT + "G92 X50 Y24.288\nG0 Z15\n" + DOWN,
        SLOT.replace("G0 X20 Y24.288 Z15\n", "G0 Z15\n" + DOWN + "G0 X20 Y24.288 Z15\n"),
    ],
    ids=[
        "deeper", "beside", "past its end", "wider tool", "wider tool at a corner", "unknown tool",
        "rib between passes", "ball mill", "bull-nose mill",
        "unknown diameter", "slope", "compensated path", "from an unknown height",
        "other work offset", "shifted origin", "cut later",
    ],
)  # fmt: skip
def test_a_rapid_down_into_what_earlier_cuts_left_is_a_danger(text: str) -> None:
    """Less deep, less wide, elsewhere, later, or of unknown width."""
    assert codes(text + "M2\n") == ["L802"]


#: A slot to Z-5, then, after something else, a rapid down into it.
CUT, INTO = "M3 S1000\nG1 Z-5 F100\nX20\nG0 Z5\n", "M3 S1000\nG0 X10 Y0 Z5\nG0 Z-4\nG1 Z-6\nG0 Z5\n"
STOPS = [
    ("T1 M6 (3 MM END MILL)\n", "T1 M6 (10 MM END MILL)\n"),
    ("T1 M6 (3 MM END MILL)\n", "T1 M6\n"),
    ("T1 M6 (3 MM END MILL)\n", "T2 M6\n"),
    ("(3 MM END MILL)\n", "M6\n"),
    ("(3 MM END MILL)\n", "M0 (10 MM END MILL)\n"),
    ("(3 MM END MILL)\n", "M0 (TURN THE PART OVER)\n"),
    ("(3 MM END MILL)\n", "M1\n"),
    ("(3 MM END MILL)\n", "M60\n"),
    ("(3 MM END MILL)\n", "G0 A180\n"),
    ("T1 M6 (3 MM END MILL)\nG43 H1\nG0 X0 Y0 Z5\n", "G43 H2\n"),
]


@pytest.mark.hazard
@pytest.mark.parametrize("head, stop", STOPS, ids=[stop.strip() for _, stop in STOPS])
@pytest.mark.parametrize("x", [10, 20])
def test_cuts_before_a_stop_or_of_another_tool_of_the_same_number_clear_nothing(head: str, stop: str, x: int) -> None:
    """The tool, its length or the side of the part may have changed; at X20 the tool has not moved since the cut."""
    move = "X10 Y0 Z5" if x == 10 else ""
    assert codes(head + CUT + stop + INTO.replace("X10 Y0 Z5", move) + "M2\n") == ["L802"]


@pytest.mark.parametrize(
    "head, change",
    [
        ("T1 M6 (10 MM END MILL)\n", "T1 M6 (3 MM END MILL)\n"),
        ("(T1 D=3 flat end mill)\nT1 M6\n", "T1 M6\n"),
        ("T1 M6 (10 MM END MILL)\nG43 H1\nG0 X0 Y0 Z5\n", "T2 M6 (3 MM END MILL)\nG43 H2\n"),
        ("T1 M6\nG43 H1\nG0 X0 Y0 Z5\n", "G49\nG43 H1\n"),
    ],
)
def test_a_wider_tool_clears_for_a_narrower_one_of_any_number(head: str, change: str) -> None:
    """Each change has its own diameter; a length offset that is restated changes no height."""
    assert codes(head + CUT + change + INTO + "M2\n") == []


def test_many_rapids_into_slots_of_the_same_tool_are_no_danger() -> None:
    """More than are compared with areas."""
    slot = "".join(f"G0 Z{1 - p}\nG1 Z{-p} F100\nX20\nG0 Z5\nX0\n" for p in (1, 2, 3, 4))
    text = "T1 M6 (3 MM END MILL)\nM3 S1000\n" + "".join(f"G0 X0 Y{0.5 * k}\n{slot}" for k in range(400))
    assert codes(text + "M2\n") == []


@pytest.mark.hazard
def test_rapids_that_are_not_compared_are_reported_and_no_danger(monkeypatch: pytest.MonkeyPatch) -> None:
    """L815 with their number and the first; the first of three is compared."""
    monkeypatch.setattr("leafcut.proof.cleared_rapids._MOST_RAPIDS", 1)
    downs = "".join(f"G0 X{x} Y0.1\nG0 Z-4\nG0 Z5\n" for x in (5, 10, 15))
    text = "T1 M6 (10 MM END MILL)\n" + CUT + "T2 M6 (3 MM END MILL)\nM3 S1000\n" + downs
    (issue,) = dangers(text + "M2\n")
    assert (issue.code, issue.severity, issue.place) == ("L815", Severity.WARNING, "line 16")
    assert issue.message.startswith("2 rapids down below Z0 were not compared") and "X10.000 Y0.100" in issue.message


def test_a_danger_tells_how_often_and_where_first() -> None:
    """The first by its line, not the deepest."""
    (issue,) = dangers("G1 Z-1 F100\nG0 X10\nG0 X20\nG0 X30\nG0 Z5\nM2\n")
    assert issue.severity is Severity.DANGER and issue.place == "line 6"
    assert issue.message == ("3 rapids below Z0.05: the first from X0.000 Y0.000 Z-1.000 to X10.000 Y0.000 Z-1.000")


def test_a_program_that_never_starts_its_spindle_has_one_that_is_switched_by_hand() -> None:
    """A warning, no danger in every line."""
    program = interpret_program("G21 G90\nG0 X0 Y0 Z5\nG1 Z-1 F100\nX5\nX9\nG0 Z5\nM2\n", load_dialect("linuxcnc"))
    (issue,) = find_dangers(program, load_machine("linuxcnc-mill"), "mill")
    assert (issue.code, issue.severity) == ("L803", Severity.WARNING)


@pytest.mark.hazard
@pytest.mark.parametrize(
    "text, found",
    [
        ("G0 Z53.4\nG1 Z42.9 F100\nX10\nG0 Z80\n", ["L814"]),
        ("G81 X5 Y5 Z0 R9 F100\nG80\n", ["L814"]),
        ("G1 Z1 F100\nG18 G2 X10 Z1 I5 K0\nG0 Z5\n", []),
        ("G1 Z1 F100\nX10\nG1 Z-0.1\nG0 Z5\n", []),
    ],
)
def test_a_program_whose_cuts_all_lie_above_z0_has_an_unknown_surface(text: str, found: list[str]) -> None:
    """Its rapids are compared with no surface. The arc of the third program goes down to Z-4."""
    assert codes(text + "M2\n") == found and codes(text + "M2\n", "laser") == []


@pytest.mark.hazard
@pytest.mark.parametrize(
    "text, words, found",
    [
        ("G92 Z60\nG0 Z40\nX10\n", "linuxcnc", "Z0 is moved 55.000 mm down, "),
        ("G10 L2 P0 Z-20\nG0 Z5\nX10\n", "linuxcnc", "Z0 is moved by an unknown height, "),
        ("G52 Z-20\nG0 Z5\nX10\n", "mach3", "Z0 is moved by an unknown height, "),
        ("G92 Z2 (Z60)\nG0 Z4\nX10\n", "linuxcnc", ""),
        ("G92 X10 Y0\nG0 X10\nG92.1\n", "linuxcnc", ""),
        ("G52 X50 Y0 Z0\nG0 Z5\nX10\n", "mach3", ""),
        ("G38.2 Z-5 F50\nG92 Z0\nG0 Z5\nX10\n", "linuxcnc", ""),
    ],
)
def test_a_z0_that_is_moved_down_or_by_an_unknown_height_is_reported(text: str, words: str, found: str) -> None:
    """Its rapids are compared with the new Z0: G0 Z40 after G92 Z60 at Z5 is 15 mm below the old one."""
    told = [issue for issue in dangers("G1 Z-1 F100\nX5\nG0 Z5\n" + text + "M2\n", words=words) if issue.code == "L816"]
    assert [issue.severity for issue in told] == [Severity.WARNING] * bool(found)
    assert all(issue.message.startswith(found) and issue.place == "line 8" for issue in told)


def test_an_unknown_surface_is_told_with_the_heights_of_the_cuts_and_what_to_give() -> None:
    """One line, a warning."""
    (issue,) = dangers("G0 Z53.4\nG1 Z42.9 F100\nX10\nG1 Z53\nG0 Z80\nM2\n")
    assert issue.severity is Severity.WARNING and "lowest Z42.900, highest Z53.000" in issue.message
    assert issue.message.endswith("check them with leafcut stock --workpiece")


def test_where_the_tool_goes_unknown_is_told_and_a_probe_is_not() -> None:
    """After G68 nothing is checked; a change of tool length alone, or a probed position, is not such a case."""
    text = "G43 H1 Z6\nG38.2 Z-5 F50\nG0 Z5\nG68 X0 Y0 R30\nG0 X30\nG1 Z-1 F100\nX40\nG0 Z5\nM2\n"
    (issue,) = [i for i in dangers(text, words="mach3") if i.code == "L808"]
    assert (issue.severity, issue.place) == (Severity.WARNING, "line 8")
    assert "in 5 blocks is unknown" in issue.message and "G68 is not understood" in issue.message
    assert "L808" not in codes("G52 X5\nG0 X30\nG52 X0\nG0 X10\nM2\n")


def test_a_torch_is_off_in_rapids_and_a_laser_may_do_as_it_likes() -> None:
    """Its rapids are dark by themselves; a torch cuts on."""
    text = "M3\nG1 X10 F900\nG0 X50\nG1 X60\nM5\nM2\n"
    assert codes(text, "plasma") == ["L804"] and codes(text, "laser") == []


DANGEROUS = HEAD + "G1 Z-1 F100\nX10\nG0 X20\nG1 X30\nM5\nG1 X40\nG0 Z5\nM30\n"


def test_optimize_tells_what_simulate_does_before_all_else(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Summary, JSON and quiet; --strict refuses, with status 1 and nothing written."""
    from leafcut.cli.app import run

    source, output = tmp_path / "a.nc", tmp_path / "b.nc"
    source.write_text(DANGEROUS)
    assert run(["optimize", str(source), "-o", str(output)]) == 0
    lines = [line for line in capsys.readouterr().out.splitlines() if line.strip()]
    assert lines[0].startswith("danger: L801") and any(line.startswith("danger: L803") for line in lines[:4])
    assert run(["optimize", str(source), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)["issues"]
    assert run(["simulate", str(source), "--json"]) == 0
    simulated = json.loads(capsys.readouterr().out)["issues"]
    worst = [issue for issue in told if issue["severity"] == "danger"]
    assert worst == [issue for issue in simulated if issue["severity"] == "danger"] == told[: len(worst)]
    assert [issue["code"] for issue in worst] == ["L801", "L803"]
    assert run(["optimize", str(source), "-q", "--report", str(tmp_path / "a.html")]) == 0
    page = (tmp_path / "a.html").read_text()
    assert 0 < page.index("rapid below Z0.05") < page.index('aria-label="Time saved"')
    assert "danger: L801" in capsys.readouterr().err
    output.unlink()
    assert run(["optimize", str(source), "-o", str(output), "--strict"]) == 1
    assert not output.exists() and run(["simulate", str(source), "--strict"]) == 1
    with pytest.raises(VerifyError, match="--strict refuses"):
        leafcut.optimize(source, strict=True)


def test_simulate_tells_each_kind_once_however_often_it_comes(tmp_path: Path) -> None:
    """A thousand rapids below the surface are one line."""
    source = tmp_path / "a.nc"
    source.write_text(HEAD + "G1 Z-1 F100\n" + "".join(f"G0 X{k / 10}\n" for k in range(1, 1001)) + "G0 Z5\nM30\n")
    (issue,) = leafcut.simulate(source, machine="linuxcnc-mill").issues
    assert issue.message.startswith("1,000 rapids below Z0.05") and issue.place == "line 6"
