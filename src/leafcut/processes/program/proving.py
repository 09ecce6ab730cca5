"""The new text of a program, and its proof: what cannot be written or proved in a new order keeps its own."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from leafcut._version import __version__
from leafcut.errors import PostError, ReadError, VerifyError
from leafcut.files.digests import DIGEST_LINE, signed
from leafcut.model.issue import Issue
from leafcut.model.obstacles import Obstacles
from leafcut.model.sequence import Section, Sequence
from leafcut.processes.job import Job
from leafcut.processes.keep_out import meetings, reach_of
from leafcut.processes.program.options import ResequenceOptions

if TYPE_CHECKING:
    from leafcut.gcode.dialects import Dialect
    from leafcut.gcode.program import Program
    from leafcut.model.certificate import Certificate
    from leafcut.processes.program.proof.stock_judge import StockJudge

#: The order of the pieces of every section, int32[n], ~k for piece k from its other end; None: as it is.
SectionOrders = list[NDArray[np.int32] | None]

#: A piece of work: the numbers of its section and of the piece in that section.
PieceNumber = tuple[int, int]

#: After so many trials all pieces keep their order: each trial takes as long as a proof.
_MOST_TRIALS = 6


@dataclass(frozen=True, eq=False)
class Proved:
    """A program that does the same work.

    Attributes
    ----------
    text, program
        As it is written, and as it runs.
    certificate
        The proof.
    orders
        The orders in which the sections are written.
    kept
        Pieces that keep their place although another order was asked for, and the reason.
    issues
        One for each reason.
    """

    text: str
    program: Program
    certificate: Certificate
    orders: SectionOrders = field(default_factory=list)
    kept: dict[PieceNumber, str] = field(default_factory=dict)
    issues: tuple[Issue, ...] = ()


def write_proved(
    run: Job,
    words: Dialect,
    original: Program,
    sequence: Sequence,
    orders: SectionOrders,
    source: str,
    obstacles: Obstacles | None = None,
    judge: StockJudge | None = None,
) -> Proved:
    """Return the program with its sections in their orders, and the proof that it does the same work.

    If the new order cannot be written or proved, the pieces that the proof names keep their place, and no other piece
    passes them. If that does not help, their sections keep their order, then all sections, and at last the program
    stays as it is. No rapid of the result meets one of the `obstacles`; a `judge` compares what it leaves of the stock.

    Raises
    ------
    PostError, VerifyError
        Not even the program as it is can be written so, or proved to be safe.
    """
    writer = _OrderWriter(run, words, original, sequence, source, obstacles, judge)
    everything = {
        (number, piece)
        for number, (section, order) in enumerate(zip(sequence.sections, orders, strict=True))
        if order is not None
        for piece in range(len(section.pieces))
    }
    kept: dict[PieceNumber, str] = {}
    trials = 0
    while obstacles is not None or not run.settings.job.keep_order:
        trials += 1
        staying: dict[int, set[int]] = {}
        for number, piece in kept:
            staying.setdefault(number, set()).add(piece)
        written = [_with_pieces_kept(order, staying.get(k, set())) for k, order in enumerate(orders)]
        try:
            found = writer.proved(writer.in_order(written))
        except _Refused as refused:
            free = everything - kept.keys()
            guilty: set[PieceNumber] = set()
            if trials < _MOST_TRIALS:
                guilty = refused.pieces & free or {one for one in free if one[0] in refused.sections}
            kept |= dict.fromkeys(guilty or free, str(refused))
            if not free:
                break
        else:
            return replace(found, orders=written, kept=kept, issues=tuple(writer.issues(kept)))
    try:
        found = writer.proved("".join(original.lines))
    except _Refused as refused:
        raise VerifyError(f"the program was not written: {refused}") from None
    return replace(found, orders=[None for _ in orders], kept=kept, issues=tuple(writer.issues(kept)))


def _with_pieces_kept(order: NDArray[np.int32] | None, kept: set[int]) -> NDArray[np.int32] | None:
    """Return the order with some pieces in their own place; the pieces before and behind them stay there.

    It breaks no precedence that the order and the original obey.
    """
    if order is None or not kept:
        return order
    if len(kept) == len(order):
        return None
    fixed = np.array(sorted(kept), dtype=np.int32)
    piece = np.where(order < 0, ~order, order)
    staying = np.isin(piece, fixed)
    # Runs of pieces between those that stay have even numbers, those that stay the odd numbers between.
    run = 2 * np.searchsorted(fixed, piece) + staying
    new: NDArray[np.int32] = np.where(staying, piece, order)[np.argsort(run, kind="stable")].astype(np.int32)
    return new


class _Refused(Exception):
    """An order that cannot be used, with the pieces and sections at fault, as far as they are known."""

    def __init__(self, reason: str, sections: set[int], pieces: Iterable[PieceNumber] = ()) -> None:
        self.sections, self.pieces = sections, set(pieces)
        super().__init__(reason)


class _OrderWriter:
    def __init__(
        self,
        run: Job,
        words: Dialect,
        original: Program,
        sequence: Sequence,
        source: str,
        obstacles: Obstacles | None,
        judge: StockJudge | None,
    ) -> None:
        self.run, self.words, self.original = run, words, original
        self.sequence, self.source, self.obstacles, self.judge = sequence, source, obstacles, judge

    def in_order(self, orders: SectionOrders) -> str:
        """Return the text with the sections in their orders."""
        from leafcut.processes.program.post.rewriter import rewrite

        sections = self.sequence.sections
        given = zip(sections, orders, strict=True)
        own = [np.arange(len(s.pieces), dtype=np.int32) if order is None else order for s, order in given]
        try:
            return rewrite(
                self.original,
                self.sequence,
                own,
                renumber=self.run.settings.post.line_numbers,
                longest=self.words.max_line,
                look=self.run.looking("writing"),
                obstacles=self.obstacles,
            )
        except PostError as problem:
            if problem.section is None:
                raise
            raise _Refused(str(problem), {problem.section}) from None

    def proved(self, text: str) -> Proved:
        """Return the program with its proof, which stands at its top, too."""
        from leafcut.processes.program.proof.certificate import certify, proof_lines
        from leafcut.processes.program.reading import read_new

        settings = self.run.settings
        look = self.run.looking("verifying")
        try:
            new = read_new(self.run, self.words, text)
        except ReadError as problem:
            raise _Refused(str(problem), set()) from None
        either_way = settings.of(ResequenceOptions).allow_reverse
        beyond = None if self.obstacles is None else reach_of(self.obstacles)
        certificate = certify(
            self.original, new, machine=self.run.machine, allow_reverse=either_way, beyond=beyond, look=look
        )
        if not certificate.same:
            more = len(certificate.differences) - 1
            said = f"{certificate.differences[0]}{f' (and {more} more)' if more > 0 else ''}"
            lines = {line for d in certificate.differences for line, _ in ((d.original, d.new), *d.also) if line}
            sections = {self._section_at(line) for line in lines} - {-1}
            raise _Refused(said, sections, self._pieces_at(lines))
        if self.obstacles is not None and (met := meetings(self.run, self.obstacles, new.path)):
            raise _Refused(f"{met[0]}{f' (and {len(met) - 1} more)' if len(met) > 1 else ''}", set())
        if self.judge is not None and text != "".join(self.original.lines):
            try:
                self.judge.check(new, look)
            except VerifyError as problem:
                raise _Refused(str(problem), set()) from None
        if settings.post.header and text != "".join(self.original.lines):
            comments = [*proof_lines(certificate, __version__, Path(self.source).name), DIGEST_LINE]
            text = signed(with_comments(text, comments, self.words))
            new = read_new(self.run, self.words, text)
        return Proved(text, new, certificate)

    def issues(self, kept: dict[PieceNumber, str]) -> Iterator[Issue]:
        """Yield why pieces keep their place although another order was asked for, each reason once."""
        by_reason: dict[str, list[PieceNumber]] = {}
        for place, reason in sorted(kept.items()):
            by_reason.setdefault(reason, []).append(place)
        for reason, places in by_reason.items():
            number, piece = places[0]
            line = self.sequence.sections[number].pieces[piece].line
            said = f"the piece of work keeps its place, because another order failed: {reason}"
            if len(places) > 1:
                said = f"{len(places):,} pieces of work keep their place, because another order failed: {reason}"
            yield Issue("L505", said, f"line {line}")

    def _pieces_at(self, lines: set[int]) -> set[PieceNumber]:
        """Return the pieces with a block on one of these lines of the original."""
        text_line = self.original.text_line
        named = np.isin(text_line, list(lines))
        return {
            (number, piece)
            for number, section in enumerate(self.sequence.sections)
            for piece, work in enumerate(section.pieces)
            if named[work.begin : work.end].any()
        }

    def _section_at(self, line: int) -> int:
        """Return the section that has a line of the original, or the last one before it; -1 where there is none."""
        last = -1
        for number, section in enumerate(self.sequence.sections):
            begin, end = self._lines_of(section)
            if begin <= line:
                last = number
            if begin <= line <= end:
                break
        return last

    def _lines_of(self, section: Section) -> tuple[int, int]:
        line, pieces = self.original.text_line, section.pieces
        return int(line[pieces[0].begin]), int(line[pieces[-1].end - 1])


def with_comments(text: str, comments: Iterable[str], words: Dialect) -> str:
    """Return a program with comments near its top: below the percent sign and the program's number.

    They get the line ends of the program.
    """
    from leafcut.post.comments import comment_lines

    lines = text.splitlines(keepends=True)
    end = "\r\n" if lines and lines[0].endswith("\r\n") else "\n"
    at = 0
    while at < len(lines) and (not lines[at].strip() or lines[at].lstrip()[:1] in "%Oo:"):
        at += 1
    said = [part + end for c in comments for part in comment_lines(c, words.max_line, words.uppercase_comments)]
    return "".join([*lines[:at], *said, *lines[at:]])
