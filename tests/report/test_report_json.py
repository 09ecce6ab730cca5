"""The JSON answer of `optimize`."""

from __future__ import annotations

import json
import math

from leafcut.model.issue import Issue, Severity
from leafcut.model.part import Slot
from leafcut.model.solution import WorkerFigures
from leafcut.processes.registry import report_of
from leafcut.report.json_answer import program_as_json

CONTRACT = {
    "input", "output", "process", "counts", "zero", "before", "after", "saved_percent", "lower_bound", "gap_percent",
    "verified", "issues",
}  # fmt: skip
BESIDE = {
    "compile_seconds",
    "search_seconds",
    "nearest",
    "machine",
    "dialect",
    "algorithm",
    "seed",
    "tools",
    "seconds",
    "missing",
    "workers",
    "report",
    "program_sha256",
}


def test_keys_are_exactly_those_of_the_contract(every_outcome):
    for outcome in every_outcome.values():
        answer = program_as_json(report_of(outcome))
        assert answer.keys() == CONTRACT | BESIDE
        for order in ("before", "nearest", "after"):
            assert answer[order].keys() == {"travel_mm", "cut_mm", "time_s"}


def test_numbers_are_those_of_the_outcome(outcome_of):
    """58 s of 100 s saves 42 %; a cost of 42 s above a bound of 40 s is a gap of 5 %; 3 mm/s is 180 mm/min."""
    answer = program_as_json(report_of(outcome_of([(0.0, 0.0), (9.0, 9.0)])))
    assert answer["before"] == {"travel_mm": 9000.0, "cut_mm": 560.0, "time_s": 100.0}
    assert answer["after"] == {"travel_mm": 3000.0, "cut_mm": 560.0, "time_s": 58.0}
    assert math.isclose(answer["saved_percent"], 42.0)
    assert answer["lower_bound"] == 40.0
    assert math.isclose(answer["gap_percent"], 5.0)
    assert answer["counts"] == {"holes": 2, "slots": 0, "tools": 1, "operations": 1}
    assert answer["tools"] == [
        {
            "number": 1,
            "kind": "drill",
            "name": "",
            "diameter_mm": 2.0,
            "cycle": "G81",
            "feed_mm_min": 180.0,
            "speed_rpm": 1500.0,
            "holes": 2,
            "assumed": True,
        }
    ]
    assert [w["ants"] for w in answer["workers"]] == [1200, 1100]
    assert answer["verified"] is True


def test_a_sum_of_bounds_needs_a_bound_of_every_operation(outcome_of):
    answer = program_as_json(report_of(outcome_of([(0.0, 0.0)], slots=[Slot((0, 0), (5, 5), 2.0)])))
    assert answer["lower_bound"] is None
    assert answer["gap_percent"] is None
    assert answer["tools"][1]["slots"] == 1
    assert answer["algorithm"] == "mmas, nn"


def test_what_is_not_a_number_becomes_null(outcome_of):
    workers = (WorkerFigures(0, 0, 0.1, math.inf),)
    answer = program_as_json(report_of(outcome_of([(0.0, 0.0)], solution={"workers": workers}, seconds=math.nan)))
    assert answer["workers"][0]["best"] is None
    assert answer["seconds"] is None


def test_every_answer_is_plain_json(every_outcome):
    for outcome in every_outcome.values():
        answer = program_as_json(report_of(outcome))
        assert json.loads(json.dumps(answer, allow_nan=False)) == answer


def test_issues_keep_their_code_and_place(outcome_of):
    issue = Issue("L301", "two holes were one", "plate.dxf:12", Severity.NOTE)
    assert program_as_json(report_of(outcome_of(issues=(issue,))))["issues"] == [
        {"code": "L301", "severity": "note", "message": "two holes were one", "place": "plate.dxf:12"}
    ]
