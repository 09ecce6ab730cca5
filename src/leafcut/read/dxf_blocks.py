"""Visit every shape in the model space of a DXF document, including the shapes in blocks.

Blocks can be placed, scaled, rotated, mirrored and arrayed. The code examines each block once. After that, each
insertion visits only the requested shapes (holes or strokes), so a large block of lines costs no time when only holes
are read. Nested arrays that exceed the budget of visits raise an error.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any, Generic, NamedTuple, TypeVar

from leafcut.errors import printable
from leafcut.message import Message, map_text
from leafcut.read.dxf_shapes import IDENTITY, Matrix, combine_transforms, transform_direction
from leafcut.read.format import ReadBudget

#: Shape created from an entity. The type must have a `layer` attribute with the layer of the entity.
S = TypeVar("S")

MAX_DEPTH = 32
#: Key of invisible entities in the counts of hidden layers; no layer name contains a line end.
INVISIBLE = "\n"


class Insertion(NamedTuple):
    """An INSERT entity. It has a block, a matrix and a layer, and the count and step of its array in each direction."""

    block: str
    matrix: Matrix
    layer: str
    steps: tuple[tuple[int, tuple[float, float, float]], tuple[int, tuple[float, float, float]]]


@dataclass
class Content(Generic[S]):
    """The contents of a layout or a block, in its own coordinates."""

    items: list[S | Insertion] = field(default_factory=list)
    #: Entities that give no shape, by (type, layer).
    others: Counter[tuple[str, str]] = field(default_factory=Counter)
    #: Entities with missing or invalid numbers, as (type, handle, error).
    broken: list[tuple[str, str, str]] = field(default_factory=list)
    invisible: int = 0


@dataclass
class LayerFilter:
    """Decides which layers to read, based on frozen layers, layers that are off, and the user's choice of layers."""

    frozen: set[str]
    off: set[str]
    chosen: Callable[[str], bool]
    _known: dict[str, bool] = field(default_factory=dict)

    def shows(self, layer: str) -> bool:
        """Return whether the entities on this layer are read."""
        visible = self._known.get(layer)
        if visible is None:
            name = layer.casefold()
            visible = name not in self.frozen and name not in self.off and self.chosen(layer)
            self._known[layer] = visible
        return visible

    def freezes(self, layer: str) -> bool:
        """Return whether an INSERT on this layer hides its block.

        Only a frozen layer hides it, not a layer that is off.
        """
        return layer.casefold() in self.frozen


@dataclass
class BlockWalk(Generic[S]):
    """Visits every shape of model space once per insertion, and counts skipped entities.

    `shape_of` converts an ezdxf entity to a shape. It returns None for an entity that is not needed, and raises
    ValueError for a damaged entity.
    """

    document: Any
    copies: ReadBudget
    layers: LayerFilter
    shape_of: Callable[[Any], S | None]
    shape_name: str
    #: Counts of skipped items: other entities by type, hidden entities by layer, unusable INSERTs by block.
    others: Counter[str] = field(default_factory=Counter)
    hidden: Counter[str] = field(default_factory=Counter)
    missing_blocks: Counter[str] = field(default_factory=Counter)
    endless_blocks: Counter[str] = field(default_factory=Counter)
    broken: list[tuple[str, str, str]] = field(default_factory=list)
    _contents: dict[str, Content[S] | None] = field(default_factory=dict)
    _with_shapes: set[str] = field(default_factory=set)
    _weights: dict[str, int] = field(default_factory=dict)
    _counted: set[int] = field(default_factory=set)

    def shapes(self) -> Iterator[tuple[S, Matrix, str]]:
        """Yield every visible shape with its matrix and effective layer, in file order.

        Raises
        ------
        ReadError
            The insertions exceed the budget `copies`.
        """
        top = read_layout_content(self.document.modelspace(), self.shape_of)
        self._scan_blocks(top)
        # Check before the walk: a few lines of nested arrays can ask for a billion holes.
        self.copies.check(self._count_entities_in(top, ()))
        yield from self._shapes_in_content(top, IDENTITY, None, ())

    def _scan_blocks(self, top: Content[S]) -> None:
        """Read every block that model space can reach, and mark the blocks that lead to a shape.

        The other blocks do not need to be visited.
        """
        parents: dict[str, set[str]] = {}
        waiting = [("", top)]
        fruitful = []
        while waiting:
            name, content = waiting.pop()
            if any(not isinstance(item, Insertion) for item in content.items):
                fruitful.append(name)
            for block in {item.block for item in content.items if isinstance(item, Insertion)}:
                parents.setdefault(block, set()).add(name)
                if block not in self._contents:
                    layout = self.document.blocks.get(block) if block else None
                    # An external reference (flag 4) is empty, and its drawing must not be opened.
                    absent = layout is None or layout.block.dxf.get("flags", 0) & 4
                    inner = self._contents[block] = None if absent else read_layout_content(layout, self.shape_of)
                    if inner is not None:
                        waiting.append((block, inner))
        while fruitful:
            name = fruitful.pop()
            if name not in self._with_shapes:
                self._with_shapes.add(name)
                fruitful.extend(parents.get(name, ()))

    def _count_visited_entities(self, name: str, trail: tuple[str, ...]) -> int:
        """Count the entities that an insertion of a block visits, including the entities of nested blocks.

        Return 0 if the insertion is not expanded.
        """
        content = self._contents[name]
        if content is None or name not in self._with_shapes or name in trail or len(trail) >= MAX_DEPTH:
            return 0
        if name not in self._weights:
            self._weights[name] = self._count_entities_in(content, (*trail, name))
        return self._weights[name]

    def _count_entities_in(self, content: Content[S], trail: tuple[str, ...]) -> int:
        weight = 1
        for item in content.items:
            if isinstance(item, Insertion):
                (columns, _), (rows, _) = item.steps
                weight += rows * columns * self._count_visited_entities(item.block, trail)
            else:
                weight += 1
        return weight

    def _shapes_in_content(
        self, content: Content[S], matrix: Matrix, inherited: str | None, trail: tuple[str, ...]
    ) -> Iterator[tuple[S, Matrix, str]]:
        self.copies(1)
        self._count_other_entities(content, inherited)
        for item in content.items:
            layer = _effective_layer(item.layer, inherited)  # type: ignore[union-attr]
            if isinstance(item, Insertion):
                yield from self._shapes_of_insertion(item, matrix, layer, trail)
                continue
            self.copies(1)
            if self.layers.shows(layer):
                yield item, matrix, layer
            else:
                self.hidden[layer] += 1

    def _count_other_entities(self, content: Content[S], inherited: str | None) -> None:
        """Count the entities of a block that are not shapes. A block counts only once, even if it is inserted again."""
        if id(content) in self._counted:
            return
        self._counted.add(id(content))
        for (kind, layer), number in content.others.items():
            if self.layers.shows(_effective_layer(layer, inherited)):
                self.others[kind] += number
        self.broken.extend(content.broken)
        if content.invisible:
            self.hidden[INVISIBLE] += content.invisible

    def _shapes_of_insertion(
        self, insertion: Insertion, matrix: Matrix, layer: str, trail: tuple[str, ...]
    ) -> Iterator[tuple[S, Matrix, str]]:
        name = insertion.block
        content = self._contents[name]
        if content is None:
            self.missing_blocks[name or "without a name"] += 1
        elif name not in self._with_shapes:
            self.others[f"INSERT without {self.shape_name}"] += 1
        elif self.layers.freezes(layer):
            self.hidden[layer] += 1
        elif name in trail or len(trail) >= MAX_DEPTH:
            self.endless_blocks[name] += 1
        else:
            (columns, step_x), (rows, step_y) = insertion.steps
            block_matrix = combine_transforms(matrix, insertion.matrix)
            step_x, step_y = transform_direction(matrix, step_x), transform_direction(matrix, step_y)
            for row in range(rows):
                for column in range(columns):
                    shift = tuple(column * a + row * b for a, b in zip(step_x, step_y, strict=True))
                    origin = (
                        block_matrix[3][0] + shift[0],
                        block_matrix[3][1] + shift[1],
                        block_matrix[3][2] + shift[2],
                    )
                    yield from self._shapes_in_content(content, (*block_matrix[:3], origin), layer, (*trail, name))


def _effective_layer(layer: str, inherited: str | None) -> str:
    """Return the effective layer of an entity. Entities on layer 0 of a block take the layer of the INSERT."""
    return inherited if layer == "0" and inherited is not None else layer


def read_layout_content(layout: Any, shape_of: Callable[[Any], S | None]) -> Content[S]:
    """Read the contents of an ezdxf layout, examining each entity only once."""
    content: Content[S] = Content()
    for entity in layout:
        kind, dxf = entity.dxftype(), entity.dxf
        # `dxf.get` raises for attributes unknown to a damaged entity.
        layer = dxf.layer if dxf.hasattr("layer") else "0"
        if dxf.hasattr("invisible") and dxf.invisible:
            content.invisible += 1
            continue
        try:
            shape = _parse_insertion(entity) if kind == "INSERT" else shape_of(entity)
        except (ArithmeticError, ValueError, TypeError, AttributeError) as problem:
            handle = dxf.handle if dxf.hasattr("handle") else ""
            content.broken.append((kind, handle or "", map_text(str(problem), printable)))
            continue
        if shape is None or (kind == "POINT" and layer.casefold() == "defpoints"):
            # Points on Defpoints belong to dimensions; CAD programs create but never plot them.
            content.others[kind, layer] += 1
        else:
            content.items.append(shape)
    return content


def _parse_insertion(entity: Any) -> Insertion:
    dxf = entity.dxf
    if not dxf.hasattr("insert"):
        raise ValueError(Message("no insertion point"))
    rows = entity.matrix44().rows()
    matrix = tuple((float(r[0]), float(r[1]), float(r[2])) for r in rows)
    numbers = [v for row in matrix for v in row]
    angle = math.radians(dxf.get("rotation", 0.0))
    right, up = dxf.get("column_spacing", 0.0), dxf.get("row_spacing", 0.0)
    if not all(math.isfinite(v) for v in (*numbers, angle, right, up)):
        raise ValueError(Message("a number that is not finite"))
    ocs = entity.ocs()
    # The INSERT rotates the array, but does not scale it (as in AutoCAD and ezdxf). With a spacing of 0, all copies
    # coincide, and a single copy is enough.
    x = ocs.to_wcs((right * math.cos(angle), right * math.sin(angle), 0.0))
    y = ocs.to_wcs((-up * math.sin(angle), up * math.cos(angle), 0.0))
    columns = max(1, dxf.get("column_count", 1)) if right else 1
    rows_ = max(1, dxf.get("row_count", 1)) if up else 1
    steps = ((columns, (x[0], x[1], x[2])), (rows_, (y[0], y[1], y[2])))
    return Insertion(dxf.get("name") or "", (matrix[0], matrix[1], matrix[2], matrix[3]), dxf.get("layer", "0"), steps)
