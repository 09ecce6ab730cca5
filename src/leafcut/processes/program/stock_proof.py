"""Create the judge that compares the stock that a reordered program leaves, if the stock and the tools are known."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from leafcut.errors import OptionError, PlanError
from leafcut.material.height_field import usual_cell
from leafcut.material.straight_moves import smallest_tool, undivided_moves
from leafcut.message import Message
from leafcut.model.cutter import body_of, cutter_of
from leafcut.model.issue import Issue
from leafcut.model.kinds import BEAMS
from leafcut.processes.job import dialect_of
from leafcut.processes.program.model import StockProof
from leafcut.processes.program.tools import known_tools

if TYPE_CHECKING:
    from leafcut.gcode.program import Program
    from leafcut.processes.job import Job
    from leafcut.processes.program.proof.stock_judge import StockJudge

#: Usual number of cells, maximum cell size as a share of the smallest tool diameter, and maximum number of cells.
_CELLS, _SHARE, _MOST = 2_000_000, 0.05, 8_000_000

_NO_SHAPES = Message("the shapes of its tools are unknown; give --tools or --tool-diameter")


class Judging(NamedTuple):
    """The judge or None, its height field or the reason why there is no judge, and issues about the original
    program.
    """

    judge: StockJudge | None = None
    proof: StockProof | None = None
    issues: tuple[Issue, ...] = ()


def stock_judge(job: Job, program: Program, source: str, process: str) -> Judging:
    """Return a judge that compares the stock that new orders of a program leave with the stock that the original
    leaves.

    Without ``--workpiece``, the stock is a block around the cuts below Z0. A tool of which only the diameter is known
    counts as a flat end mill. Cuts by tools of unknown diameter are left out. The judge is None for a laser or torch
    program, and for a program that only drills with tools of unknown diameter.

    Raises
    ------
    OptionError
        The given stock is not a block, or the program never touches it.
    PlanError
        The given stock has too many cells.
    """
    if process in BEAMS:
        return Judging()
    tools, unknown = known_tools(program, job.settings, job.machine, flat=True)
    left_out = tuple(unknown)
    if not tools and process == "drill":
        return Judging()
    if not tools:
        beam = dialect_of(job).torch is not None
        why = (
            Message("the program is read as a milling program; if a beam cuts, give --process laser or plasma")
            if beam
            else _NO_SHAPES
        )
        why = why if unknown else Message("nothing is cut")
        return Judging(proof=StockProof(unknown=left_out, reason=why))
    from leafcut.processes.program.proof.stock_judge import StockJudge
    from leafcut.processes.program.workpiece import block_around, block_of, field_of, stock_issues
    from leafcut.read.step import ChosenSolid

    cutters = {number: cutter_of(tool) for number, tool in tools.items()}
    smallest = smallest_tool(cutters)
    options = job.settings.stock
    try:
        whole = undivided_moves(program.path, cutters)
        which = ChosenSolid.of(job.settings.read)
        block = block_of(options.workpiece, which) if options.workpiece else block_around(whole, cutters)
        if block is None:
            why = Message("the program cuts nothing below Z0, so the top of the stock is unknown; give --workpiece")
            return Judging(proof=StockProof(unknown=left_out, reason=why))
        stock = field_of(options, block, options.cell or usual_cell(block, smallest, _SHARE, _CELLS, _MOST), which)
        bodies = {number: body_of(tool) for number, tool in tools.items()}
        judge = StockJudge.of(
            program,
            tools,
            cutters,
            bodies,
            stock,
            bool(options.workpiece),
            job.start_step(Message("cutting the stock")),
        )
    except PlanError as problem:
        if options.workpiece or options.cell:
            raise
        return Judging(proof=StockProof(unknown=left_out, reason=str(problem)))
    if options.workpiece and not judge.touched:
        raise OptionError("--workpiece: {} never touches this stock; specify the stock in program coordinates", source)
    flat = tuple(number for number, tool in tools.items() if tool.assumed)
    issues = (*judge.issues(), *stock_issues(options, program, cutters, block, which))
    return Judging(judge, StockProof(stock.heights.size, stock.cell, judge.given, flat, left_out), issues)
