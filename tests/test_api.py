"""Answers of the library: typed, with plain values that the commands print as JSON."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any

import pytest

import leafcut
from leafcut import api
from leafcut.model.difference import Difference
from leafcut.model.issue import Issue

EXAMPLES = Path(__file__).parents[1] / "examples"

#: Few sheets, quickly.
NEST: dict[str, Any] = {"sheet": "500x300", "nester": "rectangles", "variants": 2}

HOLES = "G21 G90 G17\nT1 M6\nS1000 M3\nG0 Z5\n{}G80\nG0 Z5\nM30\n"
#: Three holes; the second of them deeper; and a rapid below the surface.
PROGRAM = HOLES.format("G81 X0 Y0 Z-2 R1 F100\nX10\nX20\n")
DEEPER = HOLES.format("G81 X0 Y0 Z-2 R1 F100\nX10 Z-3\nX20 Z-2\n")
LOW = "G21 G90 G17\nS1000 M3\nG0 Z5\nG0 X5 Y5\nG1 Z-1 F100\nG0 X9\nG0 Z5\nM30\n"


@pytest.fixture
def programs(tmp_path: Path) -> dict[str, str]:
    """Return the paths of programs by their names."""
    texts = {"right": PROGRAM, "deeper": DEEPER, "low": LOW}
    for name, text in texts.items():
        (tmp_path / f"{name}.nc").write_text(text)
    return {name: str(tmp_path / f"{name}.nc") for name in texts}


def test_a_simulation_has_measure_dangers_and_both_paths(programs: dict[str, str]) -> None:
    """By hand: 6 mm down at 100 mm/min; its danger is an issue, not a text."""
    found = leafcut.simulate(programs["low"], machine="linuxcnc-mill")
    assert found.measure.cut_mm == pytest.approx(6.0)
    assert found.measure.by_kind["feed"] >= 60 * 6 / 100
    (danger,) = [issue for issue in found.issues if issue.severity == "danger"]
    assert isinstance(danger, Issue) and danger.code == "L801"
    assert found.path.extents == ((5.0, 5.0, -1.0), (9.0, 5.0, 5.0))
    assert len(found.run) == len(found.path)


def test_a_certificate_names_each_difference_with_its_lines(programs: dict[str, str]) -> None:
    proof = leafcut.verify(programs["right"], programs["deeper"])
    assert not proof.same and proof.compared == ()
    assert proof.before == proof.after and proof.before.holes == 3
    assert all(isinstance(one, Difference) for one in proof.differences)
    assert (proof.differences[0].original, proof.differences[0].new) == (6, 6)
    assert leafcut.verify(programs["right"], programs["right"]).same


def test_the_keys_of_the_answers_are_those_that_scripts_rely_on(programs: dict[str, str]) -> None:
    simulated = api.simulate(programs["low"]).to_dict()
    assert [*simulated] == [
        "schema",
        "program",
        "machine",
        "head",
        "time_s",
        "rapid_mm",
        "feed_mm",
        "by_kind",
        "by_tool",
        "extents",
        "issues",
    ]
    assert simulated["extents"] == {"x": [5.0, 9.0], "y": [5.0, 5.0], "z": [-1.0, 5.0]}
    proof = api.verify(programs["right"], programs["deeper"]).to_dict()
    head = ["schema", "same", "differences", "before", "after", "compared", "sha256"]
    assert [*proof] == [*head, "allow_reverse", "reversed_cuts", "notes"]
    assert [*proof["differences"][0]] == ["what", "original", "new", "text", "also", "words"]


def test_what_is_of_the_persons_defaults_is_told_by_every_answer(programs: dict[str, str], tmp_path: Path) -> None:
    defaults = tmp_path / "defaults.toml"
    defaults.write_text('machine = "grbl-3018"\nseed = 7\n')
    found = api.simulate(programs["right"], defaults_file=defaults)
    proof = api.verify(programs["right"], programs["right"], defaults_file=defaults)
    solved = api.solve("random:6:1", defaults_file=defaults)
    assert (found.defaults, proof.defaults, solved.defaults) == (
        ("--machine grbl-3018",),
        ("--machine grbl-3018",),
        ("--seed 7",),
    )
    answers = found.to_dict(), proof.to_dict(), solved.to_dict()
    assert [answer["defaults"] for answer in answers] == [["--machine grbl-3018"]] * 2 + [["--seed 7"]]


def test_a_solved_map_has_its_points_its_tour_and_its_gap() -> None:
    """Every point once; of a map without a known best length the gap is that against the bound."""
    solved = api.solve("random:9:2")
    assert sorted(solved.solution.nodes.tolist()) == list(range(len(solved.part.holes)))
    assert solved.gap == solved.solution.gap
    better = dataclasses.replace(solved, part=dataclasses.replace(solved.part, optimum=solved.solution.cost / 2))
    assert better.gap == pytest.approx(1.0)


def test_answers_cannot_be_changed(programs: dict[str, str]) -> None:
    for answer in (api.simulate(programs["right"]), api.verify(programs["right"], programs["right"])):
        with pytest.raises(dataclasses.FrozenInstanceError):
            answer.defaults = ("else",)  # type: ignore[misc]


@pytest.mark.parametrize("variants", [None, 2])
def test_a_nest_holds_its_drawings_whether_they_are_written_or_not(tmp_path: Path, variants: int | None) -> None:
    words, output = [f"{EXAMPLES / 'bracket.dxf'}:9"], tmp_path / "sheet.dxf"
    found = leafcut.nest(words, **{**NEST, "variants": variants})
    assert found.files == () and not list(tmp_path.iterdir())
    written = leafcut.nest(words, output, **{**NEST, "variants": variants})
    assert written.drawings == found.drawings
    assert written.files == found.names(output, variants or 1)
    assert len(found.drawings) == (len(found.nests) if variants else 1)
    for files, texts in zip(written.files, found.drawings, strict=True):
        assert [Path(file).read_text(encoding="utf-8") for file in files] == list(texts)


def test_parts_of_a_nest_can_be_said_in_words_or_as_drawings() -> None:
    bracket, gusset = str(EXAMPLES / "bracket.dxf"), str(EXAMPLES / "gusset.svg")
    said = leafcut.nest([f"{bracket}:3", gusset], **NEST)
    typed = leafcut.nest([leafcut.WantedDrawing(bracket, 3), leafcut.WantedDrawing(gusset)], **NEST)
    assert typed.drawings == said.drawings
    turned = leafcut.nest([leafcut.WantedDrawing(bracket, 1, ("90",))], **NEST)
    assert [p.angle for p in turned.nests[0].layouts[0].placements] == [pytest.approx(math.pi / 2)]
    with pytest.raises(leafcut.OptionError, match="must be 1 or more"):
        leafcut.WantedDrawing(bracket, 0)
