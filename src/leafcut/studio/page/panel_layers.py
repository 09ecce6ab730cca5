"""The operations by layer: a table with a row for each layer of the drawing. It edits the file of operations."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote, unquote

from leafcut.errors import DataError, LeafcutError, printable
from leafcut.model.tool import ToolLibrary
from leafcut.processes.settings import collect_settings
from leafcut.read.machine import load_machine
from leafcut.read.operations import (
    DEEP,
    THROUGH,
    WILDCARDS,
    Operation,
    RuleFields,
    check_depth,
    check_tool,
    library_tool,
    names_for,
    parse_rule,
    rule_texts,
    rules_with_tools,
    with_rule,
)
from leafcut.read.tools import load_tools
from leafcut.report.wording import replace_unprintable
from leafcut.studio.jobs.task import Task, resolve_task
from leafcut.studio.page.elements import Form, box, link, text
from leafcut.studio.page.forms import plain_field
from leafcut.studio.page.page_state import View
from leafcut.units import parse_quantity

if TYPE_CHECKING:
    from leafcut.studio.page.pages import Page

#: Operations that a layer can have. A chamfer belongs to the operation that mills the edge.
_OPERATIONS = [operation for operation in Operation if operation is not Operation.CHAMFER]
#: Name of a file that the table has created.
_FILE = "operations.toml"


class LayersPanel:
    """The table of operations. Its value is the option `operations`, a file that command line and library can read."""

    def __init__(self, view: View, page: Page) -> None:
        self.view, self.page = view, page
        #: The open drawing, and the number of shapes of each kind on each of its layers.
        self._drawing: tuple[str, dict[str, dict[str, int]]] = ("", {})
        w = view.words
        with box("section", "operations", aria_label=w("layers.title")) as self.place:
            text("h3", w("layers.title"))
            self.form = Form(w, self._change)
            self.form.on_row(self._highlight)
            self.problem = text("p", "", "error small", role="status")
            with box("details", "built-in") as self.file:
                text("summary", w("layers.file"))
                self.content = text("pre", "", "small", tabindex="0", aria_label=w("layers.file"))
                self.download = link(w("layers.download"), "", "button small")

    def draw(self) -> None:
        """Show the rows, with the errors of their operations."""
        view, w = self.view, self.view.words
        if view.seen is not None and (view.seen.layers or self._drawing[0] != view.source):
            self._drawing = (view.source, view.seen.layers)
        layers = self._drawing[1]
        self.place.set_visibility(view.work == "part" and bool(layers))
        if view.work != "part" or not layers:
            return
        name, content = self._file()
        try:
            texts, problem = rule_texts(content, name), ""
        except DataError as refusal:
            texts, layers, problem = {}, {}, str(refusal)  # its table cannot be changed
        library, wrong = self._library()
        self.problem.set_text(w.translate_for_page(problem or wrong))
        drawn = {layer.lower() for layer in layers}
        absent = [name for name in texts if name.lower() not in drawn and not WILDCARDS.search(name)]
        groups: list[dict[str, Any]] = []
        values: dict[str, str] = {}
        errors: dict[str, str] = {}
        for layer in [*layers, *absent]:
            names = names_for(layer, texts)
            fields = RuleFields.split(texts[names[0]]) if names else RuleFields()
            groups.append(self._group(layer, layers.get(layer, {}), fields, library))
            values |= {f"{_key(layer)}.{key}": value for key, value in vars(fields).items()}
            line = w("layers.choose") if texts and not names else ""
            if names:
                line = self._problem(layer, texts[names[0]], library) if layer in layers else w("layers.absent")
            errors |= {f"{_key(layer)}.operation": line} if line else {}
        self.form.show(values, errors=errors, groups=groups)
        self.file.set_visibility(bool(content))
        self.content.set_text(content)
        self.download.props.update({"href": f"data:application/toml;charset=utf-8,{quote(content)}", "download": name})
        self.download.update()

    def _file(self) -> tuple[str, str]:
        """Return the name and the text of the file of operations."""
        entry = self.view.table.get("operations")
        if entry is None or not entry.value:
            return _FILE, ""
        try:
            path = self.view.studio.folder.input_path(str(entry.value))
            return path.name, path.read_text(encoding="utf-8-sig")
        except (LeafcutError, OSError, UnicodeDecodeError):
            return _FILE, ""  # the run reports the error

    def _library(self) -> tuple[ToolLibrary | None, str]:
        """Return the tool library, and why it cannot be read."""
        view = self.view
        values = {name: value for name, value in view.values.items() if name in ("tools", "machine", "material")}
        if "tools" not in values:
            return None, ""
        try:
            task = Task("optimize", (view.source,), "part", values)
            settings = collect_settings(resolve_task(task, view.studio.folder).options)
            units = load_machine(settings.machine.machine).units
            material = settings.job.material if "material" in settings.given else ""
            return load_tools(Path(str(settings.job.tools)), units, material), ""
        except LeafcutError as problem:
            return None, view.studio.folder.hide_paths(str(problem))

    def _group(
        self, layer: str, shapes: dict[str, int], fields: RuleFields, library: ToolLibrary | None
    ) -> dict[str, Any]:
        w = self.view.words
        name = replace_unprintable(layer) or w("layers.none")
        counts = ", ".join(w(f"layers.{kind}", number=number) for kind, number in shapes.items())
        known = [*_OPERATIONS, *({fields.operation} - {"", *_OPERATIONS})]
        choices = [
            ["", w("layers.unset" if self._file()[1] else "layers.unset_all")],
            *([str(word), w.item_name("layers", word, word)] for word in known),
        ]
        through, deep = fields.operation in THROUGH, fields.operation in DEEP
        shown = [("operation", "operation", choices)]
        tools = [[str(tool.number), replace_unprintable(tool.label)] for tool in (library.tools if library else ())]

        def offer(key: str, label: str, unset: str, prefix: str = "") -> None:
            number = getattr(fields, key)
            other = [[number, f"T{number}"]] if number and number not in dict(tools) else []
            shown.append((key, label, [["", w(unset)], *([word, prefix + tool] for word, tool in [*tools, *other])]))

        if deep or fields.operation == Operation.VCARVE or (through and (tools or fields.depth)):
            shown.append(("depth", "chamfer" if through else "depth", []))
            if tools or fields.tool or fields.operation == Operation.VCARVE:
                offer("tool", "tool", "layers.end_mill" if deep else "layers.v_bit")
        if fields.second or (fields.tool and fields.operation in (Operation.POCKET, Operation.VCARVE) and tools):
            label = "rest" if fields.operation == Operation.POCKET else "flat"
            offer("second", label, f"layers.no_{label}", f"{w(f'layers.{label}')} ")
        return {
            "key": _key(layer),
            "title": f"{name}: {counts}" if counts else name,
            "folded": False,
            "changed": 0,
            "fields": [
                plain_field(
                    f"{_key(layer)}.{key}",
                    f"{w(f'layers.{label}')}: {name}",
                    choices=choices,
                    unit="" if choices else "mm",
                    default=w(f"layers.{label}") if not choices else "",
                )
                for key, label, choices in shown
            ],
        }

    def _problem(self, layer: str, rule_text: Any, library: ToolLibrary | None) -> str:
        """Return why a rule is wrong, or an empty string."""
        view, w, place = self.view, self.view.words, printable(layer)
        try:
            rule = parse_rule(layer, rule_text, place)
            if "thickness" in view.values and "thickness" not in view.errors:
                check_depth(rule, parse_quantity(str(view.values["thickness"]), "mm"))
            main = str(view.values.get("tool_number") or 1)
            for one in rules_with_tools(rule.chamfer or rule):
                if one.tool is not None and (library is not None or str(one.tool) != main):
                    check_tool(one, library_tool(one, library))
        except LeafcutError as problem:
            line = w.translate(view.studio.folder.hide_paths(str(problem)))
            return w.translate_for_page(line.removeprefix(f"{place}: "))
        return ""

    def _change(self, name: str, value: str, __: str) -> Any:
        row, _, key = name.rpartition(".")
        layer = unquote(row)
        file, content = self._file()
        texts = rule_texts(content, file)
        names = names_for(layer, texts)
        fields = RuleFields.split(texts[names[0]]) if names else RuleFields()
        content = with_rule(content, layer, fields.changed(**{key: str(value)}).text)
        store = self.view.studio.folder.store_text
        return self.page.input.set_option("operations", store(file, content) if content else "", file)

    def _highlight(self, row: str) -> None:
        self.page.run.canvas.select_layer(replace_unprintable(unquote(row)) or None)

    def select_layer(self, layer: str) -> None:
        """Focus the row of a layer that the user has selected in the drawing."""
        for name in self._drawing[1]:
            if replace_unprintable(name) == layer:
                self.form.run_method("focusField", f"{_key(name)}.operation")


def _key(layer: str) -> str:
    """Return the key of a row, which may be part of an HTML id."""
    return quote(layer, safe="")
