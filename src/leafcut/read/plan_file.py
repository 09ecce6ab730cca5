"""Read and write plan files, which store the choices of a cutting plan as JSON that a user can read, edit and load.

    {"leafcut_plan": 1, "sheet": "brackets", "contours": […], "cuts": [
      {"contours": [2], "start": [41.2, 80.5], "direction": "counter-clockwise",
       "lead_in": {"style": "arc", "length": 6, "angle": 90}, "lead_out": {"style": "none"}, "fixed": ["start"]}]}

Contours are numbered from 1 in file order. Lengths are in mm, and angles in degrees. The list of cuts follows the
cutting order. A cut with ``"bridge": true`` starts without a pierce: the torch stays on after the previous cut.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from leafcut.errors import ReadError, name_suggestion, printable
from leafcut.files.schemas import PLAN, check_schema
from leafcut.message import Message
from leafcut.model.cutting import DIRECTIONS, FIXABLE, LEAD_STYLES, ContourPrint, CutChoice, Lead, PlanFile
from leafcut.read.format import load_json

_LEAD_KEYS = ("style", "length", "angle", "run_in")
_CUT_KEYS = ("contours", "start", "direction", "lead_in", "lead_out", "bridge", "fixed")


def plan_file_text(plan: PlanFile) -> str:
    """Write the text of a plan file, with one line per contour and cut."""
    contours = [
        {
            "kind": c.kind,
            "length": round(c.length, 4),
            "area": round(c.area, 3),
            "start": [round(v, 4) for v in c.start],
            "layer": c.layer,
            "handle": c.handle,
        }
        for c in plan.contours
    ]
    cuts = [
        {
            "contours": [number + 1 for number in c.contours],
            **({"start": list(c.start)} if c.start is not None else {}),
            **({"direction": c.direction} if c.direction else {}),
            **{key: _lead_as_json(lead) for key, lead in (("lead_in", c.lead_in), ("lead_out", c.lead_out)) if lead},
            **({"bridge": True} if c.bridge else {}),
            "fixed": list(c.fixed),
        }
        for c in plan.cuts
    ]
    head = {
        PLAN.key: PLAN.current,
        "sheet": plan.sheet,
        "process": plan.process,
        "material": plan.material,
        "thickness": plan.thickness,
    }
    lines = [f"  {json.dumps(key)}: {json.dumps(value)}" for key, value in head.items()]
    for key, rows in (("contours", contours), ("cuts", cuts)):
        inner = ",\n".join(f"    {json.dumps(row)}" for row in rows)
        lines.append(f'  "{key}": [\n{inner}\n  ]')
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _lead_as_json(lead: Lead) -> dict[str, Any]:
    if lead.style == "none":
        return {"style": "none"}
    run_in = {"run_in": round(lead.run_in, 4)} if lead.run_in else {}
    return {"style": lead.style, "length": round(lead.length, 4), "angle": round(math.degrees(lead.angle), 4), **run_in}


def load_plan(path: Path) -> PlanFile:
    """Read a plan file.

    Raises
    ------
    ReadError
        The file is not a plan file; the message describes the cut and the problem.
    DataError
        This version of leafcut does not support the schema of the file.
    """
    place = str(path)
    data = load_json(path)
    reader = _PlanReader(place)
    reader.check_table(data, Message("the file"), (PLAN.key,))
    check_schema(PLAN, data[PLAN.key], place)
    reader.check_table(data, Message("the file"), ("contours", "cuts"))
    contours = reader.parse_list(data["contours"], "contours")
    cuts = reader.parse_list(data["cuts"], "cuts")
    return PlanFile(
        sheet=reader.parse_text(data.get("sheet", ""), "'sheet'"),
        contours=tuple(reader.parse_contour(row, Message("contour {}", n)) for n, row in enumerate(contours, 1)),
        cuts=tuple(reader.parse_cut(row, Message("cut {}", n), len(contours)) for n, row in enumerate(cuts, 1)),
        process=reader.parse_text(data.get("process", ""), "'process'"),
        material=reader.parse_text(data.get("material", ""), "'material'"),
        thickness=reader.parse_number(data.get("thickness", 0.0), "'thickness'"),
        source=place,
    )


class _PlanReader:
    def __init__(self, place: str) -> None:
        self.place = place

    def refusal(self, label: str, reason: str) -> ReadError:
        return ReadError(self.place, Message("{}: {}", label, reason))

    def check_table(self, data: Any, label: str, needed: tuple[str, ...]) -> None:
        if not isinstance(data, dict):
            raise self.refusal(label, Message("a JSON object was expected"))
        for key in needed:
            if key not in data:
                raise self.refusal(label, Message("'{}' is missing", key))

    def parse_list(self, data: Any, label: str) -> list[Any]:
        if not isinstance(data, list):
            raise self.refusal(f"'{label}'", Message("a list was expected"))
        return data

    def parse_text(self, value: Any, label: str) -> str:
        if not isinstance(value, str):
            raise self.refusal(label, Message("{} is not a string", printable(json.dumps(value))))
        return printable(value, 200)

    def parse_number(self, value: Any, label: str) -> float:
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if not number or abs(value) > 1e9 or not math.isfinite(value):
            raise self.refusal(label, Message("{} is not a number in range", printable(json.dumps(value))))
        return float(value)

    def parse_flag(self, value: Any, label: str) -> bool:
        if not isinstance(value, bool):
            raise self.refusal(label, Message("{} is not true or false", printable(json.dumps(value))))
        return value

    def parse_point(self, value: Any, label: str) -> tuple[float, float]:
        if not isinstance(value, list) or len(value) != 2:
            raise self.refusal(label, Message("a point [x, y] was expected"))
        return self.parse_number(value[0], label), self.parse_number(value[1], label)

    def check_keys(self, data: dict[str, Any], label: str, keys: tuple[str, ...]) -> None:
        for key in data:
            if key not in keys:
                raise self.refusal(label, Message("unknown key '{}'{}", printable(key), name_suggestion(key, keys)))

    def parse_choice(self, value: Any, label: str, words: tuple[str, ...]) -> str:
        if value not in words:
            raise self.refusal(label, Message("{} is not one of {}", printable(json.dumps(value)), ", ".join(words)))
        return str(value)

    def parse_contour(self, data: Any, label: str) -> ContourPrint:
        self.check_table(data, label, ("kind", "length", "area", "start"))
        return ContourPrint(
            kind=self.parse_text(data["kind"], f"{label}: 'kind'"),
            length=self.parse_number(data["length"], f"{label}: 'length'"),
            area=self.parse_number(data["area"], f"{label}: 'area'"),
            start=self.parse_point(data["start"], f"{label}: 'start'"),
            layer=self.parse_text(data.get("layer", ""), f"{label}: 'layer'"),
            handle=self.parse_text(data.get("handle", ""), f"{label}: 'handle'"),
        )

    def parse_cut(self, data: Any, label: str, contours: int) -> CutChoice:
        self.check_table(data, label, ("contours",))
        self.check_keys(data, label, _CUT_KEYS)
        numbers = self.parse_list(data["contours"], Message("{}: contours", label))
        for number in numbers:
            if not isinstance(number, int) or isinstance(number, bool) or not 1 <= number <= contours:
                raise self.refusal(
                    label,
                    Message(
                        "unknown contour {}; contours are numbered 1 to {}", printable(json.dumps(number)), contours
                    ),
                )
        fixed = tuple(
            self.parse_choice(w, f"{label}: 'fixed'", FIXABLE) for w in self.parse_list(data.get("fixed", []), "fixed")
        )
        choice = CutChoice(
            contours=tuple(number - 1 for number in numbers),
            start=self.parse_point(data["start"], f"{label}: 'start'") if "start" in data else None,
            direction=self.parse_choice(data["direction"], f"{label}: 'direction'", DIRECTIONS)
            if "direction" in data
            else "",
            lead_in=self.parse_lead(data["lead_in"], f"{label}: 'lead_in'") if "lead_in" in data else None,
            lead_out=self.parse_lead(data["lead_out"], f"{label}: 'lead_out'") if "lead_out" in data else None,
            fixed=fixed,
            bridge=self.parse_flag(data.get("bridge", False), f"{label}: 'bridge'"),
        )
        for name, value in (
            ("start", choice.start),
            ("direction", choice.direction),
            ("lead", choice.lead_in),
            ("bridge", choice.bridge),
        ):
            if name in fixed and not value:
                raise self.refusal(label, Message("'{}' is fixed, but has no value", name))
        return choice

    def parse_lead(self, data: Any, label: str) -> Lead:
        self.check_table(data, label, ("style",))
        self.check_keys(data, label, _LEAD_KEYS)
        style = self.parse_choice(data["style"], label, LEAD_STYLES)
        if style == "none":
            return Lead()
        length, angle = self.parse_number(data.get("length"), label), self.parse_number(data.get("angle", 90.0), label)
        run_in = self.parse_number(data.get("run_in", 0.0), label)
        if not 0.0 < length <= 10_000.0 or not 0.0 < angle < 180.0 or not 0.0 <= run_in <= 1000.0:
            raise self.refusal(
                label, Message("a lead needs a length above 0 mm and an angle between 0 and 180 degrees")
            )
        return Lead(style, length, math.radians(angle), run_in)
