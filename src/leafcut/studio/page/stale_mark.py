"""The notice above an outdated result. It lists the choices that have changed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from nicegui.elements.mixins.text_element import TextElement

from leafcut.errors import LeafcutError, OptionError
from leafcut.processes.settings import group_of
from leafcut.studio.folder import OWN, Folder
from leafcut.studio.jobs.history import JobRecord
from leafcut.studio.jobs.nest_request import WantedPart
from leafcut.studio.jobs.task import OWN_KINDS, Task, nested_parts, source_display_name
from leafcut.studio.page import forms
from leafcut.studio.page.elements import box, button, text
from leafcut.studio.page.page_state import View
from leafcut.studio.page.panel_input import task_work
from leafcut.studio.wording import Words

if TYPE_CHECKING:
    from leafcut.studio.page.pages import Page

_MAX_LINES = 3


class StaleMark:
    """Marks a result, its badges and its programs as outdated if the choices on the page no longer match its run."""

    def __init__(self, view: View, page: Page) -> None:
        self.view, self.page = view, page
        self._record: JobRecord | None = None
        self._shown_changes: list[str] = []
        self._badges: list[tuple[TextElement, str]] = []
        self._programs: list[tuple[TextElement, str, str]] = []

    def draw(self, record: JobRecord) -> None:
        """Add the notice, which is still empty, to the current container. Badges and programs are added later."""
        self._record = record
        self._badges, self._programs = [], []
        self.place = box("div", "stale", role="status", aria_live="polite")

    def leave(self) -> None:
        """Remove the notice, because no result is visible."""
        self._record = None
        if self._shown_changes:
            self._shown_changes = []
            self.page.run.show_outdated_notice("")

    def add_badge(self, badge: TextElement) -> None:
        """Mark a badge whenever the result is outdated."""
        self._badges.append((badge, badge.text))

    def add_program(self, anchor: TextElement, title: str) -> None:
        """Mark the download link of a program whenever the result is outdated. `title` is its normal tooltip."""
        self._programs.append((anchor, anchor.text, title))

    def refresh(self) -> None:
        """Compare the current choices with the choices of the run, and update the notice."""
        record, w = self._record, self.view.words
        if record is None:
            return
        changes = [difference.line(w) for difference in changed_choices(record, self.view)]
        if changes == self._shown_changes:
            return
        self._shown_changes = changes
        # If only the order was edited, the drawing already shows the edited order.
        drawn = changes != [edited_order_entry(w).line(w)]
        self.page.run.show_outdated_notice(w("stale.title") if changes and drawn else "")
        lines = changes[:_MAX_LINES] + (
            [w("open.more", number=len(changes) - _MAX_LINES)] if len(changes) > _MAX_LINES else []
        )
        self.place.clear()
        if changes:
            with self.place:
                self._show_changes(lines, drawn)
        for badge, words in self._badges:
            badge.set_text(w("stale.of_earlier", name=words) if changes else words)
            badge.classes(**{"add" if changes else "remove": "earlier"})
        for anchor, words, title in self._programs:
            anchor.set_text(w("stale.of_earlier", name=words) if changes else words)
            anchor.classes(**{"remove" if changes else "add": "primary"})
            anchor.props["title"] = f"{title}: {w('stale.title')}. {'. '.join(lines)}" if changes else title
            anchor.update()

    def _show_changes(self, lines: list[str], chosen: bool) -> None:
        """Show the differences, with a button that restores the `chosen` options.

        An order has no button here, because users restore it in the order editor.
        """
        w = self.view.words
        text("b", w("stale.title"))
        with box("ul"):
            for line in lines:
                text("li", line, "", dir="auto")
        with box("div", "ends"):
            button(w("stale.again"), self.page.input.request_run, "small")
            if chosen:
                button(w("stale.back"), self._restore_choices, "small plain", title=w("stale.back_text"))

    async def _restore_choices(self) -> None:
        if self._record is not None:
            await self.page.input.restore_task(self._record.task)


@dataclass(frozen=True)
class ChangedChoice:
    """A choice that has changed: its label, its value in the run, and its current value."""

    what: str
    then: str
    now: str

    def line(self, words: Words) -> str:
        """Format the change for display, such as ``Thickness 5 mm; now 25 mm``."""
        return words("stale.line", what=self.what, then=self.then, now=self.now)


def changed_choices(record: JobRecord, view: View) -> list[ChangedChoice]:
    """Compare the choices on the page with the choices of a job. The most important differences come first."""
    task, w = record.task, view.words
    work = task_work(task, record.title)
    return [
        *_changed_work(task, work, view),
        *_changed_inputs(task, view),
        *_changed_options(task, work, view),
        *_changed_files(record, view.studio.folder, w),
        *([edited_order_entry(w)] if view.edited else []),
    ]


def edited_order_entry(words: Words) -> ChangedChoice:
    """Return the entry for an order that the user has edited since the run."""
    return ChangedChoice(words("stale.order"), words("stale.found"), words("stale.by_hand"))


def _changed_work(task: Task, work: str, view: View) -> Iterator[ChangedChoice]:
    w = view.words
    if work != view.work:
        yield ChangedChoice(w("choose.work"), w.item_name("work", work), w.item_name("work", view.work))
    elif work == "program" and task.process != view.process:
        yield ChangedChoice(
            w("choose.process"), w.item_name("process", task.process), w.item_name("process", view.process)
        )


def _changed_inputs(task: Task, view: View) -> Iterator[ChangedChoice]:
    w, folder = view.words, view.studio.folder
    if task.command == "nest" and view.work == "nest":
        yield from _changed_parts({part.input: part for part in nested_parts(task)}, view)
    elif task.command != "nest" and task.inputs[0] != view.source:
        yield ChangedChoice(
            w("open.title"), _displayed_name(task.inputs[0], folder), _displayed_name(view.source, folder)
        )
    if task.command == "verify" and view.work == "verify" and task.inputs[1] != view.second:
        now = _displayed_name(view.second, folder) if view.second else w("form.none")
        yield ChangedChoice(w("open.second"), _displayed_name(task.inputs[1], folder), now)


def _changed_parts(before: Mapping[str, WantedPart], view: View) -> Iterator[ChangedChoice]:
    after = {part.input: part for part in view.parts}
    for input_id in {**before, **after}:
        old, new = before.get(input_id), after.get(input_id)
        if old != new:
            name = view.part_names.get(input_id) or _displayed_name(input_id, view.studio.folder)
            yield ChangedChoice(name, _part_text(old, view.words), _part_text(new, view.words))


def _part_text(part: WantedPart | None, words: Words) -> str:
    if part is None:
        return words("form.none")
    return f"× {part.quantity}" + (f" ({part.rotations}°)" if part.rotations else "")


def _changed_options(task: Task, work: str, view: View) -> Iterator[ChangedChoice]:
    before, after = forms.values_of_work(work, task.options), forms.values_of_work(view.work, view.values)
    names = dict.fromkeys([*before, *after])
    if work != view.work:  # options of only one kind of work are not listed in addition to the changed work
        shared = forms.applicable_options(work, task.options) & forms.applicable_options(view.work, view.values)
        names = dict.fromkeys(name for name in names if name in shared)
    for name in names:
        if not _is_equal(name, before.get(name), after.get(name)):
            yield ChangedChoice(
                view.words.option_label(name),
                forms.value_words(name, before.get(name), view.words, view.studio.folder, work),
                forms.value_words(name, after.get(name), view.words, view.studio.folder, view.work),
            )


def _is_equal(name: str, before: Any, after: Any) -> bool:
    """Return whether two values are equivalent, such as ``6`` and ``6mm``."""
    group = group_of(name)
    if before == after:
        return True
    if group.specs()[name].kind == "path" or group.specs()[name].may_be_path:
        return False
    with suppress(OptionError):
        first, second = (group(**group.as_typed({} if value is None else {name: value})) for value in (before, after))
        return bool(getattr(first, name) == getattr(second, name))
    return False


def _changed_files(record: JobRecord, folder: Folder, words: Words) -> Iterator[ChangedChoice]:
    for name, kind in OWN_KINDS.items():
        value = record.task.options.get(name)
        if not isinstance(value, str) or not value.startswith(OWN):
            continue
        own_name = value.removeprefix(OWN)
        with suppress(LeafcutError, OSError):
            if folder.own_path(kind, own_name).stat().st_mtime > record.created:
                yield ChangedChoice(words.option_label(name), own_name, words("stale.saved"))


def _displayed_name(word: str, folder: Folder) -> str:
    with suppress(LeafcutError):
        return folder.input_path(word).name
    return source_display_name(word).removeprefix(OWN)
