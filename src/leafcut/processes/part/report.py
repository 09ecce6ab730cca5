"""Facts about a milled part: outlines, openings, tabs, tool, depth and heights."""

from __future__ import annotations

from typing import Any

from leafcut.message import Message
from leafcut.model.fact import Fact
from leafcut.model.shown_stock import ShownStock
from leafcut.model.toolpath import g_word
from leafcut.processes.part.model import LayerWork, PartDetail
from leafcut.report.drawing import Scene
from leafcut.report.path_report import PathReport
from leafcut.report.set_up import coordinate_words, height_facts, time_facts, tool_facts
from leafcut.report.wording import count_text, replace_unprintable
from leafcut.units import to_fixed


class PartReport(PathReport[PartDetail]):
    """Facts and pictures of a milled part."""

    @property
    def cleared(self) -> float:  # type: ignore[override]
        """Width of the cleared strip along the path of the mill, mm."""
        return self.outcome.operations[-1].tool.diameter

    def count_facts(self) -> list[Fact]:
        """Return the number of outlines, openings and tabs."""
        detail = self.outcome.detail
        return [
            Fact("counts.outlines", detail.outlines, "", count_text(detail.outlines, "outline")),
            Fact(
                "counts.openings",
                detail.openings,
                "",
                count_text(detail.openings, "opening") if detail.openings else "",
            ),
            Fact("counts.holes", detail.holes, "", count_text(detail.holes, "drilled hole") if detail.holes else ""),
            Fact("counts.tabs", detail.tabs, "", count_text(detail.tabs, "tab") if detail.tabs else ""),
        ]

    def process_facts(self) -> list[Fact]:
        """Return the tool, the depth, the heights and the time."""
        detail = self.outcome.detail
        lowest = float(self.outcome.path_after.extents[0][2])
        below = to_fixed(-detail.thickness - lowest, 2)
        words = Message("Z0 is the top; the lowest point is Z{}, {} mm below the plate", to_fixed(lowest, 2), below)
        return [
            *self._layers(),
            *tool_facts(self.outcome.operations),
            Fact(sentence=words, name=Message("Depth")),
            *self._finish(),
            *height_facts(detail.clearance, f"Z{coordinate_words(detail.retract)}"),
            *time_facts(self.outcome),
            *self._copies(),
        ]

    def _copies(self) -> list[Fact]:
        """Return the number of copies, their pitch or work offsets, and the share of the time that one copy takes."""
        grid, offsets = self.outcome.detail.copies, self.outcome.detail.work_offsets
        if len(offsets) > 1:
            each = self.outcome.after.time_s / len(offsets)
            names = [g_word(offset) for offset in offsets]
            words = Message("one plate each in {}; moves between them are not included in the time", ", ".join(names))
            return [
                Fact("copies.count", len(offsets), "", words, Message("Fixtures")),
                Fact("copies.work_offsets", names),
                Fact("copies.time_each_s", each, "s", Message("average of all fixtures"), Message("Time per plate")),
            ]
        if grid is None:
            return []
        each = self.outcome.after.time_s / grid.number
        dx, dy = map(coordinate_words, grid.pitch)
        words = Message("{} x {}, pitch {} mm in X and {} mm in Y", grid.columns, grid.rows, dx, dy)
        return [
            Fact("copies.count", grid.number, "", words, Message("Copies")),
            Fact("copies.pitch_mm", list(grid.pitch)),
            Fact("copies.time_each_s", each, "s", Message("average of all copies"), Message("Time per copy")),
        ]

    def _finish(self) -> list[Fact]:
        allowance = self.outcome.detail.finish
        words = Message("left on the walls for the finishing pass")
        return [Fact("finish_mm", allowance, "mm", words, Message("Finish"))] if allowance else []

    def _layers(self) -> list[Fact]:
        layers = self.outcome.detail.layers
        rows = [
            {
                "layer": one.layer,
                "shapes": one.shapes,
                "operation": one.operation,
                "depth_mm": one.depth,
                "tool": one.tool,
                "tools": [tool.number for tool in one.tools],
            }
            for one in layers
        ]
        lines = [
            Fact(
                sentence=Message.joined(", ", filter(None, words)),
                name=Message("Layer {}", replace_unprintable(one.layer)) if one.layer else Message("No layer"),
            )
            for one in layers
            for words in [(count_text(one.shapes, "shape"), one.operation, self._depth_words(one), one.tool)]
        ]
        return [Fact("layers", rows), *lines]

    def _depth_words(self, work: LayerWork) -> str:
        through = work.depth > self.outcome.detail.thickness
        deep = Message("through") if through else Message("{:g} mm deep", work.depth)
        return deep if work.depth else ""

    def template_values(self) -> dict[str, Any]:
        """Return the values for the report page, including the work on each layer."""
        rows = [
            {
                "name": replace_unprintable(one.layer),
                "shapes": one.shapes,
                "operation": one.operation,
                "depth": self._depth_words(one),
                "tool": replace_unprintable(one.tool),
            }
            for one in self.outcome.detail.layers
        ]
        return {**super().template_values(), "layers": rows}

    def size_words(self, scene: Scene) -> str:
        """Format the size of the part as text."""
        x0, y0, x1, y1 = self.outcome.part.extents
        return f"{x1 - x0:.4g} × {y1 - y0:.4g} mm"

    def shown_stock(self) -> ShownStock:
        """Return the mill, and a plate that encloses the cuts."""
        return ShownStock(super().shown_stock().tools, floor=-self.outcome.detail.thickness)
