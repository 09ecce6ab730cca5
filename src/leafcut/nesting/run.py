"""Nest the parts of drawings: read the parts, search for nests, check them, and write the sheets as drawings."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

from shapely import Polygon

from leafcut.errors import OptionError, PlanError, VerifyError, count_of, printable
from leafcut.message import Message
from leafcut.model.contour import Contour
from leafcut.model.heartbeat import Heartbeat, OnProgress, Progress, Trial, heartbeat_for_step
from leafcut.model.issue import Issue, MissingWork, Severity
from leafcut.model.machine import Machine
from leafcut.model.nest import Layout, Nest, NestOutcome, NestPart, Remnant, Stock
from leafcut.model.sheet import Sheet
from leafcut.nesting.options import NestOptions
from leafcut.nesting.post import layout_as_dxf, remnant_as_dxf
from leafcut.nesting.proof import check_drawing, check_nest, check_remnants
from leafcut.options import ReadOptions, Settings, SheetOptions, SolveOptions
from leafcut.options.drawings import MARK_NAMES
from leafcut.options.sheet_word import LARGEST_SHEET, SheetWord
from leafcut.processes.cutting_machines import with_default_cutting_machine
from leafcut.read import read_contours
from leafcut.read.format import Source, drawing_unit_mm, load_source
from leafcut.read.machine import load_machine
from leafcut.read.nest_list import WantedDrawing
from leafcut.read.registry import read_source_with_format
from leafcut.read.strip_instance import is_strip_instance, read_strip_instance
from leafcut.units import parse_angles

#: The default size of a sheet is rounded to a multiple of this, mm.
SHEET_STEP = 50.0
#: Maximum number of unplaced parts that a message names.
MAX_NAMED = 5
#: Nests count as duplicates if their ranking values (mm², cost, mm) differ by no more than this.
ALIKE = 0.01

#: Default kerf width, mm.
KERF = 2.0
#: Remnants narrower than this are not kept, mm.
REMNANT_SIZE = 150.0


def search_nests(
    parts: Sequence[NestPart],
    options: NestOptions,
    kerf: float,
    search: SolveOptions,
    *,
    stocks: Sequence[Stock] = (),
    progress: OnProgress | None = None,
    cancelled: threading.Event | None = None,
) -> NestOutcome:
    """Search for nests and return the ones that passed the check, best first.

    The nests use `stocks`, or the sheet sizes in the options if `stocks` is empty. `kerf` is in mm. The same seed gives
    the same nests, unless a time limit ended the search (`Nest.repeatable`). If `cancelled` is set, or the user presses
    Ctrl-C, the nests that are already complete are returned.

    Raises
    ------
    PlanError
        If the list of parts is empty, a part fits no sheet, or no nest passed the check.
    """
    from leafcut.nesting.plan.nesting import nest_variants, prepare_task

    start_time = time.perf_counter()
    cancelled = cancelled or threading.Event()
    task = prepare_task(parts, options, kerf, stocks or sheets_of_given_size(options))
    common = kerf if options.blocks != "none" else 0.0
    nests: list[Nest] = []
    dropped: list[str] = []

    last = Progress(Message(""))

    def report_progress(state: Progress) -> None:
        nonlocal last
        best = 100.0 * max((n.utilisation_of_used for n in nests), default=0.0)
        last = replace(state, step=Message("{}; {:.1f} % utilisation", state.step, best)) if nests else state
        if progress is not None:
            progress(last)

    def report_nest(variant: Nest) -> None:
        used = 100.0 * variant.utilisation_of_used
        if progress is not None:
            progress(replace(last, trial=Trial(f"{variant.method} {variant.seed}", f"{used:.1f} %", -used)))

    try:
        for variant in nest_variants(task, search, report_progress, cancelled):
            if isinstance(variant, Nest):
                report_nest(variant)
            if isinstance(variant, str):
                dropped.append(variant)
            elif faults := check_nest(variant, task.spacing, options.margin, common):
                dropped.append(Message("by {}, seed {}: {}", variant.method, variant.seed, faults[0]))
            else:
                nests.append(variant)
    except KeyboardInterrupt:
        cancelled.set()
        if not nests:
            raise
    if not nests:
        raise PlanError("no nest passed the check: {}", (dropped or [Message("nesting was stopped too early")])[0])
    best = _without_duplicates(nests)[: options.n_offered]
    issues = (*_unplaced_issues(best[0]), *_search_issues(best, dropped, cancelled.is_set()))
    seconds = time.perf_counter() - start_time
    return NestOutcome(tuple(best), task.spacing, options.margin, tuple(dropped), (), (), issues, seconds)


def _without_duplicates(nests: list[Nest]) -> list[Nest]:
    kept: list[Nest] = []
    for variant in sorted(nests, key=lambda n: n.rank):
        if not kept or max(abs(a - b) for a, b in zip(variant.rank, kept[-1].rank, strict=True)) > ALIKE:
            kept.append(variant)
    return kept


def sheets_of_given_size(options: NestOptions) -> list[Stock]:
    """Return the sheets in the options. Raises OptionError if an option names a drawing instead of a size."""
    stocks = []
    for sheet in options.sheets:
        if sheet.size is None:
            raise OptionError("--sheet: {} is a drawing; give a size here", printable(sheet.name))
        stocks.append(Stock(*sheet.size, sheet.count, sheet.price, (), sheet.name))
    return stocks


def _unplaced_issues(best: Nest) -> list[Issue]:
    missing = [Message("{} of {}", n, part.name) for part, n in zip(best.parts, best.unplaced, strict=True) if n]
    if not missing:
        return []
    named = Message.joined(", ", missing[:MAX_NAMED])
    if len(missing) > MAX_NAMED:
        named = Message("{} and {} more", named, count_of(len(missing) - MAX_NAMED, "kind"))
    message = Message("there is no room for {}; add sheets, or use larger ones", named)
    return [Issue("L436", message, missing=MissingWork("part", sum(best.unplaced)))]


def _search_issues(best: list[Nest], dropped: list[str], stopped: bool) -> tuple[Issue, ...]:
    issues = [Issue("L433", Message("a nest was dropped: {}", line)) for line in dropped]
    if stopped:
        issues.append(
            Issue("L434", Message("nesting was stopped early; the best nests found are used"), severity=Severity.NOTE)
        )
    if not all(variant.repeatable for variant in best):
        message = Message(
            "the time limit ended the search; run without a limit to get the same nest from the same seed"
        )
        issues.append(Issue("L434", message, severity=Severity.NOTE))
    return tuple(issues)


def nest_and_write_drawings(
    wanted: Sequence[WantedDrawing],
    settings: Settings,
    output: str | Path | None = None,
    *,
    progress: OnProgress | None = None,
    cancelled: threading.Event | None = None,
) -> tuple[NestOutcome, dict[str, str]]:
    """Nest the parts of drawings.

    Each different sheet becomes a drawing, which is read back and compared with the plan. Without `output`, no sheet
    files are written.

    Returns
    -------
    NestOutcome
        The nests.
    dict of str to str
        The text of each file to be written, keyed by its path.

    Raises
    ------
    ReadError, OptionError, PlanError or VerifyError
        If the parts cannot be read or nested, or if the result is wrong.
    """
    if output and Path(output).suffix.lower() != ".dxf":
        raise OptionError("--output: nested sheets are written as DXF; name a .dxf, not '{}'", Path(output).name)
    settings, parts, stocks, issues = _read_inputs(wanted, settings, progress)
    options = settings.of(NestOptions)
    kerf = KERF if settings.cut_data.kerf is None else settings.cut_data.kerf
    outcome = search_nests(parts, options, kerf, settings.solve, stocks=stocks, progress=progress, cancelled=cancelled)
    names = outcome.names(output or "sheet.dxf", options.n_written)
    drawings = tuple(
        _write_sheet_drawings(variant, files) for variant, files in zip(outcome.nests, names, strict=False)
    )
    files = names if output else ()
    texts = {file: text for pair in zip(files, drawings, strict=False) for file, text in zip(*pair, strict=True)}
    remnants: tuple[Remnant, ...] = ()
    if options.remnants_out is not None:
        remnants, remnant_texts = _write_remnants(outcome, Path(output or "sheet.dxf").stem, options)
        texts |= remnant_texts
    sheet_issues = _table_issues(outcome.nests[: options.n_written], settings)
    all_issues = (*sheet_issues, *dict.fromkeys(issues), *outcome.issues)
    issues = sorted(all_issues, key=lambda issue: issue.missing is None)
    return replace(outcome, files=files, drawings=drawings, remnants=remnants, issues=tuple(issues)), texts


def _read_inputs(
    wanted: Sequence[WantedDrawing], settings: Settings, progress: OnProgress | None
) -> tuple[Settings, list[NestPart], list[Stock], list[Issue]]:
    """Return the settings with the sheet size, the parts to nest, the kinds of sheet, and the issues.

    If a file is listed several times, it is only read once.
    """

    @cache
    def load_cached(file: str) -> Source:
        return load_source(file) if is_strip_instance(file) else read_source_with_format(file)[1]

    @cache
    def sheet_of(file: str) -> Sheet:
        return _read_sheet(load_cached(file), settings, heartbeat_for_step(progress, Message("reading")))

    settings, stocks = _available_sheets(settings, load_cached, heartbeat_for_step(progress, Message("reading")))
    issues: list[Issue] = []
    parts: list[NestPart] = []
    for entry in wanted:
        angles = parse_angles(entry.rotations, "rotations") if entry.rotations else settings.of(NestOptions).angles
        if is_strip_instance(entry.file):
            turned = bool(entry.rotations) or "rotations" in settings.given
            unit = drawing_unit_mm(settings.of(ReadOptions), None)
            parts += read_strip_instance(load_cached(entry.file), entry.quantity, angles, turned, unit)
            continue
        sheet = sheet_of(entry.file)
        new_parts, part_issues = parts_of_sheet(sheet, entry.quantity, angles)
        parts += new_parts
        issues += [
            *(replace(issue, message=Message("{}: {}", sheet.name, issue.message)) for issue in sheet.issues),
            *part_issues,
        ]
    return settings, parts, stocks, issues


def _read_sheet(source: Source, settings: Settings, on_progress: Heartbeat) -> Sheet:
    from leafcut.processes.contours import prepare_sheet

    part = read_contours(source, settings.read, on_progress)
    try:
        return prepare_sheet(part, settings.sheet, settings.read.concentric)
    except PlanError as error:
        # Name the drawing, unless the message already does.
        raise error if _starts_with_file_name(error, source.path) else PlanError("{}: {}", source, error) from None


def _available_sheets(
    settings: Settings, load_cached: Callable[[str], Source], on_progress: Heartbeat
) -> tuple[Settings, list[Stock]]:
    """Return the settings and the kinds of sheet.

    By default, there is an unlimited number of sheets, which are as large as the table of the machine.
    """
    options, machine = settings.of(NestOptions), load_machine(with_default_cutting_machine(settings).machine.machine)
    reach = [machine.reach(axis) for axis in (0, 1)]
    if "sheet" not in settings.given:
        if not machine.table_known:
            raise OptionError(
                "--sheet: the travel of {} is unknown, and so is the largest sheet; set a size", machine.name
            )
        sides = [SHEET_STEP * max(math.floor(side / SHEET_STEP), 1) for side in reach]
        size = "x".join(f"{side:g}" for side in sides)
        options = replace(options, sheet=(size,))
        return settings.but(options), sheets_of_given_size(options)
    stocks = [
        _read_remnant(sheet, load_cached(sheet.name), options.margin, on_progress)
        if sheet.size is None
        else Stock(*sheet.size, sheet.count, sheet.price, (), sheet.name)
        for sheet in options.sheets
    ]
    for stock in stocks if "machine" in settings.given else ():
        if message := _table_size_message(stock, machine):
            raise OptionError("--sheet: {}; use a smaller one, or another --machine", message)
    return settings, stocks


def _table_size_message(stock: Stock, machine: Machine) -> str:
    reach = [machine.reach(axis) for axis in (0, 1)]
    if all(side <= limit for side, limit in zip((stock.length, stock.width), reach, strict=True)):
        return ""
    return Message(
        "a sheet of {} exceeds the travel of {}, {:g} × {:g} mm",
        printable(stock.name),
        machine.name,
        reach[0],
        reach[1],
    )


def _table_issues(nests: Iterable[Nest], settings: Settings) -> list[Issue]:
    machine = load_machine(with_default_cutting_machine(settings).machine.machine)
    used = {nest.stock_of(layout).name: nest.stock_of(layout) for nest in nests for layout in nest.layouts}
    return [
        Issue("L435", Message("{}: check it with the machine that cuts it (--machine)", message))
        for stock in used.values()
        if (message := _table_size_message(stock, machine))
    ]


def _starts_with_file_name(error: PlanError, file: str) -> bool:
    message = error.args[0]
    return isinstance(message, Message) and message.values[:1] == (file,)


def _read_remnant(sheet: SheetWord, source: Source, margin: float, on_progress: Heartbeat) -> Stock:
    """Read a sheet from a drawing.

    The drawing must contain one closed outline, which may have holes. It may be on any layer except the layers for
    marks.
    """
    from leafcut.processes.contours import prepare_sheet

    part = read_contours(source, ReadOptions(), on_progress)
    try:
        drawn = prepare_sheet(part, SheetOptions(cut_layers=("*",), ignore_layers=MARK_NAMES), "all")
    except PlanError as error:
        raise (
            error if _starts_with_file_name(error, sheet.name) else PlanError("{}: {}", printable(sheet.name), error)
        ) from None
    outer = [c.path for c in drawn.contours if c.depth == 0]
    holes = [c.path for c in drawn.contours if c.depth == 1]
    if len(outer) != 1:
        raise PlanError(
            "{}: the drawing has {} separate outlines, but a sheet has a single outline with holes in it; use "
            "one drawing per sheet",
            printable(sheet.name),
            len(outer),
        )
    x0, y0, x1, y1 = outer[0].extents
    paths = tuple(path.moved(-x0, -y0) for path in (*outer, *holes))
    outline, *inner = (path.flattened() for path in paths)
    metal = Polygon(outline, inner)
    if max(x1 - x0, y1 - y0) > LARGEST_SHEET or not metal.is_valid or metal.buffer(-margin).is_empty:
        raise PlanError(
            "{}: {:.6g} × {:.6g} mm leaves no room for parts, with --margin {:g} mm along its edges",
            printable(sheet.name),
            x1 - x0,
            y1 - y0,
            margin,
        )
    return Stock(x1 - x0, y1 - y0, sheet.count, sheet.price, paths, Path(sheet.name).stem)


def _write_remnants(
    outcome: NestOutcome, stem: str, options: NestOptions
) -> tuple[tuple[Remnant, ...], dict[str, str]]:
    from leafcut.nesting.plan.remains import find_remnants

    best, folder = outcome.nests[0], options.remnants_out or Path()
    remnants: list[Remnant] = []
    texts: dict[str, str] = {}
    for number, layout in enumerate(best.layouts, 1):
        name = f"{stem}_{number}_rest" if len(best.layouts) > 1 else f"{stem}_rest"
        stocks = find_remnants(best, layout, outcome.spacing, REMNANT_SIZE, name)
        for stock, _ in stocks:
            file = str(folder / f"{stock.name}.dxf")
            texts[file] = remnant_as_dxf(stock)
            remnants.append(Remnant(file, layout.count, stock))
        if faults := check_remnants(best, layout, stocks, outcome.spacing):
            raise VerifyError("remnants of sheet {} were not written: {}", number, faults[0])
    return tuple(remnants), texts


def _write_sheet_drawings(variant: Nest, names: Sequence[str]) -> tuple[str, ...]:
    texts = tuple(layout_as_dxf(variant, layout) for layout in variant.layouts)
    for layout, name, text in zip(variant.layouts, names, texts, strict=True):
        _check_written_drawing(variant, layout, name, text)
    return texts


def _check_written_drawing(variant: Nest, layout: Layout, name: str, text: str) -> None:
    from leafcut.processes.contours import prepare_sheet
    from leafcut.read.dxf_contours import read_dxf_contours

    part = read_dxf_contours(Source(name, text.encode()), ReadOptions())
    faults = check_drawing(variant, layout, prepare_sheet(part, SheetOptions(open_paths="cut"), "all"))
    if faults:
        raise VerifyError("{}: was not written: {}", name, faults[0])


def parts_of_sheet(
    sheet: Sheet, quantity: int, rotations: tuple[float, ...] | None
) -> tuple[list[NestPart], list[Issue]]:
    """Return the parts of a drawing, and the issues. Each part gets the given quantity and rotations (rad).

    Raises PlanError if the drawing has no closed outline.
    """
    contours_by_part: dict[int, list[Contour]] = {}
    outlines = [c for c in sheet.contours if _is_part_outline(c)]
    for contour in (*outlines, *(c for c in sheet.contours if not _is_part_outline(c))):
        contours_by_part.setdefault(contour.part, []).append(replace(contour, depth=0, parent=-1))
    strays = [] if any(c.part == 0 for c in outlines) else contours_by_part.pop(0, [])
    if not outlines:
        raise PlanError("{}: there is no closed outline of a part; join its lines, or select its layer", sheet.name)
    several = len(contours_by_part) > 1
    parts = [
        NestPart(f"{sheet.name}-{number}" if several else sheet.name, tuple(contours), quantity, rotations)
        for number, (_, contours) in enumerate(sorted(contours_by_part.items()), 1)
    ]
    issues = []
    if several:
        message = Message("{}: {} parts in one drawing; each is nested {} times", sheet.name, len(parts), quantity)
        issues.append(Issue("L432", message, severity=Severity.NOTE))
    if strays:
        x, y = strays[0].path.start
        message = Message("{}: {} lines outside all parts were left out", sheet.name, len(strays))
        message = message if len(strays) > 1 else Message("{}: 1 line outside all parts was left out", sheet.name)
        missing = MissingWork("line", len(strays), tuple(stray.path.start for stray in strays))
        position = Message("at ({:g}, {:g})", x, y) + (" …" if len(strays) > 1 else "")
        issues.append(Issue("L431", message, position, missing=missing))
    return parts, issues


def _is_part_outline(contour: Contour) -> bool:
    return contour.path.closed and contour.kind == "cut" and contour.depth % 2 == 0
