"""Machines and tool libraries: look at what there is, make one's own from it, change it, keep it as TOML."""

from __future__ import annotations

from typing import TYPE_CHECKING

from leafcut.studio import library
from leafcut.studio.elements import Editor, box, button, text
from leafcut.studio.jobs import line_of
from leafcut.studio.page_state import View

if TYPE_CHECKING:
    from leafcut.studio.page_parts import PageParts


class LibraryPanel:
    """The profiles of one kind, ``machines`` or ``tools``: a list, and the one that was chosen."""

    def __init__(self, view: View, page: PageParts, kind: str) -> None:
        self.view, self.page, self.kind = view, page, kind
        self.chosen, self.own = "", False
        #: The name of which a person was told that it is taken.
        self._asked = ""
        #: Name → text of the person's own that were changed and not saved.
        self.drafts: dict[str, str] = {}
        self.place = box("div", "page library")

    def draw(self) -> None:
        """Show the list and the one that was chosen."""
        w, folder = self.view.words, self.view.studio.folder
        if not self.chosen:
            self.chosen = library.shipped(self.kind)[0]
        self.place.clear()
        with self.place:
            text("h1", w(f"top.{self.kind}"))
            text("p", w(f"library.{self.kind}"), "quiet")
            with box("div", "halves"):
                with box("nav", "list card", aria_label=w(f"top.{self.kind}")):
                    own = folder.own(self.kind)
                    if own:
                        text("h2", w("library.own"), "minor")
                    for name in own:
                        self._entry(name, True)
                    text("h2", w("library.shipped"), "minor")
                    for name in library.shipped(self.kind):
                        self._entry(name, False)
                with box("section", "card", aria_label=self.chosen):
                    self._detail()

    def _entry(self, name: str, own: bool) -> None:
        here = "true" if (name, own) == (self.chosen, self.own) else "false"
        button(name, lambda: self.choose(name, own), "entry", aria_current=here)

    def choose(self, name: str, own: bool) -> None:
        """Show one of them."""
        self.chosen, self.own, self._asked = name, own, ""
        self.draw()

    def _detail(self) -> None:
        w, folder = self.view.words, self.view.studio.folder
        try:
            words = (
                library.own_text(folder, self.kind, self.chosen)
                if self.own
                else library.shipped_text(self.kind, self.chosen)
            )
        except Exception as problem:
            text("p", line_of(problem), "error")
            return
        draft = self.drafts.get(self.chosen, words) if self.own else words
        with box("div", "title"):
            text("h2", self.chosen)
            if draft != words:
                text("span", w("library.unsaved"), "tag cancelled")
            button(w("library.copy"), lambda: self._copy(words), "small")
            if self.own:
                button(w("library.delete"), self._delete, "small plain", data_sure=w("jobs.sure"))
        names = {"name": w("library.name"), "save": w("library.save"), "rule": w("library.rule")}
        Editor(
            self.chosen, draft, names, self._save if self.own else None, self._keep_draft, f"{self.chosen}.toml"
        )  # fmt: skip

    def _keep_draft(self, words: str) -> None:
        """Keep what was typed for when the person comes back; runs and lists have what was saved."""
        self.drafts[self.chosen] = words

    def _copy(self, words: str) -> None:
        taken = {*self.view.studio.folder.own(self.kind), *library.shipped(self.kind)}
        base = f"my-{self.chosen.removeprefix('my-')}"
        names = [base, *(f"{base}-{number}" for number in range(2, 1000))]
        name = next(name for name in names if name not in taken)
        self._keep(name, self._renamed(words, self.chosen, name))

    def _renamed(self, words: str, shown: str, name: str) -> str:
        """Return a machine that says its new name itself, where it said the one before; a library says none."""
        return words.replace(f'name = "{shown}"', f'name = "{name}"', 1) if self.kind == "machines" else words

    def _save(self, name: str, words: str) -> None:
        """Save what was typed, under the name of what is shown or another one."""
        shown = self.chosen
        if name != shown and name in self.view.studio.folder.own(self.kind) and name != self._asked:
            self._asked = name
            self.page.say(self.view.words("library.taken", name=name), True)
            return
        if self._keep(name, self._renamed(words, shown, name)):
            self.drafts.pop(shown, None)

    def _keep(self, name: str, words: str) -> bool:
        """Check and write one of the person's own, and show it; return whether that is done."""
        try:
            library.save(self.view.studio.folder, self.kind, name, words)
        except Exception as problem:
            self.page.say(line_of(problem), True)
            return False
        self.page.say(self.view.words("library.saved", name=name))
        self.drafts.pop(name, None)
        self.choose(name, True)
        self.page.input.draw()
        return True

    def _delete(self) -> None:
        library.delete(self.view.studio.folder, self.kind, self.chosen)
        self.drafts.pop(self.chosen, None)
        self.choose(library.shipped(self.kind)[0], False)
        self.page.input.draw()
