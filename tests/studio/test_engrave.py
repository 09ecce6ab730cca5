"""A process in an external package works everywhere: command, options, program, proof, page, form and job.

The package is in `tests/engrave` in its installed form; leafcut does not know it.
"""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import ezdxf
import numpy as np
import pytest

import leafcut
from leafcut.cli.app import run
from leafcut.errors import OptionError
from leafcut.studio.jobs.history import JobState
from leafcut.studio.jobs.preview import read_preview
from leafcut.studio.jobs.task import Task
from leafcut.studio.page import forms
from leafcut.studio.studio import Studio
from leafcut.studio.wording import words

PACKAGE = Path(__file__).parents[1] / "engrave"


@pytest.fixture(autouse=True)
def engrave(monkeypatch: pytest.MonkeyPatch) -> None:
    """Install the package for one test and its subprocesses."""
    monkeypatch.syspath_prepend(str(PACKAGE))
    monkeypatch.setenv("PYTHONPATH", str(PACKAGE), prepend=":")


@pytest.fixture
def drawing(tmp_path: Path) -> Path:
    """Return a drawing of a square of 20 mm, a line of 30 mm and a circle of radius 5 mm."""
    document = ezdxf.new(units=4)
    space = document.modelspace()
    space.add_lwpolyline([(0, 0), (20, 0), (20, 20), (0, 20)], close=True)
    space.add_line((100, 0), (100, 30))
    space.add_circle((50, 10), 5)
    document.saveas(tmp_path / "lines.dxf")
    return tmp_path / "lines.dxf"


def test_it_has_a_command_with_its_own_options_and_writes_a_program_that_is_proved(
    drawing: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Along 80 + 30 + 10π mm, and three times 10 mm down to the surface and 0.3 mm below it."""
    program, page = tmp_path / "e.ngc", tmp_path / "e.html"
    given = ["engrave", str(drawing), "-o", str(program), "--report", str(page), "--depth", "0.3", "--json"]
    assert run([*given, "--engraving-feed", "240"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert (answer["process"], answer["counts"], answer["verified"]) == ("engrave", {"lines": 3}, True)
    assert answer["after"]["cut_mm"] == pytest.approx(110.0 + 10.0 * math.pi + 3 * 10.3, abs=0.05)
    text = program.read_text()
    assert "--engraving-feed 240mm/min" in text
    assert set(re.findall(r"Z(-[0-9.]+)", text)) == {"-0.3"} and set(re.findall(r"F([0-9.]+)", text)) == {"240"}
    assert "3 lines" in page.read_text()


def test_its_options_are_its_own_and_those_of_others_are_refused(
    drawing: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["engrave", "--help"]) == 0
    assert "--engraver" in capsys.readouterr().out
    with pytest.raises(
        OptionError,
        match="--peck: this option does not apply to engraving, only to drilling and choosing speeds and feeds; ",
    ):
        leafcut.optimize(drawing, process="engrave", peck=2)
    with pytest.raises(
        OptionError, match="--engraver: this option does not apply to drilling, only to engraving; leave it out"
    ):
        leafcut.optimize("example:plate-10", engraver=2)


def test_its_proof_sees_a_line_that_is_left_out_and_one_that_is_too_many(drawing: Path) -> None:
    from leafcut_engrave.proof import check_lines

    outcome = leafcut.optimize(drawing, process="engrave", depth=0.3)
    assert outcome.written is not None
    lines = [contour.path.flattened(0.005) for contour in outcome.part.contours]
    assert check_lines(outcome.written, lines, 0.3, 0.01) == []
    assert "not engraved" in str(check_lines(outcome.written, [*lines, np.array([[0, 50], [9, 50]])], 0.3, 0.01)[0])
    assert "not drawn" in str(check_lines(outcome.written, lines[1:], 0.3, 0.01)[0])
    assert "not engraved" in str(check_lines(outcome.written, lines, 0.5, 0.01)[0])


def test_the_studio_offers_it_shows_its_form_and_runs_it(drawing: Path, own_studio: Studio) -> None:
    seen = read_preview(str(drawing), "engrave")
    assert seen.works == ("drill", "cut", "nest", "pocket", "part", "engrave") and seen.work == "engrave"
    english = words("en")
    main, *_ = forms.work_form("engrave", {}, english, machines={"grbl-3018": "GRBL"}, tools=[])
    assert [field["label"] for field in main["fields"]][2:] == ["Engraver", "Engraving feed", "Engraving speed"]
    assert english.item_name("work", "engrave") == "Engrave"
    source = own_studio.folder.add_input(drawing.name, drawing.read_bytes())
    job = own_studio.jobs.start(Task("optimize", (source,), "engrave", {"depth": "0.3", "preset": "fast"}))
    assert own_studio.jobs.wait(job) is JobState.DONE
    made = own_studio.history.artefact(job, "program")
    assert made is not None
    # The studio calls an upload by the name that it came with.
    assert made.data.decode() == leafcut.optimize(drawing, process="engrave", depth=0.3, preset="fast").text


@pytest.mark.parametrize(
    ("flag", "value", "reason"), [("--depth", "through", "in mm"), ("--start-point", "1,2,3", "two")]
)
def test_a_value_that_only_other_processes_use_is_refused(
    flag: str, value: str, reason: str, drawing: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["engrave", str(drawing), "-o", str(tmp_path / "e.ngc"), flag, value]) == 2
    assert reason in capsys.readouterr().err
