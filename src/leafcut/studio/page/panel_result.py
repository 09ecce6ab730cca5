"""The right column of the page, which shows the result of a run as figures, messages, program and files."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from leafcut.message import messages_from_json
from leafcut.model.issue import LIMITS
from leafcut.model.kinds import Head
from leafcut.model.study import Iteration
from leafcut.report.chart import names_of_time_kinds
from leafcut.report.wording import replace_unprintable
from leafcut.studio.jobs.history import JobRecord
from leafcut.studio.jobs.jobs import LiveJob
from leafcut.studio.jobs.search_watch import evenly_spaced_rows
from leafcut.studio.page import headline
from leafcut.studio.page.charts import Chart, SwitchedChart, bar_chart, convergence_chart, learning_chart
from leafcut.studio.page.elements import box, button, link, table, text
from leafcut.studio.page.page_state import View
from leafcut.studio.page.panel_edit import can_be_edited
from leafcut.studio.page.panel_figures import draw_figures, draw_times
from leafcut.studio.page.panel_nest import NestPanel
from leafcut.studio.page.panel_program import is_program, show_created_program, show_opened_program
from leafcut.studio.page.panel_strategies import StrategiesPanel
from leafcut.studio.page.stale_mark import StaleMark
from leafcut.studio.wording import Words
from leafcut.units import format_length, format_time, to_fixed

if TYPE_CHECKING:
    from nicegui.element import Element
    from nicegui.elements.mixins.text_element import TextElement

    from leafcut.studio.jobs.preview import Preview
    from leafcut.studio.page.pages import Page

_TABS = ("summary", "issues", "program", "search")
_NUMBER = "n"
#: Search times below this value are not shown, s.
_SHOWN_SEARCH = 0.01
#: Commands that may try several methods one after the other.
_TRYING = ("nest", "optimize")
_MAX_ISSUES = 200
#: Maximum number of warnings above the figures.
_MAX_WARNINGS = 2
#: Maximum number of reasons that are listed for the fixed tasks of a program.
_MAX_REASONS = 20
#: Files that have their own button, and files in the menu, in the order in which they are shown.
_MAIN_FILES = ("program", "tour", "report")
_MORE_FILES = ("plan", "norms", "order", "given", "list", "picture-before", "picture-after")
#: Severities in the order in which their issues are listed, and number of issues that are shown before the rest is
#: folded.
_SEVERITIES = ("danger", "missing", "warning", "note")
_UNFOLDED = 3

_MAX_POINTS, _MAX_WORKERS = 600, 64


class ResultPanel:
    """The column that shows the result of the open job."""

    def __init__(self, view: View, page: Page) -> None:
        self.view, self.page = view, page
        self.tab = "summary"
        #: Preview of the opened program, if its text is visible.
        self._opened: Preview | None = None
        #: Identity of the visible program, if there is one.
        self._reading: tuple[object, str] | None = None
        #: Whether the column shows the result of a job. If not, it shows the opened input.
        self._shows_outcome = False
        self.nest = NestPanel(view, page)
        self.mark = StaleMark(view, page)
        self.strategies = StrategiesPanel(view, page)
        self.tried: TriedPanel | None = None
        self.place = box("div", "result")
        self.draw()

    def choose_tab(self, tab: str) -> None:
        """Show one of the tabs."""
        self.tab = tab
        self.draw()
        self.page.store_changed_choices()

    def preselect_tab(self, tab: str) -> None:
        """Select the tab for the next result."""
        self.tab = tab if tab in _TABS else "summary"

    def kept(self) -> tuple[str, Preview | None]:
        """Return the selected tab and the preview of the opened program, for use by `show_again`."""
        return self.tab, self._opened

    def show_again(self, kept: tuple[str, Preview | None]) -> None:
        """Show the result that `kept` has returned, because another input could not be opened."""
        self.tab, self._opened = kept
        self.draw()

    def show_new_result(self, record: JobRecord) -> None:
        """Show a new result in the first tab. Announce it to screen readers without moving the focus."""
        self.tab = "summary"
        self.draw()
        answer = self.view.studio.history.answer(record.id)
        if answer is not None:
            self.page.announce(headline.announcement(record, answer, self.view.words))
        self.page.store_changed_choices()

    def draw(self) -> None:
        """Show the result of the job, or explain why it has no result."""
        view = self.view
        record = view.studio.jobs.record(view.job) if view.job else None
        # At the end of a run, the middle column redraws everything. Drawing the result earlier would undo the user's
        # changes to a previous result.
        over = record is not None and record.state.has_result and not self.page.run.watching
        if not over and is_program(view) and self._opened is not view.seen:
            self._opened, self.tab = view.seen, "program"
        reading = (view.seen, record.id if over and record is not None else "") if self.tab == "program" else None
        if reading is not None and reading == self._reading:
            return  # keep the reader's position in the program
        self._reading = reading
        self._shows_outcome = over and reading is None
        self.nest.leave()
        self.mark.leave()
        self.strategies.leave()
        self.tried = None
        self.place.clear()
        with self.place:
            if record is None or not over:
                self._draw_without_result(record)
                return
            answer = view.studio.history.answer(record.id) or {}
            self._draw_tabs(_TABS, answer)
            self.mark.draw(record)
            with self._tab_panel():
                getattr(self, f"_draw_{self.tab}")(record, answer)
            self._draw_downloads(record)
        self.mark.refresh()

    def show_input(self) -> None:
        """Show a new input, unless the column shows the result of a job."""
        if self._shows_outcome:
            self.mark.refresh()
        else:
            self.draw()

    def tick(self) -> None:
        """Update the totals of a nest and the trials of a running job."""
        self.nest.tick()
        if self.tried is not None:
            self.tried.tick()

    def _tab_panel(self) -> Element:
        return box(
            "div", "scrolls", role="tabpanel", id="result-panel", tabindex="0", aria_labelledby=f"tab-{self.tab}"
        )

    def _draw_without_result(self, record: JobRecord | None) -> None:
        view = self.view
        if not is_program(view):
            messages = view.words("result.messages")
            with box("div", "scrolls", tabindex="0", role="region", aria_label=messages):
                text("h2", view.words("right.title"))
                self._draw_state_of_job(record)
            return
        self._draw_tabs(("summary", "program"), {})
        with self._tab_panel():
            if self.tab == "program":
                show_opened_program(view, self.page.run.canvas)
            else:
                self._draw_state_of_job(record)

    def _draw_state_of_job(self, record: JobRecord | None) -> None:
        w = self.view.words
        live = None if record is None else self.view.studio.jobs.find_live_job(record.id)
        if live is None or live.state.is_over:
            over = w("result.none") if record is None else w(f"state.{record.state.value}")
            line = record.line if record is not None and record.line else over
            text("p", w.translate_for_page(line), "error" if record is not None and record.line else "quiet")
        if live is not None and not live.state.is_over and live.call.command in _TRYING:
            self.tried = TriedPanel(w, live)
        if record is not None:
            self._draw_messages(record.id)

    def _draw_messages(self, job: str) -> None:
        w = self.view.words
        messages = self.view.studio.jobs.messages(job)
        text("h3", w("result.messages"))
        if messages:
            table(
                [("s", _NUMBER), ("", "")],
                [[f"{seconds:.2f}", w.translate_for_page(line)] for seconds, line in messages],
                "",
            )
        else:
            text("p", w("result.no_messages"), "quiet")

    def _draw_tabs(self, tabs: tuple[str, ...], answer: dict[str, Any]) -> None:
        w = self.view.words
        if self.tab not in tabs:
            self.tab = "summary"
        with box("div", "tabs", role="tablist", aria_label=w("right.title")):
            for tab in tabs:
                number = len(_warnings(answer)) if tab == "issues" else 0
                words = w(f"result.{tab}") + (f" {number}" if number else "")
                classes = "tab warned" if tab == "issues" and _warnings(answer) else "tab"
                chosen = "true" if tab == self.tab else "false"
                button(
                    words,
                    lambda tab=tab: self.choose_tab(tab),
                    classes,
                    role="tab",
                    id=f"tab-{tab}",
                    aria_selected=chosen,
                    aria_controls="result-panel",
                    tabindex="0" if tab == self.tab else "-1",
                )

    def _draw_summary(self, record: JobRecord, answer: dict[str, Any]) -> None:
        command = record.task.command
        if command == "verify":
            self._draw_verdict(answer)
        self._draw_worst_issues(answer)
        if command == "nest":
            self.nest.draw(record, answer)
        elif command == "optimize":
            self._draw_nest_link(record)
            self._draw_saving(record, answer)
        elif command == "solve":
            self._draw_tour_length(answer)
        elif command == "verify":
            self._draw_differences(answer)
        elif command == "simulate":
            self._draw_simulated_time(answer)
        else:  # a command of an earlier version
            text("p", self.view.words("result.unknown"), "quiet")

    def _draw_nest_link(self, record: JobRecord) -> None:
        job, _, place = record.task.origin.partition("/")
        if job and self.view.studio.jobs.record(job) is not None:
            variant, number = (int(word) for word in place.split("/"))
            words = self.view.words("nest.back", variant=variant, number=number)
            button(f"‹ {words}", lambda: self.page.open_job(job, (variant, number)), "plain small back")

    def _draw_worst_issues(self, answer: dict[str, Any]) -> None:
        """Show the most important messages first. These are missing work, dangers, and the first few warnings."""
        worst = [issue for issue in _warnings(answer) if issue["severity"] != "warning"]
        worst.sort(key=lambda issue: issue["severity"] != "danger")
        self._draw_issue_list(worst, "warnings worst", _MAX_ISSUES)
        warnings = [issue for issue in _warnings(answer) if issue["severity"] == "warning"]
        # Assumptions are never folded.
        warnings.sort(key=lambda issue: issue["code"] not in LIMITS)
        limit = max(_MAX_WARNINGS, sum(issue["code"] in LIMITS for issue in warnings))
        self._draw_issue_list(warnings, "warnings", limit)

    def _draw_issue_list(self, issues: list[dict[str, str]], classes: str, limit: int) -> None:
        if not issues:
            return
        with box("ul", classes):
            for issue in issues[:limit]:
                with box("li"):
                    meaning = self.view.words.explain_issue(issue["code"])
                    language = self.view.words.language_of(issue["message"])
                    if meaning:
                        text("b", f"{meaning}: ")
                    text("span", self.view.words.translate_for_page(issue["message"]), "", dir="auto", lang=language)
            if len(issues) > limit:
                text("li", self.view.words("open.more", number=len(issues) - limit))

    def _draw_saving(self, record: JobRecord, answer: dict[str, Any]) -> None:
        w = self.view.words
        saving = headline.saving_headline(answer, w)
        text("p", saving.large, saving.classes)
        text("p", saving.small, "under")
        if answer["gap_percent"] is not None:
            text("p", _gap_sentence(answer["gap_percent"], w), "quiet")
        if missing := headline.missing_words(answer, w):
            self.mark.add_badge(text("p", missing, "badge no"))
        self._draw_verified_badge(answer["verified"], answer.get("certificate"))
        other = headline.compared_strategies(answer)
        rows = [
            [
                (name == "before" and other) or w(f"result.{name}"),
                _time_or_dash(m["time_s"]),
                _length_or_dash(m["travel_mm"]),
                _length_or_dash(m["cut_mm"]),
            ]
            for name in ("before", "nearest", "after")
            if (m := answer[name]) is not None
        ]
        travel_heading = "between" if "cutting" in answer else "travel"
        heads = [("", ""), *((w(f"result.{name}"), _NUMBER) for name in ("time", travel_heading, "cutting"))]
        table(heads, rows, w("result.times"))
        if "strategies" in answer:
            self.strategies.draw(record, answer)
        kept = self.view.studio.history.artefact(record.id, "figures")
        if kept is not None:
            draw_figures(messages_from_json(kept.data), w)
        self._draw_staying_tasks(answer)
        self._draw_layer_table(answer)
        self._draw_tool_table(answer)
        with box("dl", "facts"):
            # A pocket has only the algorithm of its strategy. A program with a single possible order has none.
            searched = ("algorithm", "seed") if answer["algorithm"] and "strategies" not in answer else ()
            for key in ("machine", "dialect", *searched):
                text("dt", w(f"result.{key}"))
                text("dd", str(answer[key]))
            text("dt", w("result.computing"))
            text("dd", format_time(answer["seconds"] or 0.0))
            # Answers of earlier versions lack the search time. A search of a few nodes would show as 0.00 s.
            if searched and (answer.get("search_seconds") or 0.0) >= _SHOWN_SEARCH:
                text("dt", w("result.searching"))
                text("dd", format_time(answer["search_seconds"]))

    def _draw_verified_badge(self, good: bool, certificate: dict[str, Any] | None) -> None:
        w = self.view.words
        self.mark.add_badge(
            text("p", w("result.verified" if good else "result.unverified"), "badge" if good else "badge no")
        )
        if certificate:
            counted = ", ".join(
                w(f"result.{kind}", number=f"{number:,}") for kind, number in certificate["before"].items() if number
            )
            text("p", w("result.certificate", counted=counted), "quiet small")

    def _draw_staying_tasks(self, answer: dict[str, Any]) -> None:
        w, groups = self.view.words, answer.get("staying", [])
        if not groups:
            return
        n_kept = sum(group["count"] for group in groups)
        text("p", w("result.stay", number=f"{n_kept:,}", pieces=f"{answer['counts']['pieces']:,}"), "quiet small")
        with box("ul", "plain-list"):
            for group in groups[:_MAX_REASONS]:
                reasons = " · ".join(w(f"stays.{name}") for name in group["reason"].split("+"))
                line = w("stays.line", line=group["first_line"])
                text("li", f"{group['count']:,} × {reasons} ({line}{': ' if group['word'] else ''}{group['word']})")

    def _draw_layer_table(self, answer: dict[str, Any]) -> None:
        """Show the operation of each layer with the depth, the tools, and their speeds and feeds."""
        w, tools = self.view.words, {tool["number"]: tool for tool in answer["tools"]}

        def of_tools(row: dict[str, Any], key: str) -> str:
            return " / ".join(f"{tools[number][key]:,.0f}" for number in row["tools"] if number in tools) or "–"

        rows = [
            [
                replace_unprintable(row["layer"]) or w("layers.none"),
                w.item_name("layers", row["operation"], row["operation"]),
                f"{row['depth_mm']:.4g}" if row["depth_mm"] else "–",
                " / ".join(f"T{number}" for number in row["tools"]) or "–",
                of_tools(row, "speed_rpm"),
                of_tools(row, "feed_mm_min"),
            ]
            for row in answer.get("layers", [])
            if "tools" in row  # answers of earlier versions lack it
        ]
        if rows:
            heads = [
                (w("result.layer"), ""),
                (w("layers.operation"), ""),
                ("mm", _NUMBER),
                (w("layers.tool"), ""),
                ("rpm", _NUMBER),
                ("mm/min", _NUMBER),
            ]
            table(heads, rows, w("layers.title"))

    def _draw_tool_table(self, answer: dict[str, Any]) -> None:
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

    def _draw_tour_length(self, answer: dict[str, Any]) -> None:
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

    def _draw_verdict(self, answer: dict[str, Any]) -> None:
        same, w = answer["same"], self.view.words
        self.mark.add_badge(
            text("p", w("result.same" if same else "result.differs"), "badge verdict" if same else "badge verdict no")
        )

    def _draw_differences(self, answer: dict[str, Any]) -> None:
        w = self.view.words
        if answer["differences"]:
            with box("ul", "plain-list differences"):
                for number, row in enumerate(answer["differences"][:_MAX_ISSUES]):
                    with box("li"):
                        show = lambda number=number: self.page.run.canvas.select_difference(number)  # noqa: E731
                        button(w.translate_for_page(row["words"]), show, "plain small", title=w("result.show_place"))

    def _draw_simulated_time(self, answer: dict[str, Any]) -> None:
        w = self.view.words
        text("p", format_time(answer["time_s"]), "headline")
        text("p", w("result.on", machine=answer["machine"]), "under")
        rows = [
            [w("result.rapid"), format_length(answer["rapid_mm"])],
            [w("result.feed"), format_length(answer["feed_mm"])],
        ]
        table([("", ""), (w("result.length_of"), _NUMBER)], rows, w("result.times"))
        # Answers of earlier versions lack the head.
        names = names_of_time_kinds(Head(answer.get("head", Head.SPINDLE)).method)
        kinds = {kind.replace("_", "-"): w.translate(name) for kind, name in names.items()}
        draw_times([("", answer["by_kind"], format_time(answer["time_s"]))], w, kinds)
        limits = [
            [axis.upper(), *(to_fixed(limit, 3) for limit in limits)]
            for axis, limits in answer["extents"].items()
            if limits is not None
        ]
        table([("mm", ""), (w("result.from"), _NUMBER), (w("result.to"), _NUMBER)], limits, w("result.extents"))

    def _draw_issues(self, record: JobRecord, answer: dict[str, Any]) -> None:
        w = self.view.words
        issues = sorted(_issues(answer), key=lambda issue: _SEVERITIES.index(issue["severity"]))
        if not issues:
            text("p", w("result.no_issues"), "quiet")
        for severity in _SEVERITIES:
            by_code: dict[str, list[dict[str, str]]] = {}
            for issue in issues[:_MAX_ISSUES]:
                if issue["severity"] == severity:
                    by_code.setdefault(issue["code"], []).append(issue)
            if by_code:
                text("h3", w(f"severity.{severity}"))
                with box("ul", "issue-list"):
                    for code, alike in by_code.items():
                        with box("li", severity):
                            self._draw_issue_group(code, alike)
        if len(issues) > _MAX_ISSUES:
            text("p", w("open.more", number=len(issues) - _MAX_ISSUES), "quiet small")

    def _draw_issue_group(self, code: str, issues: list[dict[str, str]]) -> None:
        """Show all issues with the same code and severity.

        If there are many warnings or notes, expand only the first few.
        """
        w = self.view.words
        text("code", code)
        with box("div"):
            if meaning := w.explain_issue(code):
                text("b", f"{meaning}.")
            foldable = len(issues) > _UNFOLDED + 1 and issues[0]["severity"] in ("warning", "note")
            limit = _UNFOLDED if foldable else len(issues)
            for issue in issues[:limit]:
                self._draw_issue(issue)
            if issues[limit:]:
                with box("details", "issues"):
                    text("summary", w("open.more", number=len(issues) - limit))
                    for issue in issues[limit:]:
                        self._draw_issue(issue)

    def _draw_issue(self, issue: dict[str, str]) -> None:
        w = self.view.words
        with box("p"):
            text("span", w.translate_for_page(issue["message"]), dir="auto", lang=w.language_of(issue["message"]))
            if issue["place"]:
                text("span", w.translate_for_page(issue["place"]), "quiet small")

    def _draw_program(self, record: JobRecord, answer: dict[str, Any]) -> None:
        if not show_created_program(self.view, self.page.run.canvas, record, answer):
            text("p", self.view.words("result.no_program"), "quiet")

    def _draw_search(self, record: JobRecord, answer: dict[str, Any]) -> None:
        draw_searches(self.view, record, answer)
        self._draw_messages(record.id)

    def _draw_downloads(self, record: JobRecord) -> None:
        w = self.view.words
        files = self.view.studio.history.artefacts(record.id)
        job = f"/api/jobs/{record.id}"

        def download(name: str, classes: str) -> TextElement:
            return link(w(f"file.{name}"), f"{job}/files/{name}", classes, download=files[name], title=files[name])

        with box("footer", "foot files"):
            for name in _MAIN_FILES:
                if name in files:
                    anchor = download(name, "button" if name == "report" else "button primary")
                    if name != "report":
                        self.mark.add_program(anchor, files[name])
            with box("details", "more-files"):
                text("summary", w("file.more"), "button")
                with box("div"):
                    for name in _MORE_FILES:
                        if name in files:
                            download(name, "")
                    link("JSON", f"{job}/answer", download=f"{record.id}.json", title=w("file.answer"))
                    if "report" in files:
                        shown = f"{job}/files/report?show=true"
                        link(w("file.show"), shown, target="_blank", rel="noopener")
            if can_be_edited(self.view.studio.history, record, files):
                button(w("edit.title"), lambda: self.page.run.edit.start(record), "", id="edit-begin")
            elif any(record.task.options.get(name) for name in ("chains", "common_lines")):
                text("p", w("edit.not_joined"), "quiet small")


def _issues(answer: dict[str, Any]) -> list[dict[str, str]]:
    return [
        issue if isinstance(issue, dict) else {"code": "", "severity": "warning", "message": str(issue), "place": ""}
        for issue in answer.get("issues", [])
    ]


def _warnings(answer: dict[str, Any]) -> list[dict[str, str]]:
    return [issue for issue in _issues(answer) if issue["severity"] != "note"]


def _time_or_dash(value: float | None) -> str:
    return "–" if value is None else format_time(value)


def _length_or_dash(value: float | None) -> str:
    return "–" if value is None else format_length(value)


def _gap_sentence(percent: float, words: Words) -> str:
    shown = f"{percent:.2f}"
    return words("result.least") if shown == "0.00" else words("result.gap", percent=shown)


class TriedPanel:
    """A table with the result of each trial. The best trial and all running trials are marked."""

    def __init__(self, words: Words, live: LiveJob) -> None:
        self.words, self.live = words, live
        self._rows: list[tuple[str, str, float | None]] = []
        self.place = box("div", "tried")
        self.tick()

    def tick(self) -> None:
        """Update the rows if they have changed."""
        rows = [(name, *figures) for name, figures in list(self.live.tried.items())]
        if rows == self._rows:
            return
        self._rows = rows
        best = min((cost for _, _, cost in rows if cost is not None), default=None)
        w = self.words
        self.place.clear()
        with self.place:
            text("h3", w("run.tried"))
            with box("ul", aria_label=w("run.tried")):
                for name, figure, cost in rows:
                    first = best is not None and cost == best
                    with box("li", "best" if first else "" if figure else "going"):
                        text("span", self._trial_label(name))
                        text("span", w("run.best"), "tag done") if first else None
                        text("b", figure or w("run.trying"), "figure")

    def _trial_label(self, name: str) -> str:
        """Return the label of a trial, such as ``by shapes · 3`` for the third variant of a nest by shapes."""
        method, _, number = name.partition(" ")
        known = self.words.table.get(f"nest.{method}")
        return f"{known} · {number}" if known and number.isdigit() else name


def draw_searches(view: View, record: JobRecord, answer: dict[str, Any]) -> None:
    """Show the charts of all searches in a run, and the workers."""
    kept = view.studio.history.artefact(record.id, "search")
    for search in json.loads(kept.data) if kept is not None else []:
        if search.get("iterations"):
            _draw_learning_chart(view, record, search)
            continue
        text("h3", search["name"])
        if search["history"]:
            words = view.words.section("chart")
            Chart("chart tall").show(*convergence_chart(search["history"], search["bound"], search["unit"], words))
    _draw_worker_table(view, answer)


def _draw_learning_chart(view: View, record: JobRecord, search: dict[str, Any]) -> None:
    w = view.words
    with box("section"):
        with box("div", "chart-head"):
            text("h3", search["name"])
            button("PNG", None, "small plain", title=w("chart.png"), data_picture=f"{record.id}.png")
            files = view.studio.history.artefacts(record.id)
            if "iterations" in files:
                address = f"/api/jobs/{record.id}/files/iterations"
                link("CSV", address, "button small plain", download=files["iterations"], title=files["iterations"])
        rows, words = evenly_spaced_rows(search["iterations"], _MAX_POINTS), w.section("chart")
        SwitchedChart(words, "chart learned").show(
            lambda by: learning_chart(rows, search["bound"], search["unit"], words, by)
        )
    last = Iteration(*search["iterations"][-1])
    if last.branching is not None:
        text("p", w("lesson.branching", factor=f"{last.branching:.2f}"), "quiet small")


def _draw_worker_table(view: View, answer: dict[str, Any]) -> None:
    w = view.words
    workers = [row for row in answer.get("workers", []) if row["ants"]][:_MAX_WORKERS]
    if not workers:
        return
    best = min(row["best"] for row in workers)
    text("h3", w("result.workers"))
    rows = (
        (
            f"{w('canvas.worker')} {row['worker']}",
            row["seconds"],
            w("result.ants", number=f"{row['ants']:,}", seconds=f"{row['seconds']:.2f}"),
            row["best"] <= best,
        )
        for row in workers
    )
    bar_chart(box("div"), rows)
