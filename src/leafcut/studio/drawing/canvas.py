"""The drawing and the charts as elements of a NiceGUI page.

The modules in ``static`` do the work in the browser and know nothing of NiceGUI. What is drawn does not go through the
page's connection: an element tells the browser an address, where it fetches the bytes of a scene
(`studio.drawing.scene`).

    drawing = Canvas(on_select=lambda e: print(e.args))
    drawing.show(part_scene(outcome.part), "part")
    drawing.show(outcome_scene(outcome, "after"), "after")

Import it only where the studio runs: NiceGUI is an extra. The page must have the report's colours as CSS variables.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Self

from nicegui.dependencies import register_esm
from nicegui.element import Element
from nicegui.events import GenericEventArguments

from leafcut.errors import OptionError
from leafcut.studio.drawing.serving import Serving

STATIC = Path(__file__).parents[1] / "static"

#: The stock with the moves before and after (`studio.drawing.solid`): fetched only when it is to be seen.
SOLIDS = ("solid_before", "solid_after")
#: What can be shown; ``whole`` is all of the drawing, faintly; ``live`` is a path that moves, or an order that is
#: changed by hand; ``differences`` are those of two programs (`studio.drawing.differences`).
LAYERS = ("whole", "part", "before", "after", "pheromone", "live", "differences", *SOLIDS)

#: Seconds between two events of the pointer or of playing.
_PACE = 0.1

Handler = Callable[[GenericEventArguments], Any]
#: A scene, or what makes it when the browser asks for it.
Shown = bytes | Callable[[], bytes]

# With the newest file's time in their address, so that browsers keep the modules and still notice new ones.
register_esm("leafcut-canvas", STATIC, max_time=max(file.stat().st_mtime for file in STATIC.glob("*.*")))


class Canvas(Serving, component="../static/canvas_element.js"):
    """The drawing.

    Parameters
    ----------
    words
        In place of the English ones of ``static/words.js``, by the same keys.
    layers
        Which layers are on at first, by the names of ``static/toolbar.js``.
    editable
        Whether pierces and stops can be dragged.
    on_hover, on_select, on_time, on_drag
        Told of what the pointer is on, what was selected (``row``, ``hole`` from 0, ``line``, ``stop`` from 1), where
        playing is (``time`` in s, None when all is shown; ``row``, ``line``), and what was dragged (``what``: order or
        pierce; ``number`` from 1, ``from`` and ``to`` in mm, ``onto``: number of a stop or None).
    on_origin
        Told to where program zero was dragged: ``x`` and ``y``, mm from where it was.
    """

    def __init__(
        self,
        *,
        words: Mapping[str, str] | None = None,
        layers: Mapping[str, bool] | None = None,
        editable: bool = False,
        on_hover: Handler | None = None,
        on_select: Handler | None = None,
        on_time: Handler | None = None,
        on_drag: Handler | None = None,
        on_origin: Handler | None = None,
    ) -> None:
        super().__init__()
        #: The scenes by layer, the number of each, and the address where the browser fetches it. The address of a layer
        #: stays: a browser that is late gets what is newest.
        self._scenes: dict[str, Shown] = {}
        self._numbers: dict[str, int] = {}
        self._addresses: dict[str, str] = {}
        self.props.update(
            words=dict(words or {}), layers=dict(layers or {}), editable=editable, scenes={}, placement={}
        )
        for name, handler in (("select", on_select), ("drag", on_drag), ("origin", on_origin)):
            if handler is not None:
                self.on(name, handler)
        for name, handler in (("hover", on_hover), ("time", on_time)):
            if handler is not None:
                self.on(name, handler, throttle=_PACE)

    def show(self, scene: Shown, layer: str) -> None:
        """Show a scene as one of `LAYERS`, in place of what was there; a callable is called in a thread.

        Raises
        ------
        OptionError
            There is no such layer.
        """
        if layer not in LAYERS:
            raise OptionError(f"the drawing has no layer '{layer}'; there are: {', '.join(LAYERS)}")
        if layer not in self._addresses:
            self._addresses[layer] = self.serve(layer, lambda: self._bytes(layer))
        self._scenes[layer] = scene
        self._numbers[layer] = self._numbers.get(layer, 0) + 1
        self._tell()

    def _bytes(self, layer: str) -> bytes | None:
        scene = self._scenes.get(layer)
        return scene() if callable(scene) else scene

    def clear(self) -> Self:
        """Take everything off."""
        self._scenes.clear()
        self._tell()
        return self

    def hide(self, layer: str) -> None:
        """Take one layer off."""
        if self._scenes.pop(layer, None) is not None:
            self._tell()

    def set_editable(self, editable: bool) -> None:
        """Let pierces and stops be dragged, or not."""
        self.props["editable"] = editable
        self.update()

    def set_placement(self, travel: Mapping[str, Any] | None, *, movable: bool) -> None:
        """Say how far the machine goes (``box``, ``known``, ``fits``, ``machine``), and whether zero can be dragged."""
        placement = {"travel": dict(travel) if travel else None, "movable": movable}
        if placement != self.props["placement"]:
            self.props["placement"] = placement
            self.update()

    def fit(self) -> None:
        """Show all of it."""
        self.run_method("fit")

    def select(self, row: int | None) -> None:
        """Select a row of the toolpath (of the scene's), and move to it; None selects nothing."""
        self.run_method("select", row)

    def select_hole(self, hole: int) -> None:
        """Select a hole of the part, by its index."""
        self.run_method("selectHole", hole)

    def select_stop(self, stop: int) -> None:
        """Select a stop of the order that is changed, by its number in the toolpath from 1; nothing is told of that."""
        self.run_method("selectStop", stop)

    def select_difference(self, index: int) -> None:
        """Select a difference of two programs, by its index, and move to where it is."""
        self.run_method("selectDifference", index)

    def show_line(self, line: int) -> None:
        """Select what a line of the program does, and move to it."""
        self.run_method("showLine", line)

    def set_tool(
        self, place: tuple[float, float] | None, *, cuts: bool = False, going_to: tuple[float, float] | None = None
    ) -> None:
        """Show where the machine really is, mm in the program's coordinates; None for not at all.

        `cuts` fills its ring, `going_to` is the hole that comes next.
        """
        tool = None if place is None else {"x": place[0], "y": place[1], "cuts": cuts, "next": going_to}
        self.run_method("setTool", tool)

    def play(self, rate: float = 1.0) -> None:
        """Play at so many machine seconds in a second."""
        self.run_method("play", rate)

    def pause(self) -> None:
        """Stop playing."""
        self.run_method("pause")

    def seek(self, seconds: float | None) -> None:
        """Go to a machine time; None shows everything."""
        self.run_method("seek", seconds)

    def _tell(self) -> None:
        self.props["scenes"] = {
            layer: f"{self._addresses[layer]}?{self._numbers[layer]}" for layer in LAYERS if layer in self._scenes
        }
        self.update()

    def _handle_delete(self) -> None:
        self._scenes.clear()
        super()._handle_delete()


class Convergence(Element, component="../static/chart_element.js"):
    """Cost against the time of a search, with the lower bound."""

    def __init__(self, *, words: Mapping[str, str] | None = None) -> None:
        super().__init__()
        self.props.update(kind="Convergence", words=dict(words or {}), data=None)

    def set(
        self, history: Sequence[tuple[float, float]], bound: float | None = None, unit: str = "s", now: float = 0.0
    ) -> None:
        """Show a search so far: (seconds, cost) at every improvement, the bound, and for how long it has run, s."""
        self.props["data"] = {"history": [list(point) for point in history], "bound": bound, "unit": unit, "now": now}
        self.update()


class Bars(Element, component="../static/chart_element.js"):
    """A bar for every worker."""

    def __init__(self) -> None:
        super().__init__()
        self.props.update(kind="Bars", words={}, data=[])

    def set(self, rows: Sequence[Mapping[str, Any]]) -> None:
        """Show rows with ``name``, ``value``, ``note`` and ``best``."""
        self.props["data"] = [dict(row) for row in rows]
        self.update()


class Brightness(Element, component="../static/chart_element.js"):
    """How bright every firefly is."""

    def __init__(self, *, words: Mapping[str, str] | None = None) -> None:
        super().__init__()
        self.props.update(kind="Brightness", words=dict(words or {}), data=[])

    def set(self, values: Sequence[float]) -> None:
        """Show brightnesses, the largest of them as the full height."""
        self.props["data"] = [float(value) for value in values]
        self.update()
