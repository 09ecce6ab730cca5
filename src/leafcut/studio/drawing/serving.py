"""`DataServer`: a page element whose data the browser fetches by HTTP instead of through the page's connection."""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Callable

from nicegui import __version__ as nicegui_version
from nicegui.dependencies import dynamic_resources, register_dynamic_resource
from nicegui.element import Element
from starlette.responses import Response

#: Time for which the data of a removed element remain available, s.
_FAREWELL = 30.0


class DataServer(Element):
    """An element that serves data at secret addresses. The addresses expire when the element is removed."""

    def __init__(self) -> None:
        super().__init__()
        self._served: list[str] = []

    def serve(self, kind: str, source: Callable[[], bytes | None]) -> str:
        """Return an address that serves the bytes of `source`.

        `source` is called in a thread; None means 204 No Content.
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
