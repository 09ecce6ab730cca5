"""The right side: what came of a run, in figures, messages, the program, and files to take."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from leafcut.report.wording import clock
from leafcut.studio.canvas import Bars, Convergence, ProgramText
from leafcut.studio.elements import box, button, link, table, text
from leafcut.studio.history import JobRecord
from leafcut.studio.page_state import View
from leafcut.studio.panel_edit import can_be_edited
from leafcut.studio.panel_nest import NestPanel
from leafcut.units import format_length, format_time

if TYPE_CHECKING:
    from leafcut.studio.page_parts import PageParts

_TABS = ("summary", "issues", "program", "search")
_NUMBER = "n"
#: So much of a program is shown here; all of it is in the file.
_MOST_LINES, _MOST_ISSUES, _MOST_WORKERS = 2000, 200, 64
#: So many warnings stand before the figures.
_MOST_WARNINGS = 2
#: So many reasons why pieces of a program stay.
_MOST_REASONS = 20
#: Files in the order in which they are offered.
_FILES = ("program", "tour", "report", "plan", "order", "given", "list", "picture-before", "picture-after")


class ResultPanel:
    """Shows the outcome of the job that the page is at."""

    def __init__(self, view: View, page: PageParts) -> None:
        self.view, self.page = view, page
        self.tab = "summary"
        self.nest = NestPanel(view, page)
        self.place = box("div", "result")
        self.draw()

    def choose(self, tab: str) -> None:
        """Show one of the tabs."""
        self.tab = tab
        self.draw()

    def draw(self) -> None:
        """Show the outcome, or why there is none."""
        view = self.view
        record = view.studio.jobs.record(view.job) if view.job else None
        self.nest.leave()
        self.place.clear()
        with self.place:
            # A run is over on the page when the middle knows it, which then draws all anew: what a person did to an
            # outcome that stood here earlier would be undone by that.
            if record is None or not record.state.kept or self.page.run.watching:
                self._nothing(record)
                return
            answer = view.studio.history.answer(record.id) or {}
            self._tabs(answer)
            with box(
                "div", "scrolls", role="tabpanel", id="result-panel", tabindex="0", aria_labelledby=f"tab-{self.tab}"
            ):
                getattr(self, f"_{self.tab}")(record, answer)
            self._files(record)

    def tick(self) -> None:
        """Look how what is shown here goes on."""
        self.nest.tick()

    def _nothing(self, record: JobRecord | None) -> None:
        """Show what a run has said so far, or why there is no outcome."""
        w = self.view.words
        live = None if record is None else self.view.studio.jobs.live(record.id)
        with box("div", "scrolls"):
            text("h2", w("right.title"))
            if live is None or live.state.over:
                over = w("result.none") if record is None else w(f"state.{record.state.value}")
                line = record.line if record is not None and record.line else over
                text("p", w.plain(line), "error" if record is not None and record.line else "quiet")
            if record is not None:
                self._messages(record.id)

    def _messages(self, job: str) -> None:
        w = self.view.words
        messages = self.view.studio.jobs.messages(job)
        text("h3", w("result.messages"))
        if messages:
            table([("s", _NUMBER), ("", "")], [[f"{seconds:.2f}", line] for seconds, line in messages], "")
        else:
            text("p", w("result.no_messages"), "quiet")

    def _tabs(self, answer: dict[str, Any]) -> None:
        w = self.view.words
        with box("div", "tabs", role="tablist", aria_label=w("right.title")):
            for tab in _TABS:
                number = len(_issues(answer)) if tab == "issues" else 0
                words = w(f"result.{tab}") + (f" {number}" if number else "")
                classes = "tab warned" if tab == "issues" and _warnings(answer) else "tab"
                chosen = "true" if tab == self.tab else "false"
                button(
                    words, lambda tab=tab: self.choose(tab), classes,
                    role="tab", id=f"tab-{tab}", aria_selected=chosen, aria_controls="result-panel",
                )  # fmt: skip

    def _summary(self, record: JobRecord, answer: dict[str, Any]) -> None:
        command = record.task.command
        self._warned(answer)
        if command == "nest":
            self.nest.draw(record, answer)
        elif command == "optimize":
            self._from_nest(record)
            self._saved(answer)
        elif command == "solve":
            self._tour(answer)
        elif command == "verify":
            self._verified(answer)
        else:
            self._times(answer)

    def _from_nest(self, record: JobRecord) -> None:
        """Lead back to the nest that a sheet is of."""
        job, _, place = record.task.origin.partition("/")
        if job and self.view.studio.jobs.record(job) is not None:
            variant, number = (int(word) for word in place.split("/"))
            words = self.view.words("nest.back", variant=variant, number=number)
            button(f"‹ {words}", lambda: self.page.open_job(job, (variant, number)), "plain small back")

    def _warned(self, answer: dict[str, Any]) -> None:
        """Show first what a person must know before the program runs; all else stands among the issues."""
        found = _warnings(answer)
        if not found:
            return
        with box("ul", "warnings"):
            for issue in found[:_MOST_WARNINGS]:
                with box("li"):
                    meant = self.view.words.issue(issue["code"])
                    if meant:
                        text("b", f"{meant}: ")
                    text("span", self.view.words.plain(issue["message"]), "", dir="auto", lang="en")
            if len(found) > _MOST_WARNINGS:
                text("li", self.view.words("open.more", number=len(found) - _MOST_WARNINGS))

    def _saved(self, answer: dict[str, Any]) -> None:
        w = self.view.words
        before, after = answer["before"], answer["after"]
        seconds = (before["time_s"] or 0.0) - (after["time_s"] or 0.0)
        text("p", format_time(abs(seconds)), "headline" if seconds >= 0 else "headline worse")
        percent = f"{abs(answer['saved_percent'] or 0.0):.1f}"
        text("p", w("result.less" if seconds >= 0 else "result.longer", percent=percent), "under")
        if answer["gap_percent"] is not None:
            text("p", w("result.gap", percent=f"{answer['gap_percent']:.2f}"), "quiet")
        self._badge(answer["verified"], answer.get("certificate"))
        rows = [
            [w(f"result.{name}"), _seconds(m["time_s"]), _metres(m["travel_mm"]), _metres(m["cut_mm"])]
            for name in ("before", "nearest", "after")
            if (m := answer[name]) is not None
        ]
        way = "between" if "cutting" in answer else "travel"
        heads = [("", ""), *((w(f"result.{name}"), _NUMBER) for name in ("time", way, "cutting"))]
        table(heads, rows, w("result.times"))
        self._staying(answer)
        self._tools(answer)
        if "strategies" in answer:
            self._strategies(answer)
        with box("dl", "facts"):
            # A pocket has no algorithm but that of its strategy, and a program with one way alone has none.
            searched = ("algorithm", "seed") if answer["algorithm"] and "strategies" not in answer else ()
            for key in ("machine", "dialect", *searched):
                text("dt", w(f"result.{key}"))
                text("dd", str(answer[key]))
            text("dt", w("result.computing"))
            text("dd", format_time(answer["seconds"] or 0.0))

    def _badge(self, good: bool, certificate: dict[str, Any] | None) -> None:
        w = self.view.words
        text("p", w("result.verified" if good else "result.unverified"), "badge" if good else "badge no")
        if certificate:
            counted = ", ".join(
                w(f"result.{what}", number=f"{number:,}") for what, number in certificate["before"].items() if number
            )
            text("p", w("result.certificate", counted=counted), "quiet small")

    def _staying(self, answer: dict[str, Any]) -> None:
        """Say why pieces of a program keep their place."""
        w, groups = self.view.words, answer.get("staying", [])
        if not groups:
            return
        stay = sum(group["count"] for group in groups)
        text("p", w("result.stay", number=f"{stay:,}", pieces=f"{answer['counts']['pieces']:,}"), "quiet small")
        with box("ul", "plain-list"):
            for group in groups[:_MOST_REASONS]:
                why = " · ".join(w(f"stays.{name}") for name in group["reason"].split("+"))
                where = w("stays.line", line=group["first_line"])
                text("li", f"{group['count']:,} × {why} ({where}{': ' if group['word'] else ''}{group['word']})")

    def _tools(self, answer: dict[str, Any]) -> None:
        w = self.view.words
        rows = [
            [
                f"T{tool['number']}" if tool["number"] else "–",
                tool["name"] or tool["kind"],
                "–" if not tool["diameter_mm"] else f"{tool['diameter_mm']:.4g}",
                tool["cycle"] or "–",
                f"{tool.get('holes', tool.get('slots', 0)) or tool.get('cuts', 0):,}",
            ]
            for tool in answer["tools"][:100]
        ]
        if rows:
            keys = (("tool", ""), ("kind", ""), ("diameter", _NUMBER), ("cycle", ""), ("number", _NUMBER))
            table([(w(f"result.{key}"), classes) for key, classes in keys], rows, w("result.tools"))

    def _strategies(self, answer: dict[str, Any]) -> None:
        """Show what every strategy makes of one level of the pockets; the one that is written is marked."""
        w = self.view.words
        rows = [
            [
                f"{row['strategy']}\u00a0✓" if row["chosen"] else row["strategy"],
                *(
                    ("–", "–", "–", "–")
                    if "refused" in row
                    else (
                        _metres(row["feed_mm"] + row["rapid_mm"]),
                        f"{row['retracts']:,}",
                        f"{row['uncovered_percent']:.2f}",
                        clock(row["time_s"]),
                    )
                ),
            ]
            for row in answer["strategies"]
        ]
        heads = [(w("result.strategy"), ""), *((w(f"result.{k}"), _NUMBER) for k in ("way", "lifts", "uncut", "time"))]
        table(heads, rows, w("result.strategies"))
        for row in answer["strategies"]:
            if "refused" in row:
                text("p", f"{row['strategy']}: {w.plain(row['refused'])}", "quiet small", lang="en")

    def _tour(self, answer: dict[str, Any]) -> None:
        w = self.view.words
        text("p", f"{answer['length']:,.10g}", "headline")
        text("p", w("result.length", number=f"{answer['n']:,}"), "under")
        if answer["gap_percent"] is not None:
            known = "result.gap_optimum" if answer["optimum"] else "result.gap"
            text("p", w(known, percent=f"{answer['gap_percent']:.3f}"), "quiet")
        with box("dl", "facts"):
            for key in ("algorithm", "seed", "iterations", "lower_bound", "optimum"):
                if answer[key] is not None:
                    text("dt", w(f"result.{key}"))
                    text("dd", f"{answer[key]:,.10g}" if isinstance(answer[key], int | float) else str(answer[key]))
            text("dt", w("result.computing"))
            text("dd", format_time(answer["seconds"]))

    def _verified(self, answer: dict[str, Any]) -> None:
        w = self.view.words
        text("p", w("result.same" if answer["same"] else "result.differs"), "badge" if answer["same"] else "badge no")
        if answer["differences"]:
            with box("ul", "plain-list"):
                for row in answer["differences"][:_MOST_ISSUES]:
                    text("li", w.plain(row["words"]))

    def _times(self, answer: dict[str, Any]) -> None:
        w = self.view.words
        text("p", format_time(answer["time_s"]), "headline")
        text("p", w("result.on", machine=answer["machine"]), "under")
        rows = [
            [w("result.rapid"), format_length(answer["rapid_mm"])],
            [w("result.feed"), format_length(answer["feed_mm"])],
        ]
        table([("", ""), (w("result.length_of"), _NUMBER)], rows, w("result.times"))
        kinds = [[w(f"kind.{kind}"), format_time(s)] for kind, s in answer["by_kind"].items() if s > 0]
        table([("", ""), (w("result.time"), _NUMBER)], kinds, w("result.times"))
        limits = [[axis.upper(), f"{low:.3f}", f"{high:.3f}"] for axis, (low, high) in answer["extents"].items()]
        table([("mm", ""), (w("result.from"), _NUMBER), (w("result.to"), _NUMBER)], limits, w("result.extents"))

    def _issues(self, record: JobRecord, answer: dict[str, Any]) -> None:
        w = self.view.words
        found = _issues(answer)
        if not found:
            text("p", w("result.no_issues"), "quiet")
        with box("ul", "issue-list"):
            for issue in found[:_MOST_ISSUES]:
                with box("li", issue["severity"]):
                    text("code", issue["code"])
                    meant = w.issue(issue["code"])
                    if meant:
                        text("b", f"{meant}.")
                    text("span", w.plain(issue["message"]), "meant" if meant else "", dir="auto", lang="en")
                    if issue["place"]:
                        text("span", issue["place"], "quiet small")
            if len(found) > _MOST_ISSUES:
                text("li", w("open.more", number=len(found) - _MOST_ISSUES))

    def _program(self, record: JobRecord, answer: dict[str, Any]) -> None:
        w = self.view.words
        if record.task.command == "optimize":
            ProgramText(self.page.run.canvas, words=w.section("canvas")).classes("code")
            return
        made = self.view.studio.history.artefact(record.id, "tour")
        if made is None:
            text("p", w("result.no_program"), "quiet")
            return
        lines = made.text.split("\n")
        text("pre", "\n".join(lines[:_MOST_LINES]), "listing", tabindex="0", aria_label=made.file_name)
        if len(lines) > _MOST_LINES:
            text("p", w("open.more", number=len(lines) - _MOST_LINES), "quiet")

    def _search(self, record: JobRecord, answer: dict[str, Any]) -> None:
        w = self.view.words
        kept = self.view.studio.history.artefact(record.id, "search")
        for search in json.loads(kept.data) if kept is not None else []:
            text("h3", search["name"])
            chart = Convergence(words=w.section("canvas"))
            chart.classes("chart tall")
            chart.set(search["history"], search["bound"], search["unit"])
        self._workers(answer)
        self._messages(record.id)

    def _workers(self, answer: dict[str, Any]) -> None:
        w = self.view.words
        workers = [row for row in answer.get("workers", []) if row["ants"]][:_MOST_WORKERS]
        if not workers:
            return
        best = min(row["best"] for row in workers)
        text("h3", w("result.workers"))
        Bars().set(
            [
                {
                    "name": f"{w('canvas.worker')} {row['worker']}",
                    "value": row["seconds"],
                    "note": w("result.ants", number=f"{row['ants']:,}", seconds=f"{row['seconds']:.2f}"),
                    "best": row["best"] <= best,
                }
                for row in workers
            ]
        )

    def _files(self, record: JobRecord) -> None:
        w = self.view.words
        files = self.view.studio.history.artefacts(record.id)
        with box("footer", "foot files"):
            for name in _FILES:
                if name not in files:
                    continue
                address = f"/api/jobs/{record.id}/files/{name}"
                words = w(f"file.{name}")
                classes = "button primary" if name in ("program", "tour") else "button"
                link(words, address, classes, download=files[name], title=files[name])
            link(
                "JSON", f"/api/jobs/{record.id}/answer", "button", download=f"{record.id}.json", title=w("file.answer")
            )
            if can_be_edited(self.view.studio.history, record, files):
                button(w("edit.begin"), lambda: self.page.run.edit.begin(record), "")
            elif any(record.task.options.get(name) for name in ("chains", "common_lines")):
                text("p", w("edit.not_joined"), "quiet small")
            if "report" in files:
                link(
                    w("file.show"), f"/api/jobs/{record.id}/files/report?show=true", "quiet small",
                    target="_blank", rel="noopener",
                )  # fmt: skip


def _issues(answer: dict[str, Any]) -> list[dict[str, str]]:
    """Return the issues of an answer; those of a simulation are plain lines."""
    return [
        issue if isinstance(issue, dict) else {"code": "", "severity": "warning", "message": str(issue), "place": ""}
        for issue in answer.get("issues", [])
    ]


def _warnings(answer: dict[str, Any]) -> list[dict[str, str]]:
    """Return the issues that are more than a note."""
    return [issue for issue in _issues(answer) if issue["severity"] != "note"]


def _seconds(value: float | None) -> str:
    return "–" if value is None else format_time(value)


def _metres(value: float | None) -> str:
    return "–" if value is None else format_length(value)
