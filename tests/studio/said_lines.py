"""The lines that leafcut says, taken from its source: with `{}` for what is filled in."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Mapping
from functools import cache
from itertools import islice, product
from pathlib import Path

GAP = "{}"
#: A line that may be made in more ways is looked up in so many.
_MOST_WAYS = 64
#: Functions that return how a line of another file ends: only these are followed into theirs.
_ENDINGS = frozenset({"in_unit_words"})
_SETS = ast.Assign | ast.AnnAssign | ast.NamedExpr
_Function = ast.FunctionDef | ast.AsyncFunctionDef
_Seen = frozenset[str]
_Places = tuple[tuple[int, int], ...]


class Source:
    """One file of the source, in which what is said is followed back: through names, conditions and functions."""

    def __init__(self, file: Path) -> None:
        self.tree = ast.parse(file.read_text(encoding="utf-8"))
        self.functions: dict[str, list[_Function]] = {}
        #: Functions of our own files that end lines of others, by name.
        self.imported = {
            name.asname or name.name: Path(
                file.parts[0], *file.parts[1 : file.parts.index("leafcut")], *room.split(".")
            ).with_suffix(".py")
            for node in ast.walk(self.tree)
            if isinstance(node, ast.ImportFrom) and (room := node.module or "").startswith("leafcut")
            for name in node.names
            if name.name in _ENDINGS
        }
        #: Node → the blocks that it stands in, the innermost first, each with the line of its statement there.
        self.places: dict[ast.AST, _Places] = {}
        #: Name → what sets it, or adds to it; and the parameters of functions by the block of their bodies.
        self.setting: dict[str, list[ast.AST]] = {}
        self.parameters: dict[int, set[str]] = {}
        self._calls: list[tuple[str, ast.Call]] = []
        self._place(self.tree, ())
        for node in ast.walk(self.tree):
            if isinstance(node, ast.Call):
                self._calls.append((_called(node), node))
            targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
            for name in {n.id for t in targets if t is not None for n in ast.walk(t) if isinstance(n, ast.Name)}:
                self.setting.setdefault(name, []).append(node)
            if isinstance(node, _Function):
                self.functions.setdefault(node.name, []).append(node)
                self.parameters[id(node.body)] = {one.arg for one in ast.walk(node.args) if isinstance(one, ast.arg)}

    def _place(self, node: ast.AST, places: _Places) -> None:
        """Note of all that a node is made of in which blocks it stands."""
        for name, value in ast.iter_fields(node):
            block = isinstance(value, list) and name in ("body", "orelse", "finalbody")
            for inner in value if isinstance(value, list) else (value,):
                if isinstance(inner, ast.AST):
                    there = ((id(value), inner.lineno), *places) if block else places  # type: ignore[attr-defined]
                    self.places[inner] = there
                    self._place(inner, there)

    def calls(self) -> list[tuple[str, ast.Call]]:
        """Return every call with the name of what is called."""
        return self._calls

    def lines(self, node: ast.expr | None, seen: _Seen = frozenset()) -> list[str]:
        """Return every line that an expression may be; ``{}`` where it is made elsewhere."""
        match node:
            case ast.Constant(value=str(value)):
                return [value]
            case ast.JoinedStr(values=parts):
                return _joined([self._filled(part, seen) for part in parts])
            case ast.BinOp(left=left, op=ast.Add(), right=right):
                return _joined([self.lines(left, seen), self.lines(right, seen)])
            case ast.IfExp(body=one, orelse=other):
                return self.lines(one, seen) + self.lines(other, seen)
            case ast.BoolOp(values=values) | ast.Dict(values=values) | ast.Tuple(elts=values) | ast.List(elts=values):
                return [line for value in values for line in self.lines(value, seen)]
            case ast.Subscript(value=ast.Dict() | ast.Tuple() | ast.List() as table):
                return self.lines(table, seen)
            case ast.Subscript(value=ast.Constant(value=str(value)), slice=ast.Slice()):
                return ["", value]
            case ast.Subscript(value=ast.Name(id=name) as table) if name.isupper():
                return self._named(table, name, seen)
            case ast.Name(id=name):
                return self._named(node, name, seen)
            case ast.Call(func=ast.Attribute(value=text, attr="format" | "rstrip")):
                return [re.sub(r"\{\w+(:[^}]*)?\}", GAP, line) for line in self.lines(text, seen)]
            case ast.Call():
                return self._returned(_called(node), seen)
        return [GAP]

    def _filled(self, part: ast.expr, seen: _Seen) -> list[str]:
        """Return what stands in a text with gaps: itself, or what is known of what fills a gap."""
        if isinstance(part, ast.FormattedValue):
            lines = self.lines(part.value, seen) if part.format_spec is None and part.conversion == -1 else [GAP]
            return lines if GAP not in lines else [GAP]
        return self.lines(part, seen)

    def _named(self, node: ast.AST, name: str, seen: _Seen) -> list[str]:
        """Return what a name stands for at a node: what it was last set to, and that with what was added to it."""
        if (key := f"{name}:{node.lineno}") in seen:  # type: ignore[attr-defined]
            return [GAP]
        seen |= {key}
        for block, line in self.places.get(node, ()):
            at = {
                one: dict(self.places[one])[block]
                for one in self.setting.get(name, [])
                if block in dict(self.places[one])
            }
            before = [one for one in at if at[one] < line]
            own = [at[one] for one in before if self.places[one][0][0] == block and isinstance(one, _SETS)]
            if own:
                return self._set([one for one in before if at[one] >= max(own)], name, block, seen)
            looped = [one for one in at if isinstance(one, ast.For)]
            if before or looped:
                return self._set(before or looped, name, block, seen)
            if name in self.parameters.get(block, ()):
                break
        return [GAP]

    def _set(self, ways: list[ast.AST], name: str, block: int, seen: _Seen) -> list[str]:
        bases: list[str] = []
        added: list[list[str]] = []
        for one in sorted(ways, key=lambda one: self.places[one][0][1]):
            match one:
                case ast.AugAssign(value=value):
                    always = self.places[one][0][0] == block
                    added.append([*self.lines(value, seen), *([] if always else [""])])
                case ast.Assign(targets=[target, *_], value=value) | ast.AnnAssign(target=target, value=value):
                    bases += self._part(target, value, name, seen)
                case ast.NamedExpr(value=value):
                    bases += self.lines(value, seen)
                case ast.For(target=target, iter=ast.Tuple(elts=values) | ast.List(elts=values)):
                    bases += [line for value in values for line in self._part(target, value, name, seen)]
        return _joined([bases or [GAP], *added])

    def _part(self, target: ast.expr, value: ast.expr | None, name: str, seen: _Seen) -> list[str]:
        """Return what a name is set to that may stand beside others: ``what, text = …``."""
        match target, value:
            case ast.Tuple(elts=targets), ast.Tuple(elts=values):
                pairs = [(one, v) for one, v in zip(targets, values, strict=True) if isinstance(one, ast.Name)]
                return [line for one, v in pairs if one.id == name for line in self.lines(v, seen)]
            case ast.Tuple(), ast.IfExp(body=one, orelse=other):
                return self._part(target, one, name, seen) + self._part(target, other, name, seen)
            case ast.Tuple(), _:
                return [GAP]
        return self.lines(value, seen)

    def _returned(self, name: str, seen: _Seen) -> list[str]:
        """Return the lines that a function may return, of the same file or one that this file imports."""
        if name in seen:
            return [GAP]
        if name not in self.functions:
            file = self.imported.get(name)
            return source_of(file)._returned(name, seen) if file is not None and file.is_file() else [GAP]
        told = [node for function in self.functions[name] for node in ast.walk(function)]
        made = [node.value for node in told if isinstance(node, ast.Return | ast.Yield) and node.value is not None]
        return [line for value in made for line in self.lines(value, seen | {name})] or [GAP]


@cache
def source_of(file: Path) -> Source:
    """Return a file of the source as it was read before."""
    return Source(file)


def _called(node: ast.Call) -> str:
    return node.func.id if isinstance(node.func, ast.Name) else getattr(node.func, "attr", "")


def _joined(parts: Iterable[list[str]]) -> list[str]:
    """Return every way to put one of each part behind each other."""
    return ["".join(way) for way in islice(product(*parts), _MOST_WAYS)]


def said(kinds: Mapping[str, tuple[int, ...]], files: Iterable[Path]) -> dict[str, Path]:
    """Return the lines that calls of some names say, with the file of each.

    `kinds` names the arguments that are said; several are joined as ``{}: {}``. Where there are fewer it is the last:
    an error that is given its message alone.
    """
    found: dict[str, Path] = {}
    for file in files:
        source = source_of(file)
        for name, call in source.calls():
            if name not in kinds or not call.args:
                continue
            texts = [source.lines(call.args[min(place, len(call.args) - 1)]) for place in kinds[name]]
            for parts in product(*texts):
                if re.search(r"[a-z]{2}", line := ": ".join(parts)) and not line.startswith(": "):
                    found[line] = file
    return found
