"""The drawing, as an element of a NiceGUI page.

NiceGUI is an extra, so only the studio imports this module. The modules in ``static`` draw in the browser and do not
depend on NiceGUI. Scenes (`studio.drawing.scene`) are not sent over the page's connection. Instead, the element sends
an address, and the browser downloads the bytes from this address. The page must include ``drawing.css`` and define the
colours of the report as CSS variables.
"""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Self

from nicegui import __version__ as nicegui_version
from nicegui.dependencies import dynamic_resources, register_dynamic_resource, register_esm
from nicegui.element import Element
from nicegui.events import GenericEventArguments
from starlette.responses import Response

from leafcut.errors import OptionError

STATIC = Path(__file__).parents[1] / "static"

#: Layers with the stock before and after the moves (`studio.drawing.solid`). The browser downloads them only when they
#: are visible.
SOLIDS = ("solid_before", "solid_after")
#: All layers. ``whole`` shows the entire drawing faintly. ``live`` shows the path of a running search, or an order that
#: the user edits. ``differences`` shows how two programs differ (`studio.drawing.differences`).
LAYERS = ("whole", "part", "before", "after", "pheromone", "live", "differences", *SOLIDS)

Handler = Callable[[GenericEventArguments], Any]
#: A scene, or a function that creates the scene when the browser requests it.
Shown = bytes | Callable[[], bytes]

# The address contains the time of the newest file, so that browsers cache the modules but notice changes.
register_esm("leafcut-canvas", STATIC, max_time=max(file.stat().st_mtime for file in STATIC.glob("*.*")))

#: Time for which the data of an element remain available after its removal, s.
_FAREWELL = 30.0


class DataServer(Element):
    """An element that serves data at secret addresses. The addresses expire when the element is removed."""

    def __init__(self) -> None:
        super().__init__()
        self._served: list[str] = []

    def serve(self, kind: str, source: Callable[[], bytes | None]) -> str:
        """Return an address that serves the bytes of `source`.

        `source` is called in a thread. If it returns None, the browser receives 204 No Content.
        """
        name = f"leafcut-{kind}-{secrets.token_urlsafe(12)}"

        def answer() -> Response:
            data = source()
            return Response(status_code=204) if data is None else Response(data, media_type="application/octet-stream")

        register_dynamic_resource(name, answer)
        self._served.append(name)
        return f"/_nicegui/{nicegui_version}/dynamic_resources/{name}"

    def _handle_delete(self) -> None:
        # A page may have requested the data of an element just before its removal.
        try:
            asyncio.get_running_loop().call_later(_FAREWELL, self._end_serving)
        except RuntimeError:
            self._end_serving()
        super()._handle_delete()

    def _end_serving(self) -> None:
        for name in self._served:
            dynamic_resources.pop(name, None)


class Canvas(DataServer, component="../static/canvas_element.js"):
    """The drawing of a part and its toolpaths.

    Parameters
    ----------
    words
        Texts of the drawing by key.
    layers
        Layers that are visible at first, by their names in ``static/toolbar.js``.
    on_select
        Called when the user selects an object: ``row``, ``hole`` (from 0), ``line``, ``stop`` (from 1), ``layer``.
    on_drag
        Called when the user drags an object: ``what`` (order or pierce), ``number`` (from 1), ``from`` and ``to`` in
        mm, ``onto`` (number of a stop, or None).
    on_origin
        Called when the user drags program zero, with its offset ``x`` and ``y``, mm.
    """

    def __init__(
        self,
        *,
        words: Mapping[str, str],
        layers: Mapping[str, bool] | None = None,
        on_select: Handler | None = None,
        on_drag: Handler | None = None,
        on_origin: Handler | None = None,
    ) -> None:
        super().__init__()
        #: Scene, version number and address of each layer. The address of a layer never changes, so that a slow browser
        #: downloads the newest scene.
        self._scenes: dict[str, Shown] = {}
        self._numbers: dict[str, int] = {}
        self._addresses: dict[str, str] = {}
        self.props.update(words=dict(words), layers=dict(layers or {}), editable=False, scenes={}, placement={})
        for name, handler in (("select", on_select), ("drag", on_drag), ("origin", on_origin)):
            if handler is not None:
                self.on(name, handler)

    def show(self, scene: Shown, layer: str) -> None:
        """Show a scene in one of the `LAYERS`.

        If `scene` is a function, it is called in a thread. Raises `OptionError` if the layer is unknown.
        """
        if layer not in LAYERS:
            raise OptionError("the drawing has no layer '{}'; its layers are: {}", layer, ", ".join(LAYERS))
        if layer not in self._addresses:
            self._addresses[layer] = self.serve(layer, lambda: self._scene_data(layer))
        self._scenes[layer] = scene
        self._numbers[layer] = self._numbers.get(layer, 0) + 1
        self._send_scenes()

    def _scene_data(self, layer: str) -> bytes | None:
        scene = self._scenes.get(layer)
        return scene() if callable(scene) else scene

    def clear(self) -> Self:
        """Remove all layers."""
        self._scenes.clear()
        self._send_scenes()
        return self

    def hide(self, layer: str) -> None:
        """Remove a layer from the drawing."""
        if self._scenes.pop(layer, None) is not None:
            self._send_scenes()

    def set_editable(self, editable: bool) -> None:
        """Allow or prevent dragging of pierces and stops."""
        self.props["editable"] = editable
        self.update()

    def set_placement(self, travel: Mapping[str, Any] | None, *, movable: bool) -> None:
        """Set the travel of the machine (`MachineTravel.as_shown`), and whether users can drag program zero."""
        placement = {"travel": dict(travel) if travel else None, "movable": movable}
        if placement != self.props["placement"]:
            self.props["placement"] = placement
            self.update()

    def fit(self) -> None:
        """Zoom so that the entire drawing is visible."""
        self.run_method("fit")

    def clear_selection(self) -> None:
        """Clear the selection. No event is sent, because a late event would clear a newer selection."""
        self.run_method("clearSelection")

    def select_stop(self, stop: int) -> None:
        """Select a stop of the edited order without sending an event. Stops are numbered from 1 in toolpath order."""
        self.run_method("selectStop", stop)

    def select_difference(self, index: int) -> None:
        """Select a difference between two programs by its index, and pan to its position."""
        self.run_method("selectDifference", index)

    def select_layer(self, layer: str | None) -> None:
        """Emphasize the shapes of a layer of the drawing, without sending an event."""
        self.run_method("selectLayer", layer)

    def show_line(self, line: int) -> None:
        """Select the moves of a program line, and pan to their position."""
        self.run_method("showLine", line)

    def set_tool(
        self, place: tuple[float, float] | None, *, cuts: bool = False, going_to: tuple[float, float] | None = None
    ) -> None:
        """Show the tool and the next hole.

        Parameters
        ----------
        place
            Position of the tool in program coordinates, mm.
        cuts
            Whether the tool is cutting, which is shown as a filled mark.
        going_to
            Position of the next hole, mm.
        """
        tool = None if place is None else {"x": place[0], "y": place[1], "cuts": cuts, "next": going_to}
        self.run_method("setTool", tool)

    def _send_scenes(self) -> None:
        self.props["scenes"] = {
            layer: f"{self._addresses[layer]}?{self._numbers[layer]}" for layer in LAYERS if layer in self._scenes
        }
        self.update()

    def _handle_delete(self) -> None:
        self._scenes.clear()
        super()._handle_delete()
