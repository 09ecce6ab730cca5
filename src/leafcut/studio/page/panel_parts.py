"""The parts of a nest. Users open drawings to add parts, and open a parts list to set the quantities."""

from __future__ import annotations

import asyncio
import filecmp
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING

from leafcut.errors import LeafcutError
from leafcut.studio.folder import BUILT_IN
from leafcut.studio.jobs.nest_request import WantedPart, parse_quantity_field, parse_rotations, read_parts_list
from leafcut.studio.page.elements import PartsTable, box, text
from leafcut.studio.page.page_state import View

if TYPE_CHECKING:
    from leafcut.studio.page.pages import Page


class PartsPanel:
    """The table with the parts to nest."""

    def __init__(self, view: View, page: Page) -> None:
        self.view, self.page = view, page
        #: A parts list whose drawings are not all open yet.
        self._list = ""
        self._one_by_one = asyncio.Lock()
        w = view.words
        with box("div", "parts") as self.place:
            self.rows = PartsTable(w.section("parts"), self._change_part, self._remove_part, self._show_drawing)
            self.hint = text("p", w("parts.hint"), "quiet small")

    def draw(self) -> None:
        """Show the parts if the user has selected nesting."""
        view = self.view
        self.place.set_visibility(view.work == "nest")
        self.hint.set_visibility(len(view.parts) < 2)
        rows = [
            {
                "id": _row_id(index, part),
                "name": view.part_names.get(part.input) or "?",
                "quantity": str(part.quantity),
                "rotations": part.rotations,
                "shown": part.input == view.source and view.job is None,
            }
            for index, part in enumerate(view.parts)
        ]
        self.rows.show(rows, str(view.values.get("rotations") or "0,90,180,270").replace(",", " "))

    async def add_part_or_list(self, source: str, name: str) -> bool:
        """Add a drawing or apply a parts list. Return False for all other files."""
        if source.startswith(BUILT_IN):
            return False
        async with self._one_by_one:
            if name.lower().endswith(".csv"):
                self._list = source
                self._apply_parts_list()
                self._redraw_page()
                return True
            return await self._add_part(source, name)

    async def _add_part(self, source: str, name: str) -> bool:
        view = self.view
        parts = view.parts
        seen, line, newest = await self.page.input.read_preview(replace(view, source=source, name=name), "nest")
        if line:
            self.page.show_message(line, True)
            self.page.input.show_ready(view.has_all_inputs)
            return True
        if view.work != "nest" or view.parts is not parts:
            return True  # the user has left nesting meanwhile
        if seen is None or "nest" not in seen.works:
            return False
        if seen.error and view.source:  # keep the open input
            self.page.show_message(seen.error, True)
            self.page.input.show_ready(view.has_all_inputs)
            return True
        if not seen.error and (existing := self._find_same_part(source, name)):
            self.page.show_message(view.words("parts.there", name=name))
            view.studio.folder.delete_inputs([source])
            source = existing
        if newest:
            view.switch_input(source, name)
            view.seen = seen
            self.page.run.leave_job()
        if seen.error:
            self.page.show_message(seen.error, True)
        elif source not in {part.input for part in parts}:
            self.page.show_message("")
            view.parts.append(WantedPart(source))
            view.part_names[source] = name
            self._apply_parts_list()
        self.page.update_address()
        self._redraw_page()
        return True

    def _find_same_part(self, source: str, name: str) -> str:
        view, folder = self.view, self.view.studio.folder
        for part in view.parts:
            if view.part_names.get(part.input) == name and part.input != source and not part.input.startswith(BUILT_IN):
                with suppress(LeafcutError):
                    if filecmp.cmp(folder.input_path(part.input), folder.input_path(source), shallow=False):
                        return part.input
        return ""

    def add_open_drawing(self) -> None:
        """Add the open drawing as the first part."""
        view = self.view
        known = {part.input for part in view.parts}
        fits = view.seen is not None and "nest" in view.seen.works and not view.seen.error
        if view.source and fits and view.source not in known:
            view.parts.append(WantedPart(view.source))
            view.part_names[view.source] = view.name

    def _apply_parts_list(self) -> None:
        view = self.view
        if not self._list:
            return
        try:
            opened = {view.part_names[part.input]: part.input for part in view.parts}
            parts, missing = read_parts_list(view.studio.folder.input_path(self._list), opened)
        except LeafcutError as problem:
            self._list = ""
            self.page.show_message(view.studio.folder.hide_paths(str(problem)), True)
            return
        listed = {part.input for part in parts}
        view.parts = [*(part for part in view.parts if part.input not in listed), *parts]
        if missing:
            self.page.show_message(view.words("parts.missing", names=", ".join(missing[:8])), True)
        else:
            self._list = ""
            self.page.show_message(view.words("parts.listed", number=len(parts)))

    def _part_index(self, row: str) -> int | None:
        """Return the index of the part in a row.

        The result is None if the row no longer exists, for example after a double click.
        """
        return next((index for index, part in enumerate(self.view.parts) if _row_id(index, part) == row), None)

    def _change_part(self, row: str, key: str, typed: str) -> None:
        view, index = self.view, self._part_index(row)
        if index is None:
            return
        try:
            changes = (
                {"quantity": parse_quantity_field(typed)}
                if key == "quantity"
                else {"rotations": parse_rotations(typed)}
            )
        except LeafcutError as problem:
            self.page.show_message(str(problem), True)
            return
        self.page.show_message("")
        view.parts[index] = replace(view.parts[index], **changes)
        self._redraw_page()

    def _remove_part(self, row: str) -> None:
        index = self._part_index(row)
        if index is not None:
            del self.view.parts[index]
            self._redraw_page()

    async def _show_drawing(self, row: str) -> None:
        view, index = self.view, self._part_index(row)
        if index is None:
            return
        source = view.parts[index].input
        view.switch_input(source, view.part_names[source])
        self.page.run.leave_job()
        self.page.update_address()
        await self.page.input.read_input("nest")

    def _redraw_page(self) -> None:
        self.page.input.draw()
        self.page.run.draw()
        self.page.result.draw()


def _row_id(index: int, part: WantedPart) -> str:
    return f"{index}-{part.input}"
