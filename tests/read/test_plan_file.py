"""Plan files: they can be read back, and typing errors are reported with their position."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from leafcut.errors import ReadError
from leafcut.model.cutting import ContourPrint, CutChoice, Lead, PlanFile
from leafcut.read.plan_file import load_plan, plan_file_text

PLAN = PlanFile(
    sheet="plate",
    contours=(ContourPrint("cut", 200.0, 2500.0, (0.0, 0.0), "CUT", "2F"), ContourPrint("mark", 20.0, 0.0, (5.0, 5.0))),
    cuts=(
        CutChoice((1,), (5.0, 5.0), "forward"),
        CutChoice((0,), (10.0, 0.0), "clockwise", Lead("arc", 6.0, 1.5707963267948966), Lead(), ("start", "lead")),
    ),
    process="plasma",
    material="mild_steel",
    thickness=6.0,
)


def test_a_plan_is_written_and_read_again(tmp_path: Path) -> None:
    file = tmp_path / "plan.json"
    file.write_text(plan_file_text(PLAN), encoding="utf-8")
    again = load_plan(file)
    assert again.contours == PLAN.contours
    assert [c.fixed for c in again.cuts] == [(), ("start", "lead")]
    assert again.cuts[1].lead_in is not None
    assert again.cuts[1].lead_in.angle == pytest.approx(PLAN.cuts[1].lead_in.angle)  # type: ignore[union-attr]
    assert (again.sheet, again.process, again.thickness, again.source) == ("plate", "plasma", 6.0, str(file))


def test_contours_are_counted_from_one_and_angles_are_in_degrees() -> None:
    data = json.loads(plan_file_text(PLAN))
    assert data["cuts"][0]["contours"] == [2]
    assert data["cuts"][1]["lead_in"] == {"style": "arc", "length": 6.0, "angle": 90.0}


def edited(change: dict[str, Any], cut: dict[str, Any] | None = None) -> str:
    data = json.loads(plan_file_text(PLAN))
    data.update(change)
    if cut is not None:
        data["cuts"][1].update(cut)
    return json.dumps(data)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{", "is not valid JSON"),
        ("[" * 100_000, "is not valid JSON"),
        ("[]", "a JSON object was expected"),
        ("{}", "'leafcut_plan' is missing"),
        ('{"leafcut_plan": 1}', "'contours' is missing"),
        (edited({"cuts": {}}), "'cuts': a list was expected"),
        (edited({"cuts": [7]}), "cut 1: a JSON object was expected"),
        (edited({"sheet": 3}), "'sheet': 3 is not a string"),
        (edited({}, {"contours": [3]}), "cut 2: unknown contour 3; contours are numbered 1 to 2"),
        (edited({}, {"contours": [True]}), "unknown contour true"),
        (edited({}, {"start": [1]}), r"cut 2: 'start': a point \[x, y\]"),
        (edited({}, {"start": [1, "b"]}), "not a number"),
        (edited({}, {"start": [1, 1e300]}), "not a number in range"),
        (edited({}, {"start": [1, 10**400]}), "not a number in range"),
        (edited({}, {"direction": "cw"}), "is not one of clockwise"),
        (edited({}, {"fixed": ["all"]}), "is not one of order, start"),
        (edited({}, {"lead_in": {"style": "arc", "length": -1}}), "a length above 0"),
        (edited({}, {"lead_in": {"style": "arc", "length": 5, "angle": 200}}), "between 0 and 180"),
        (edited({}, {"lead_in": {"style": "arc"}}), "null is not a number"),
        (edited({}, {"lead": {}}), "unknown key 'lead'; did you mean 'lead_in'"),
        (edited({}, {"direction": "", "fixed": ["direction"]}), "is not one of"),
        (edited({"contours": [{}]}), "contour 1: 'kind' is missing"),
    ],
)
def test_a_mistyped_plan_is_refused_with_its_place(text: str, words: str, tmp_path: Path) -> None:
    file = tmp_path / "plan.json"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ReadError, match=words) as caught:
        load_plan(file)
    assert "\n" not in str(caught.value)


def test_what_is_fixed_must_be_said(tmp_path: Path) -> None:
    data = json.loads(plan_file_text(PLAN))
    del data["cuts"][1]["start"]
    file = tmp_path / "plan.json"
    file.write_text(json.dumps(data), encoding="utf-8")
    with pytest.raises(ReadError, match="'start' is fixed, but has no value"):
        load_plan(file)
