"""Collect message templates from the source: the texts in calls, with ``{}`` for values that are known only at run
time.

A text is traced through names, conditions, loops over literals, and functions in the same file.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from itertools import islice, product
from pathlib import Path
from string import Formatter
from typing import NamedTuple

import sources

GAP = "{}"
#: Maximum number of templates from one expression.
MAX_TEMPLATES = 64
#: Functions whose return values are traced in the file that defines them.
TRACED_IMPORTS = frozenset({"in_unit_words"})
_Assignment = ast.Assign | ast.AnnAssign | ast.NamedExpr
_Function = ast.FunctionDef | ast.AsyncFunctionDef
#: Names and functions on the current path; each is traced only once, so that recursion ends.
_Path = frozenset[str]


class _Position(NamedTuple):
    """The block of statements (`id` of its list) that contains a node, and the line of the statement with the node in
    it.
    """

    block: int
    line: int


class MessageSource:
    """A Python file in which message texts are traced."""

    def __init__(self, file: Path) -> None:
        self.calls: list[tuple[str, ast.Call]] = []
        self.functions: dict[str, list[_Function]] = {}
        #: Imported name → file, for the names in `TRACED_IMPORTS`.
        self.imported: dict[str, Path] = {}
        #: Node → positions, innermost block first.
        self.positions: dict[ast.AST, tuple[_Position, ...]] = {}
        #: Name → statements that assign or extend it.
        self.assignments: dict[str, list[ast.AST]] = {}
        #: Block of a function's body → its parameters.
        self.parameters: dict[int, set[str]] = {}
        self._set_positions(sources.tree_of(file), ())
        for node in sources.nodes_of(file):
            self._index(node)

    def _index(self, node: ast.AST) -> None:
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        for name in {n.id for t in targets if t is not None for n in ast.walk(t) if isinstance(n, ast.Name)}:
            self.assignments.setdefault(name, []).append(node)
        if isinstance(node, ast.Call):
            self.calls.append((_called_name(node), node))
        elif isinstance(node, _Function):
            self.functions.setdefault(node.name, []).append(node)
            self.parameters[id(node.body)] = {arg.arg for arg in ast.walk(node.args) if isinstance(arg, ast.arg)}
        elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith("leafcut"):
            file = sources.PACKAGE.parent.joinpath(*str(node.module).split(".")).with_suffix(".py")
            self.imported |= {a.asname or a.name: file for a in node.names if a.name in TRACED_IMPORTS}

    def _set_positions(self, node: ast.AST, positions: tuple[_Position, ...]) -> None:
        for field, value in ast.iter_fields(node):
            is_block = isinstance(value, list) and field in ("body", "orelse", "finalbody")
            for child in value if isinstance(value, list) else (value,):
                if isinstance(child, ast.AST):
                    own = (_Position(id(value), child.lineno), *positions) if is_block else positions  # type: ignore[attr-defined]
                    self.positions[child] = own
                    self._set_positions(child, own)

    def of_argument(self, call: ast.Call, index: int) -> list[str]:
        """Return the templates of an argument; if it is a message, all later arguments fill its template."""
        match call.args[index:]:
            case [ast.Constant(value=str(template)), *values] if template.count(GAP[0]) >= len(values) > 0:
                return _joined(self._parts_of_message(template, iter(values), frozenset()))
        return self.templates(call.args[min(index, len(call.args) - 1)])

    def templates(self, node: ast.expr | None, path: _Path = frozenset()) -> list[str]:
        """Return the templates of an expression, with `GAP` for a value that cannot be traced."""
        match node:
            case ast.Constant(value=str(value)):
                return [value]
            case ast.JoinedStr(values=parts):
                return _joined([self._part_of_f_string(part, path) for part in parts])
            case ast.BinOp(left=left, op=ast.Add(), right=right):
                return _joined([self.templates(left, path), self.templates(right, path)])
            case ast.IfExp(body=body, orelse=orelse):
                return self.templates(body, path) + self.templates(orelse, path)
            case ast.BoolOp(values=values) | ast.Dict(values=values) | ast.Tuple(elts=values) | ast.List(elts=values):
                return [template for value in values for template in self.templates(value, path)]
            case ast.Subscript(value=ast.Dict() | ast.Tuple() | ast.List() as table):
                return self.templates(table, path)
            case ast.Subscript(value=ast.Constant(value=str(value)), slice=ast.Slice()):
                return ["", value]
            case ast.Subscript(value=ast.Name(id=name) as table) if name.isupper():
                return self._of_name(table, name, path)
            case ast.Name(id=name):
                return self._of_name(node, name, path)
            case ast.Call(func=ast.Attribute(value=text, attr="format" | "rstrip")):
                return [re.sub(r"\{\w+(:[^}]*)?\}", GAP, template) for template in self.templates(text, path)]
            case ast.Call(func=ast.Name(id="Message"), args=[ast.Constant(value=str(template)), *values]):
                return _joined(self._parts_of_message(template, iter(values), path))
            case ast.Call():
                return self._returned(_called_name(node), path)
        return [GAP]

    def _part_of_f_string(self, part: ast.expr, path: _Path) -> list[str]:
        if not isinstance(part, ast.FormattedValue):
            return self.templates(part, path)
        if part.format_spec is not None or part.conversion != -1:
            return [GAP]
        return self._in_gap(part.value, path)

    def _parts_of_message(self, template: str, values: Iterator[ast.expr], path: _Path) -> Iterator[list[str]]:
        for literal, name, form, conversion in Formatter().parse(template):
            yield [literal]
            if name is not None:
                value = next(values)
                yield [GAP] if form or conversion else self._in_gap(value, path)

    def _in_gap(self, value: ast.expr, path: _Path) -> list[str]:
        templates = self.templates(value, path)
        return [GAP] if GAP in templates else templates

    def _of_name(self, node: ast.Name, name: str, path: _Path) -> list[str]:
        """Return the templates of a name at a node, from its last assignment before the node and later additions."""
        if (key := f"{name}:{node.lineno}") in path:
            return [GAP]
        path |= {key}
        for block, line in self.positions.get(node, ()):
            lines = {
                statement: dict(self.positions[statement])[block]
                for statement in self.assignments.get(name, [])
                if block in dict(self.positions[statement])
            }
            before = [statement for statement in lines if lines[statement] < line]
            in_block = [
                lines[statement]
                for statement in before
                if self.positions[statement][0].block == block and isinstance(statement, _Assignment)
            ]
            if in_block:
                return self._assigned([s for s in before if lines[s] >= max(in_block)], name, block, path)
            loops = [statement for statement in lines if isinstance(statement, ast.For)]
            if before or loops:
                return self._assigned(before or loops, name, block, path)
            if name in self.parameters.get(block, ()):
                break
        return [GAP]

    def _assigned(self, statements: list[ast.AST], name: str, block: int, path: _Path) -> list[str]:
        starts: list[str] = []
        additions: list[list[str]] = []
        for statement in sorted(statements, key=lambda s: self.positions[s][0].line):
            match statement:
                case ast.AugAssign(value=value):
                    is_optional = self.positions[statement][0].block != block
                    additions.append([*self.templates(value, path), *([""] if is_optional else [])])
                case ast.Assign(targets=[target, *_], value=value) | ast.AnnAssign(target=target, value=value):
                    starts += self._of_target(target, value, name, path)
                case ast.NamedExpr(value=value):
                    starts += self.templates(value, path)
                case ast.For(target=target, iter=ast.Tuple(elts=values) | ast.List(elts=values)):
                    starts += [template for value in values for template in self._of_target(target, value, name, path)]
        return _joined([starts or [GAP], *additions])

    def _of_target(self, target: ast.expr, value: ast.expr | None, name: str, path: _Path) -> list[str]:
        """Return the templates of a name in the target of an assignment such as ``head, tail = …``."""
        match target, value:
            case ast.Tuple(elts=targets), ast.Tuple(elts=values):
                pairs = [(t, v) for t, v in zip(targets, values, strict=True) if isinstance(t, ast.Name)]
                return [template for t, v in pairs if t.id == name for template in self.templates(v, path)]
            case ast.Tuple(), ast.IfExp(body=body, orelse=orelse):
                return self._of_target(target, body, name, path) + self._of_target(target, orelse, name, path)
            case ast.Tuple(), _:
                return [GAP]
        return self.templates(value, path)

    def _returned(self, name: str, path: _Path) -> list[str]:
        """Return the templates that a function in this file, or in `TRACED_IMPORTS`, returns or yields."""
        if name in path:
            return [GAP]
        if name not in self.functions:
            file = self.imported.get(name)
            return message_source(file)._returned(name, path) if file is not None else [GAP]
        nodes = [node for function in self.functions[name] for node in ast.walk(function)]
        values = [node.value for node in nodes if isinstance(node, ast.Return | ast.Yield) and node.value is not None]
        return [template for value in values for template in self.templates(value, path | {name})] or [GAP]


@cache
def message_source(file: Path) -> MessageSource:
    """Return the `MessageSource` of a file, which is read only once."""
    return MessageSource(file)


def message_lines(calls: Mapping[str, tuple[int, ...]], files: Iterable[Path]) -> dict[str, str]:
    """Return the templates in the arguments of certain calls, each with its position in the source.

    `calls` maps the name of a function to the indices of the arguments; several arguments are joined as ``{}: {}``. An
    index beyond the last argument means the last argument, as in an error that has only a message.

    Raises ValueError if a function is never called, because it was probably renamed and its messages would be missed.
    """
    found: dict[str, str] = {}
    unseen = set(calls)
    has_call = re.compile(rf"\b(?:{'|'.join(calls)})\(")
    for file in files:
        if not has_call.search(sources.text_of(file)):
            continue
        source = message_source(file)
        for name, call in source.calls:
            if name not in calls or not call.args:
                continue
            unseen.discard(name)
            texts = [source.of_argument(call, index) for index in calls[name]]
            for parts in product(*texts):
                if re.search(r"[a-z]{2}", line := ": ".join(parts)) and not line.startswith(": "):
                    found[line] = sources.place(file, call.lineno)
    if unseen:
        raise ValueError(f"no call of {', '.join(sorted(unseen))}")
    return found


def texts_of(file: Path) -> Iterator[str]:
    """Yield every text in a file as a template."""
    for node in sources.nodes_of(file):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield re.sub(r"\{[!:][^{}]*\}", GAP, node.value)  # a message may specify the formats of its values
        elif isinstance(node, ast.JoinedStr):
            yield "".join(str(part.value) if isinstance(part, ast.Constant) else GAP for part in node.values)


def _called_name(node: ast.Call) -> str:
    return node.func.id if isinstance(node.func, ast.Name) else getattr(node.func, "attr", "")


def _joined(parts: Iterable[list[str]]) -> list[str]:
    """Return all concatenations of one template from each part, but at most `MAX_TEMPLATES`."""
    return ["".join(combination) for combination in islice(product(*parts), MAX_TEMPLATES)]
