"""The results of the library: those of the model that also describe, show and save themselves.

The model knows no report and writes no file, so the methods are in these subclasses; `api` returns them.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields
from html import escape
from pathlib import Path
from typing import Any, TypeVar

from leafcut.errors import OptionError, count_of
from leafcut.files.schemas import ANSWER, numbered
from leafcut.files.whole_files import OutputError, check_output, write_together
from leafcut.material import stock_cut
from leafcut.model import certificate, cutting_front, nest, outcome, simulation, solution
from leafcut.model.issue import Issue, Severity
from leafcut.processes import registry
from leafcut.units import format_time

#: Dangers and missing work that a notebook shows below the picture.
_MOST_ISSUES = 5
_MM3_PER_CM3 = 1000.0

#: Ending of a file's name, "" for any other → what the file holds.
_Kinds = dict[str, Callable[[], str | bytes]]
R = TypeVar("R", bound="Result")


@dataclass(frozen=True, repr=False, eq=False, kw_only=True)
class Result:
    """What all results can do.

    Attributes
    ----------
    inputs
        The files that were read; `save` never overwrites them.
    """

    inputs: tuple[str, ...] = ()

    def __repr__(self) -> str:
        line = f"{type(self).__name__}({self._line()})"
        return "".join(letter if letter.isprintable() else "?" for letter in line)

    def _repr_html_(self) -> str:
        """Return what a notebook shows: the picture as an image, which runs no script, and the line of `repr`."""
        line, svg = escape(repr(self)), self._picture()
        worst = [issue for issue in self._issues() if issue.severity in (Severity.DANGER, Severity.MISSING)]
        lines = [line, *(escape(f"{issue.severity}: {issue}") for issue in worst[:_MOST_ISSUES])]
        address = base64.b64encode(svg.encode()).decode()
        image = f'<img alt="{line}" style="max-width: 40em" src="data:image/svg+xml;base64,{address}">' if svg else ""
        return f"<figure>{image}<figcaption>{'<br>'.join(lines)}</figcaption></figure>"

    def to_dict(self) -> dict[str, Any]:
        """Return the result as plain values: the object that the command prints with ``--json``."""
        return dict(numbered(ANSWER, self._answer()))

    def save(self, path: str | Path) -> None:
        """Write the result to a file. The ending of its name selects the kind; every result has ``.json``.

        Raises
        ------
        OptionError
            The result has no file of this kind.
        OutputError
            The file cannot be written, or is one of `inputs`.
        """
        file = Path(path)
        check_output(file, self.inputs)
        try:
            contents = {name: text.encode() if isinstance(text, str) else text for name, text in self._files(file)}
        except UnicodeEncodeError as problem:
            raise OutputError(f"{file}: cannot be written (a letter that is not in {problem.encoding})") from None
        for name in contents:
            check_output(name, self.inputs)
        write_together(
            {name: data.decode("latin-1") for name, data in contents.items()}, encoding="latin-1", newline=""
        )

    def _files(self, file: Path) -> Iterable[tuple[str, str | bytes]]:
        """Yield the files that `save` writes: name and content."""
        kinds = self._kinds()
        content = kinds.get(file.suffix.lower(), kinds.get(""))
        if content is None:
            endings = " or ".join(", ".join(kinds).rsplit(", ", 1))
            raise OptionError(f"{file}: unknown kind of file; choose a name that ends in {endings}")
        yield str(file), content()

    def _kinds(self) -> _Kinds:
        """Return what `save` can write."""
        pictured: _Kinds = {".svg": self._picture} if "_picture" in vars(type(self)) else {}
        return {".json": lambda: json.dumps(self.to_dict(), indent=2, ensure_ascii=False) + "\n", **pictured}

    def _line(self) -> str:
        raise NotImplementedError

    def _answer(self) -> dict[str, Any]:
        raise NotImplementedError

    def _picture(self) -> str:
        """Return a stand-alone SVG; "" where there is nothing to see."""
        return ""

    def _issues(self) -> tuple[Issue, ...]:
        found: tuple[Issue, ...] = getattr(self, "issues", ())
        return found


def of_model(kind: type[R], found: Any, inputs: Iterable[object]) -> R:
    """Return a result of the model as one of the library; `inputs` are the files that were read, or None."""
    values = {field.name: getattr(found, field.name) for field in fields(found)}
    return kind(**values, inputs=tuple(dict.fromkeys(str(one) for one in inputs if one is not None)))


@dataclass(frozen=True, repr=False, eq=False)
class ProgramResult(Result, outcome.Outcome[Any]):
    """A program, and the work as it was before and is now. `save` writes the program, ``.html`` or ``.svg``."""

    def _line(self) -> str:
        times = (
            f"{format_time(self.before.time_s)} → {format_time(self.after.time_s)}, {self.saved_percent:.1f} % saved"
        )
        missing = f", {count_of(len(self.missing), 'issue')} of missing work" if self.missing else ""
        return f"{self.part.name}: {times}, {'' if self.verified else 'not '}verified{missing}"

    def _answer(self) -> dict[str, Any]:
        from leafcut.report.json_answer import as_json

        return as_json(registry.report_of(self))

    def _picture(self) -> str:
        from leafcut.report.page import path_svg

        return path_svg(registry.report_of(self), "after")

    def _kinds(self) -> _Kinds:
        from leafcut.report.page import write_page

        program: _Kinds = {
            "": lambda: self.text.encode(self.encoding),
            ".html": lambda: write_page(registry.report_of(self)),
        }
        return super()._kinds() | program


@dataclass(frozen=True, repr=False, eq=False)
class NestResult(Result, nest.NestOutcome):
    """Parts on sheets. `save` writes the best nest as ``.dxf``, several sheets numbered, or ``.svg``."""

    def _line(self) -> str:
        best = self.nests[0]
        used = f"{100.0 * best.utilisation_of_used:.1f} % used"
        return f"{count_of(best.n_placed, 'part')} on {count_of(best.n_sheets, 'sheet')}, {used}, by {best.method}"

    def _answer(self) -> dict[str, Any]:
        answer: dict[str, Any] = registry.command("nest_answer")(self)
        return answer

    def _picture(self) -> str:
        from leafcut.report.pictures import nest_picture

        return nest_picture(self)

    def _kinds(self) -> _Kinds:
        return {".dxf": lambda: "", **super()._kinds()}

    def _files(self, file: Path) -> Iterable[tuple[str, str | bytes]]:
        if file.suffix.lower() != ".dxf":
            return super()._files(file)
        return zip(self.names(file, all_variants=False)[0], self.drawings[0], strict=True)


@dataclass(frozen=True, repr=False, eq=False)
class SimulationResult(Result, simulation.Simulation):
    """What a program does on a machine. `save` writes ``.json``, or its path as ``.svg``."""

    def _line(self) -> str:
        dangers = sum(issue.severity is Severity.DANGER for issue in self.issues)
        time = f"{format_time(self.measure.time_s)} on {self.machine.name}"
        return f"{self.program}: {time}, {count_of(dangers, 'danger')}"

    def _answer(self) -> dict[str, Any]:
        from leafcut.report.json_answer import simulation_as_json

        return simulation_as_json(self)

    def _picture(self) -> str:
        from leafcut.report.pictures import simulation_picture

        return simulation_picture(self)


@dataclass(frozen=True, repr=False, eq=False)
class VerificationResult(Result, certificate.Certificate):
    """Whether two programs do the same work. `save` writes ``.json``; there is no picture."""

    def _line(self) -> str:
        if not self.same:
            return f"{count_of(len(self.differences), 'difference')}; {self.differences[0]}"
        return f"same work: {count_of(self.after.holes, 'hole')}, {count_of(self.after.cuts, 'cut')}"

    def _answer(self) -> dict[str, Any]:
        from leafcut.report.json_answer import verification_as_json

        return verification_as_json(self)


@dataclass(frozen=True, repr=False, eq=False)
class StockResult(Result, stock_cut.StockCut):
    """What a program leaves of its stock. `save` writes ``.png``, ``.stl`` or ``.svg``."""

    def _line(self) -> str:
        dangers = len(self.rapids) + len(self.collisions)
        removed = f"{self.removed_mm3 / _MM3_PER_CM3:.2f} cm³ by {count_of(len(self.tools), 'tool')}"
        return f"{self.program}: {removed}, {count_of(dangers, 'collision')}"

    def _answer(self) -> dict[str, Any]:
        from leafcut.report.stock_report import stock_as_json

        return stock_as_json(self)

    def _picture(self) -> str:
        from leafcut.report.pictures import stock_picture

        return stock_picture(self)

    def _kinds(self) -> _Kinds:
        from leafcut.report.stock_report import as_file

        return super()._kinds() | {".png": lambda: as_file(self, ".png"), ".stl": lambda: as_file(self, ".stl")}


@dataclass(frozen=True, repr=False, eq=False)
class TourResult(Result, solution.Solved):
    """A map and a tour. `save` writes ``.tour`` (TSPLIB), the points of the map as ``.csv``, or ``.svg``."""

    def _line(self) -> str:
        gap = "" if self.gap is None else f", gap {100.0 * self.gap:.2f} %"
        points = count_of(len(self.part.holes), "point")
        return f"{self.part.name}: {points}, length {self.solution.cost:,.6g}{gap}, {self.solution.algorithm}"

    def _answer(self) -> dict[str, Any]:
        from leafcut.report.json_answer import solved_as_json

        return solved_as_json(self)

    def _picture(self) -> str:
        from leafcut.report.pictures import tour_picture

        return tour_picture(self)

    def _issues(self) -> tuple[Issue, ...]:
        return self.part.issues

    def _kinds(self) -> _Kinds:
        from leafcut.read.csvmap import points_text
        from leafcut.read.tsplib import tour_text

        part, nodes = self.part, self.solution.nodes
        tour = {".tour": lambda: tour_text(part.name, nodes, every=part.grouping is None)}
        return super()._kinds() | tour | {".csv": lambda: points_text(part)}


@dataclass(frozen=True, repr=False, eq=False)
class ToolSpeedsResult(Result, cutting_front.CuttingData):
    """Speeds and feeds of tools. `save` writes ``.json`` or the fronts as ``.svg``."""

    def _line(self) -> str:
        chosen = f"{count_of(len(self.tools), 'tool')} for {self.material.name}, chosen by {self.objective}"
        return f"{self.source or 'no drawing'}: {chosen}, {format_time(self.time)}, cost {self.cost:.2f}"

    def _answer(self) -> dict[str, Any]:
        from leafcut.report.cutting_data_report import cutting_data_as_json

        return cutting_data_as_json(self)

    def _picture(self) -> str:
        from leafcut.report.front_chart import front_svg

        return front_svg(self)
