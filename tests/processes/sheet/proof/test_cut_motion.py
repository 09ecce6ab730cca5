"""The judge of a cutting program shares nothing with its writer, and reads what is written, the material included."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from proved_sheets import checked, laid, planned, program

from golden_differences import check_golden
from leafcut.errors import ReadError
from leafcut.gcode import torch
from leafcut.gcode.dialects import load_dialect
from leafcut.model.difference import Difference
from leafcut.model.toolpath import Kind, Motion
from leafcut.options import PostOptions
from leafcut.processes.sheet.options import CutOptions
from leafcut.processes.sheet.proof.cut_motion import check_cut_motion, read_cut_program

MATERIAL = PostOptions(material_number=7)
FEED = "F#<_hal[plasmac.cut-feed-rate]>"


def motion_of(text: str, words: str, options: CutOptions | None = None) -> list[Difference]:
    plan, _ = planned(words, options)
    return check_cut_motion(
        laid(plan.cuts, words), read_cut_program(text, plan, load_dialect(words)), load_dialect(words), "mm"
    )


def without(kind: Kind, keeps: Callable[[Motion], bool] = lambda row: False) -> Callable[..., None]:
    """Return a writer's fault: rows of a kind are not passed on."""
    right = torch._TorchWriter.write

    def write(self: torch._TorchWriter, row: Motion, before: object) -> None:
        if row.kind is not kind or keeps(row):
            right(self, row, before)  # type: ignore[arg-type]

    return write


FAULTS = [
    ("qtplasmac", Kind.TORCH, None),
    ("qtplasmac", Kind.HEIGHT, None),
    ("qtplasmac", Kind.BLENDING, None),
    ("grbl-laser", Kind.SPINDLE, lambda row: row.value != 0.0),
    ("plasma", Kind.DWELL, None),
    ("fanuc-laser", Kind.DWELL, None),
    ("fanuc-laser", Kind.ARC_CCW, None),
    ("grbl-laser", Kind.SPINDLE, lambda row: row.ref == 0),
    ("qtplasmac", Kind.RADIUS, None),
]


@pytest.mark.hazard
@pytest.mark.parametrize("words, kind, keeps", FAULTS, ids=[f"{w} {k.name}" for w, k, _ in FAULTS])
def test_what_the_writer_leaves_out_by_mistake_is_a_difference(
    words: str, kind: Kind, keeps: Callable[[Motion], bool] | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Faults in the function that writes the words; in 0.2.0 the judge used the same function."""
    options = CutOptions(compensation="controller") if kind is Kind.RADIUS else None
    plan, _ = planned(words, options)
    assert motion_of(program(plan.cuts, words), words, options) == []
    monkeypatch.setattr(torch._TorchWriter, "write", without(kind, keeps or (lambda row: False)))
    wrong = program(plan.cuts, words)
    monkeypatch.undo()
    found = motion_of(wrong, words, options)
    assert found != []
    check_golden(
        "sheet_differences.toml", "left out", f"{FAULTS.index((words, kind, keeps)) + 1}. {words} {kind.name}", found
    )


WORDS = [
    ("qtplasmac", r"M62 P3\n", "", "torch (0 dark"),
    ("qtplasmac", r"M62 P2\n", "", "height control"),
    ("qtplasmac", r"M3 \$0 S1\n", "M3 $0 S1\nM5 $0\nM3 $0 S1\n", "number of pierces"),
    ("qtplasmac", r"M3 \$0 S1\n", "M3 $0 S1\nG4 P1\n", "dwell after the torch is lit"),
    ("qtplasmac", r"M3 \$1 S1\n", "M3 $0 S1\n", "torch (0 dark"),
    ("qtplasmac", r"G64 P0\.1\n", "G64 P0.2\n", "tolerance of corners"),
    ("plasma", r"G4 P0\.5\n", "", "dwell after the torch is lit"),
    ("grbl-laser", r"M4 S1000", "M4 S900", "power"),
    ("fanuc-laser", r"G4 P500\n", "G4 P400\n", "dwell after the torch is lit"),
]


@pytest.mark.hazard
@pytest.mark.parametrize("words, old, new, name", WORDS, ids=[f"{w}: {o} → {n}" for w, o, n, _ in WORDS])
def test_another_state_of_the_torch_in_a_move_is_a_difference(words: str, old: str, new: str, name: str) -> None:
    plan, _ = planned(words)
    wrong, count = re.subn(old, new, program(plan.cuts, words), count=1)
    assert count == 1
    found = motion_of(wrong, words)
    assert any(name in d.text for d in found)
    check_golden("sheet_differences.toml", "motion", f"{words}: {old} → {new}", found)


def cuts_alone() -> tuple[object, object, str]:
    """Return a plan without marks, its rules, and its program with the feed of the controller's material 7."""
    plan, rules = planned()
    return plan, rules, program(tuple(c for c in plan.cuts if c.kind == "cut"), post=MATERIAL)


@pytest.mark.hazard
def test_a_feed_from_the_table_is_that_of_the_number_that_the_text_selects() -> None:
    plan, _, text = cuts_alone()
    for units in ("mm", "inch"):
        text = program(
            tuple(c for c in plan.cuts if c.kind == "cut"), post=PostOptions(material_number=7, output_units=units)
        )
        path = read_cut_program(text, plan, load_dialect("qtplasmac"), 7)
        feeds = path.value[(path.kind == Kind.FEED) | (path.kind == Kind.ARC_CW) | (path.kind == Kind.ARC_CCW)]
        assert feeds.max() == pytest.approx(plan.data.feed)
    for wrong, words in (
        (text.replace("M190 P7", "M190 P8"), "M190 P8 selects a material"),
        (text.replace("M190 P7\nM66 P3 L3 Q1\n", ""), "no material is selected"),
        (text.replace("G64", "M190 P2\nG64", 1), "M190 P2 selects a material"),
    ):
        assert wrong != text
        with pytest.raises(ReadError, match=words):
            read_cut_program(wrong, plan, load_dialect("qtplasmac"), 7)
    with pytest.raises(ReadError, match="M190 P7 selects a material"):
        read_cut_program(text, plan, load_dialect("qtplasmac"))


@pytest.mark.hazard
def test_the_text_is_read_as_it_is_written() -> None:
    """The word of the material in a remark is no feed; on 0.2.0 it was replaced before the text was read."""
    plan, _, text = cuts_alone()
    assert text.count(FEED) == 1
    wrong = text.replace(FEED, f"({FEED})")
    with pytest.raises(ReadError):
        read_cut_program(wrong, plan, load_dialect("qtplasmac"), 7)


OTHER = "(o=0, kw=9, ph=9, pd=9, ch=9, fr=999)\n"
MATERIALS = {
    "a second material": (None, "M3 $0 S1\n", f"{OTHER}M3 $0 S1\n"),
    "another material in front": (None, "(o=0,", f"{OTHER}(o=0,"),
    "a material of the table besides": (None, "M3 $0 S1\n", "M190 P7\nM66 P3 L3 Q1\nM3 $0 S1\n"),
    "holes of the screen": (None, "G64 P0.1\n", ";conversational block\nG64 P0.1\n"),
    "a material that overrides that of the table": (7, "M3 $0 S1\n", f"{OTHER}M3 $0 S1\n"),
}


@pytest.mark.hazard
@pytest.mark.parametrize("name", MATERIALS)
def test_the_material_is_stated_once_and_nothing_overrides_it(name: str) -> None:
    number, old, new = MATERIALS[name]
    plan, rules = planned()
    text = cuts_alone()[2] if number else program(plan.cuts)
    assert "material" not in {d.what for d in checked(text, plan, rules, material=number)}
    wrong = text.replace(old, new, 1)
    assert wrong != text
    try:
        found = {d.what for d in checked(wrong, plan, rules, material=number)}
    except ReadError:
        return
    assert "material" in found
