"""The views of machines and tool libraries, in which users view, copy, edit and save profiles as TOML."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from nicegui.elements.mixins.text_element import TextElement

from leafcut.errors import DataError, LeafcutError, OptionError
from leafcut.studio.jobs.jobs import error_line
from leafcut.studio.page import library, profile_form
from leafcut.studio.page.elements import Editor, Form, box, button, text
from leafcut.studio.page.page_state import View

if TYPE_CHECKING:
    from leafcut.studio.page.pages import Page

#: Two views of the same text.
_TABS = ("form", "toml")


class LibraryPanel:
    """The list of all ``machines`` or ``tools``, and the selected profile."""

    def __init__(self, view: View, page: Page, kind: str) -> None:
        self.view, self.page, self.kind = view, page, kind
        self.chosen, self.own = "", False
        #: Name for which the page has warned that the file already exists.
        self._asked = ""
        self.tab = "form"
        #: Array in the tool library, and index of the entry that the form shows.
        self.array, self.entry = ("tool", 0) if kind == "tools" else ("", 0)
        self._saved = ""
        #: Text that this page shows. It is outdated if the user has changed the profile on another page.
        self._shown = ""
        self.form: Form | None = None
        self.editor: Editor | None = None
        #: Button of the selected entry in the list of the tool library.
        self._title: TextElement | None = None
        self.place = box("div", "page library")

    def draw(self) -> None:
        """Show the list and the selected profile."""
        w, folder = self.view.words, self.view.studio.folder
        if not self.chosen:
            self.chosen = library.shipped_names(self.kind)[0]
        self.place.clear()
        with self.place:
            text("h1", w(f"top.{self.kind}"))
            text("p", w(f"library.{self.kind}"), "quiet")
            with box("div", "halves"):
                with box("nav", "list card", aria_label=w(f"top.{self.kind}")):
                    own_names = folder.own_names(self.kind)
                    if own_names:
                        text("h2", w("library.own"), "minor")
                    for name in own_names:
                        self._add_list_button(name, True)
                    text("h2", w("library.shipped"), "minor")
                    for name in library.shipped_names(self.kind):
                        self._add_list_button(name, False)
                with box("section", "card", aria_label=self.chosen):
                    self._draw_profile()

    def _add_list_button(self, name: str, own: bool) -> None:
        current = "true" if (name, own) == (self.chosen, self.own) else "false"
        button(name, lambda: self.choose(name, own), "entry", aria_current=current)

    def choose(self, name: str, own: bool) -> None:
        """Select a profile."""
        if (name, own) != (self.chosen, self.own):
            self.array, self.entry = ("tool", 0) if self.kind == "tools" else ("", 0)
        self.chosen, self.own, self._asked = name, own, ""
        self.draw()

    @property
    def current_text(self) -> str:
        """The current text, which is the unsaved draft if there is one, and otherwise the saved text."""
        draft = self.view.studio.folder.draft(self.kind, self.chosen) if self.own else None
        return self._saved if draft is None else draft

    def _read_saved_text(self) -> None:
        self._saved = (
            library.own_text(self.view.studio.folder, self.kind, self.chosen)
            if self.own
            else library.shipped_text(self.kind, self.chosen)
        )

    def _is_current_or_redraw(self) -> bool:
        """Return whether this page shows the current text. If it does not, update the page and show a message."""
        try:
            self._read_saved_text()
        except LeafcutError as problem:
            self.page.show_message(str(problem), True)
        else:
            if self.current_text == self._shown:
                return True
            self.page.show_message(self.view.words("library.elsewhere", name=self.chosen), True)
        self.draw()
        return False

    def _draw_profile(self) -> None:
        w = self.view.words
        try:
            self._read_saved_text()
        except Exception as problem:
            text("p", w.translate_for_page(error_line(problem)), "error")
            return
        with box("div", "title"):
            text("h2", self.chosen)
            self.unsaved = text("span", w("library.unsaved"), "tag cancelled")
            self.discard = button(w("library.discard"), self._discard_changes, "small plain", data_sure=w("edit.sure"))
            button(w("command.copy"), lambda: self._copy_profile(self._saved), "small")
            if self.own:
                button(w("jobs.delete"), self._delete_profile, "small plain", data_sure=w("jobs.sure"))
        if self.own:
            self._draw_save_bar()
        with box("div", "tabs", role="tablist", aria_label=self.chosen):
            for tab in _TABS:
                is_current = tab == self.tab
                button(
                    w(f"library.{tab}"),
                    lambda tab=tab: self._show_tab(tab),
                    "tab",
                    role="tab",
                    id=f"{self.kind}-{tab}",
                    aria_selected="true" if is_current else "false",
                    aria_controls=f"{self.kind}-panel",
                    tabindex="0" if is_current else "-1",
                )
        with box("div", "", role="tabpanel", id=f"{self.kind}-panel", aria_labelledby=f"{self.kind}-{self.tab}"):
            self._draw_tab()
        self._check_and_show_problem()

    def _draw_save_bar(self) -> None:
        w, field = self.view.words, f"editor-name-{self.kind}"
        with box("form", "editor-bar") as form:
            text("label", w("library.name"), for_=field)
            with box("span", "box"):
                name = box("input", "", id=field, type="text", spellcheck="false", autocomplete="off")
                name.props["^value"] = self.chosen  # the attribute; the property would overwrite typed text
            button(w("library.save"), None, "primary").props("type=submit")
            self.problem = box("p", "error problem", role="status")
        typed = "e.target.querySelector('input').value"
        form.on(
            "submit",
            lambda e: self._save_profile(e.args),
            js_handler=f"(e) => {{ e.preventDefault(); emit({typed}); }}",
        )

    def _show_problem(self, problem: str, line: int) -> None:
        """Show an error with a link to its line, unless `line` is 0. If `problem` is empty, remove the error."""
        self.problem.clear()
        with self.problem:
            if problem:
                text("span", problem)
            if line:
                button(self.view.words("library.to_line", line=line), self._go_to_line, "plain small")

    def _show_tab(self, tab: str) -> None:
        self.tab = tab
        self.draw()

    def _draw_tab(self) -> None:
        w, self.form, self.editor = self.view.words, None, None
        data = profile_form.parse_profile(self.current_text)
        if self.tab == "toml":
            self.editor = Editor(self.current_text, self._set_text if self.own else None, f"{self.chosen}.toml")
        elif data is None:
            text("p", w("library.no_form"), "quiet")
        elif self.kind == "tools":
            self._draw_tool_form(data)
        else:
            self._draw_form(data, data)

    def _draw_form(self, data: dict[str, Any], table: Any) -> None:
        groups = self._form_groups(data, table)
        form = self.form = Form(self.view.words, self._set_field, groups, fixed=not self.own)
        form.classes("profile")
        form.show(profile_form.form_values(self.array, table))

    def _form_groups(self, data: dict[str, Any], table: Any) -> list[dict[str, Any]]:
        groups = profile_form.form_groups(self.view.words, self.array, data)
        if self.array:
            groups[0]["title"] = profile_form.entry_title(self.array, table)
        return groups

    def _draw_tool_form(self, data: dict[str, Any]) -> None:
        w = self.view.words
        entries = {array: profile_form.array_entries(data, array) for array in profile_form.ARRAYS}
        if self.entry >= len(entries[self.array]):
            self.array, self.entry = "tool", 0
        with box("div", "tool-form"):
            with box("div", "tool-list", role="group", aria_label=w("library.entries")):
                for array, rows in entries.items():
                    text("h3", w(f"profile.group.{array}"))
                    for number, row in enumerate(rows):
                        self._entry_button(array, number, profile_form.entry_title(array, row))
                    if self.own:
                        button(w(f"library.add_{array}"), lambda array=array: self._add_entry(array), "small")
            with box("div", "tool-one"):
                if not entries[self.array]:
                    return
                self._draw_form({}, entries[self.array][self.entry])
                if self.own:
                    words = w(f"library.remove_{self.array}")
                    button(words, self._remove_entry, "small plain", data_sure=w("jobs.sure"))

    def _entry_button(self, array: str, number: int, title: str) -> None:
        is_current = (array, number) == (self.array, self.entry)
        entry_button = button(
            title,
            lambda: self._choose_entry(array, number),
            "entry small",
            aria_current="true" if is_current else "false",
        )
        if is_current:
            self._title = entry_button

    def _choose_entry(self, array: str, number: int) -> None:
        self.array, self.entry = array, number
        self.draw()

    def _add_entry(self, array: str) -> None:
        if self._change_draft(lambda words: profile_form.add_entry(words, array)):
            self._choose_entry(
                array, len(profile_form.array_entries(profile_form.parse_profile(self.current_text) or {}, array)) - 1
            )

    def _remove_entry(self) -> None:
        if self._change_draft(lambda words: profile_form.remove_entry(words, self.array, self.entry)):
            self._choose_entry(self.array, max(self.entry - 1, 0))

    def _change_draft(self, change: Callable[[str], str]) -> bool:
        if not self._is_current_or_redraw():
            return False
        try:
            # Runs and lists use the saved text.
            self.view.studio.folder.set_draft(self.kind, self.chosen, change(self.current_text))
        except LeafcutError as problem:
            self.page.show_message(str(problem), True)
            self.draw()
            return False
        return True

    def _set_field(self, name: str, value: Any, _: str) -> None:
        if not self._change_draft(lambda words: profile_form.set_value(words, self.array, self.entry, name, value)):
            return
        data = profile_form.parse_profile(self.current_text) or {}
        rows = profile_form.array_entries(data, self.array) if self.array else [data]
        if self.form is not None and self.entry < len(rows):
            row = rows[self.entry]
            if self.array and self._title is not None:
                self._title.set_text(profile_form.entry_title(self.array, row))
            self.form.show(profile_form.form_values(self.array, row), groups=self._form_groups(data, row))
        self._check_and_show_problem()

    def _set_text(self, words: str) -> None:
        if self._change_draft(lambda _: words):
            self._check_and_show_problem()

    def _delete_draft(self, name: str) -> None:
        self.view.studio.folder.set_draft(self.kind, name, None)

    def _discard_changes(self) -> None:
        if not self._is_current_or_redraw():
            return
        self._delete_draft(self.chosen)
        self.draw()

    def _check_and_show_problem(self) -> None:
        self._shown = self.current_text
        for part in (self.unsaved, self.discard):
            part.set_visibility(self.current_text != self._saved)
        if not self.own:
            return
        problem, place = "", DataError("")
        try:
            library.check_profile(self.kind, self.chosen, self.current_text)
        except OptionError as refusal:
            place = refusal if isinstance(refusal, DataError) else place
            problem = self.view.words.translate_for_page(str(refusal))
        line = place.line or 0
        self._show_problem(problem, line)
        if self.editor is not None:
            self.editor.show(self.current_text, line, problem)
        if self.form is not None:
            name = f"{place.table}.{place.key}" if place.table and not self.array else place.key
            is_here = not self.array or (place.table, place.number) == (self.array, self.entry + 1)
            short = problem.rpartition(f"'{place.key}' ")[2] if place.key else problem
            self.form.set_errors({name: short} if problem and place.key and is_here else {})

    def _go_to_line(self) -> None:
        if self.tab != "toml":
            self._show_tab("toml")
        if self.editor is not None:
            self.editor.run_method("go")

    def _copy_profile(self, words: str) -> None:
        taken = {*self.view.studio.folder.own_names(self.kind), *library.shipped_names(self.kind)}
        base = f"my-{self.chosen.removeprefix('my-')}"
        names = [base, *(f"{base}-{number}" for number in range(2, 1000))]
        name = next(name for name in names if name not in taken)
        self._write_profile(name, self._rename_in_text(words, self.chosen, name))

    def _rename_in_text(self, words: str, shown: str, name: str) -> str:
        """Rename a profile if it is a machine. Otherwise, return the profile unchanged."""
        return profile_form.rename_profile(words, shown, name) if self.kind == "machines" else words

    def _save_profile(self, name: str) -> None:
        if not self._is_current_or_redraw():
            return
        shown, name = self.chosen, name.strip()
        if name != shown and name in self.view.studio.folder.own_names(self.kind) and name != self._asked:
            self._asked = name
            self.page.show_message(self.view.words("library.taken", name=name), True)
            return
        words = self.current_text if name == shown else self._rename_in_text(self.current_text, shown, name)
        if self._write_profile(name, words):
            self._delete_draft(shown)

    def _write_profile(self, name: str, words: str) -> bool:
        try:
            library.save_profile(self.view.studio.folder, self.kind, name, words)
        except Exception as problem:
            self.page.show_message(error_line(problem), True)
            return False
        self.page.show_message(self.view.words("library.saved", name=name))
        self._delete_draft(name)
        self.choose(name, True)
        self.page.input.draw()
        return True

    def _delete_profile(self) -> None:
        library.delete_profile(self.view.studio.folder, self.kind, self.chosen)
        self._delete_draft(self.chosen)
        self.choose(library.shipped_names(self.kind)[0], False)
        self.page.input.draw()
