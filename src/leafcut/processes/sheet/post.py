"""Write cutting programs for a torch or a beam. The commands come from the table ``[torch]`` of a dialect."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

from leafcut.errors import PostError
from leafcut.gcode.dialects import Dialect, Torch
from leafcut.gcode.torch import KERF_REGISTER, LEAST_PERCENT, convert_torch_path_for_controller
from leafcut.model.cutting import CutPlan
from leafcut.model.toolpath import Kind, Motion, Toolpath
from leafcut.options import PostOptions
from leafcut.post.row_writer import Writer
from leafcut.post.words import format_number
from leafcut.units import SECONDS_PER_MINUTE

#: Number of decimals of a feed percentage. An error of 0.1 % is negligible.
_PERCENT_DECIMALS = 1
_SAME_FEED = 1e-3


def write_cut_program(
    plan: CutPlan, path: Toolpath, dialect: Dialect, options: PostOptions, header: Sequence[str] = ()
) -> str:
    """Write the program that cuts a sheet.

    The program passes the cutting data of the plan to the controller, and leaves out actions that the controller
    performs itself (`gcode.torch`). If a dialect has no table for torches, M3 and M5 switch the torch as if it were a
    spindle. Raises PostError if the toolpath needs a command that the controller does not have.
    """
    lines = header if options.header else ()
    marks = bool(((path.kind == Kind.SPINDLE) & (path.ref != 0)).any())
    compensates = bool((path.kind == Kind.RADIUS).any())
    check_dialect_support(dialect, options, marks=marks, compensates=compensates)
    if dialect.torch is None:
        return Writer(path, dialect, options).program_text(lines)
    return _TorchWriter(plan, path, dialect, dialect.torch, options).program_text(lines)


def check_dialect_support(dialect: Dialect, options: PostOptions, *, marks: bool, compensates: bool) -> None:
    """Raise PostError if the dialect does not support marks, kerf compensation, or a material number."""
    torch, name = dialect.torch, dialect.name
    if marks and (torch is None or not torch.mark_on):
        raise PostError(
            "{} has no command for marking; leave the marks out (--ignore-layers), or choose another dialect", name
        )
    if marks and torch is not None and torch.power and options.mark_power >= options.beam_power:
        raise PostError(
            "--mark-power {} is not below --beam-power {}: marks would be cut through; give a lower --mark-power",
            options.mark_power,
            options.beam_power,
        )
    if compensates and (torch is None or not torch.compensation):
        raise PostError("{} does not compensate the kerf (G41, G42); use --compensation geometry", name)
    if options.material_number is not None and (torch is None or not torch.material):
        raise PostError("{} has no table of materials; leave out --material-number", name)


class _TorchWriter(Writer):
    def __init__(self, plan: CutPlan, path: Toolpath, dialect: Dialect, torch: Torch, options: PostOptions) -> None:
        super().__init__(convert_torch_path_for_controller(path, dialect), dialect, options)
        self.plan, self.torch = plan, torch
        self.lit: Motion | None = None
        self.compensating = False
        self.percent = 100.0
        self.compensated = _first_compensated_moves(self.path)
        # If the controller moves Z, the program may travel from its first block.
        self.safe = not dialect.has_z_words

    def _row_writers(self) -> dict[Kind, Callable[[Motion], None]]:
        more: dict[Kind, Callable[[Motion], None]] = {
            Kind.TORCH: self._write_output_switch,
            Kind.HEIGHT: self._write_output_switch,
            Kind.BLENDING: self._write_blending,
            Kind.RADIUS: self._write_compensation,
            Kind.PROBE: self._write_probe_move,
            Kind.SHIFT: self._write_z_shift,
            Kind.TOOL: self._write_tool_change_only,
            Kind.OFFSET: self._write_tool_offset,
        }
        return {**super()._row_writers(), **more}

    # -- the head ----------------------------------------------------------------------------------------------------

    def _write_header(self, header: Sequence[str]) -> None:
        super()._write_header(header)
        if {610, 640} <= self.dialect.g_codes and not (self.path.kind == Kind.BLENDING).any():
            self.out.write("G61")  # an earlier program may have left corner rounding active
        if (self.path.kind == Kind.TOOL).any():
            self.out.write_comment(
                f"marks: the scribe is tool {self.torch.mark_tool}; its X and Y offset from the torch, tool 0, must be "
                "in the tool table"
            )
        if self.torch.compensation == "G41" and (self.path.kind == Kind.RADIUS).any():
            half = self.numbers.format_length(0.5 * self.plan.data.kerf)
            unit = "inch" if self.numbers.inch else "mm"
            self.out.write_comment(f"register D{KERF_REGISTER} must hold half of the kerf as a radius: {half} {unit}")
        number = self.options.material_number
        if number is not None:
            for block in self.torch.material:
                self.out.write(block.format(number=number))
        elif self.torch.material_comment:
            self.out.lines.append(self._material_comment())

    def _material_comment(self) -> str:
        """Return the material comment for QtPlasmaC. The setting ``o=0`` applies the material to this program only."""
        data, length = self.plan.data, self.numbers.format_length
        figures = {
            "kw": length(data.kerf),
            "ph": length(data.pierce_height),
            "pd": format_number(data.pierce_delay, 3),
            "ch": length(data.cut_height),
            "fr": self.numbers.format_feed(data.feed),
        }
        if data.amps:
            figures["ca"] = format_number(data.amps, 1)
        if data.volts:
            figures["cv"] = format_number(data.volts, 1)
        return "(o=0, " + ", ".join(f"{name}={value}" for name, value in figures.items()) + ")"

    # -- moves -------------------------------------------------------------------------------------------------------

    def _write_feed_move(self, row: Motion) -> None:
        self._set_feed_share(row)
        super()._write_feed_move(row)

    def _write_arc(self, row: Motion) -> None:
        self._set_feed_share(row)
        super()._write_arc(row)

    def _set_feed_share(self, row: Motion) -> None:
        """Write the feed of a row as a percentage of the feed in the chart (M67).

        Nothing is written if the percentage stays the same.
        """
        if self.torch.feed_output is None or self.lit is None:
            return
        percent = self._feed_share(row)
        if percent == self.percent:
            return
        if self.compensating:
            raise PostError("the feed cannot change (M67) while the controller compensates the kerf (G41, G42)")
        self.out.write(f"M67 E{self.torch.feed_output} Q{format_number(percent, _PERCENT_DECIMALS)}")
        self.percent = percent

    def _feed_share(self, row: Motion) -> float:
        """Return the feed of a row as a percentage of the feed in the chart.

        If the F word states the feed, return 100.
        """
        percent = round(100.0 * row.value / self.plan.data.feed, _PERCENT_DECIMALS)
        assert self.lit is not None
        marks = self.lit.ref != 0
        return percent if not marks and LEAST_PERCENT <= percent < 100.0 else 100.0

    def _feed_word(self, row: Motion) -> str:
        feed = row.value
        if self.torch.feed_output is not None and self.lit is not None:
            feed = row.value if self.percent == 100.0 else self.plan.data.feed
        marks = self.lit is not None and self.lit.ref != 0
        if self.options.material_number is not None and not marks:
            if abs(feed / self.plan.data.feed - 1.0) > _SAME_FEED:
                raise PostError(
                    "a feed of {:.6g} mm/min cannot be set if the controller takes the feed "
                    "from its material table; leave out --material-number",
                    feed * SECONDS_PER_MINUTE,
                )
            return self.out.activate_modal_word("F", self.torch.material_feed)
        return self.out.activate_modal_word("F", "F" + self.numbers.format_feed(feed))

    # -- the torch ---------------------------------------------------------------------------------------------------

    def _write_spindle(self, row: Motion) -> None:
        torch = self.torch
        if row.value:
            words = torch.mark_on if row.ref else torch.on
            self.out.write(words.format(power=self._power_text(row)))
            self.lit = row
        else:
            self.out.write(torch.mark_off if row.ref else torch.off)
            self.lit = None

    @staticmethod
    def _power_text(row: Motion) -> str:
        return format_number(abs(row.value), 0)

    def _write_tool_change_only(self, row: Motion) -> None:
        if self.lit is not None or self.compensating:
            raise PostError("the tool cannot be changed (M6) while the torch is on")
        self.out.write(f"T{row.ref}", "M6")

    def _write_tool_offset(self, row: Motion) -> None:
        """Write the tool offset, and make the next move contain both X and Y, which activates the offset."""
        self.out.write("G43", f"H{row.ref}")
        self.out.forget_modal_words(["motion", *"XY"])
        for axis in range(2):
            self.place[axis], self.position[axis] = None, math.nan

    def _write_output_switch(self, row: Motion) -> None:
        if self.compensating:
            raise PostError("outputs cannot be switched (M62) while the controller compensates the kerf (G41, G42)")
        if row.kind is Kind.TORCH and self.torch.power:
            self.out.write("S" + (self._power_text(self.lit) if row.value and self.lit else "0"))
            return
        number = self.torch.arc_output if row.kind is Kind.TORCH else self.torch.height_output
        self.out.write(f"{'M63' if row.value else 'M62'} P{number}")

    def _write_compensation(self, row: Motion) -> None:
        words = self.torch.compensation
        if row.ref != 40 and not self.compensating:
            self._set_feed_share(next(self.compensated))  # M67 is not allowed while the controller compensates
        self.compensating = row.ref != 40
        if not self.compensating:
            self.out.write("G40")
        else:
            by_width = words.endswith(".1")
            register = self.numbers.format_length(row.value) if by_width else f"{row.value:.0f}"
            self.out.write(f"G{row.ref}{'.1' if by_width else ''}", f"D{register}")

    def _write_probe_move(self, row: Motion) -> None:
        if not self.torch.probe:
            raise PostError("{} has no probing command", self.dialect.name)
        self._check_position_known(row)
        self.out.forget_modal_words(["motion", "Z"])
        feed = self.out.activate_modal_word("F", "F" + self.numbers.format_feed(row.value))
        self.out.write(self.out.activate_modal_word("motion", self.torch.probe), self._axis_word(row, 2), feed)
        self._forget_height()

    def _write_z_shift(self, row: Motion) -> None:
        """Set Z to the height at which the probe tripped, or cancel this shift."""
        self._forget_height()
        if math.isnan(row.end[2]):
            self.out.write("G92.1")
            return
        self.out.write("G92", self._axis_word(row, 2))
        self._track_position(row)

    def _forget_height(self) -> None:
        self.out.forget_modal_words("Z")
        self.place[2], self.position[2] = None, math.nan

    def _write_end(self, row: Motion) -> None:
        for block in self.torch.finish:
            self.out.write(block)
        super()._write_end(row)


def _first_compensated_moves(path: Toolpath) -> Iterator[Motion]:
    """Yield the first cutting move each time after the controller switches cutter compensation on."""
    waiting, on = False, False
    for row in path:
        if row.kind is Kind.RADIUS:
            waiting, on = (waiting or not on) and row.ref != 40, row.ref != 40
        elif waiting and row.kind in (Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW):
            waiting = False
            yield row
