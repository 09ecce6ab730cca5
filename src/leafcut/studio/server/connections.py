"""A timeout for idle and slow connections, which would otherwise remain open forever."""

from __future__ import annotations

import asyncio
from typing import Any

#: Timeout for the head of a request, s; it starts with the connection, or with the end of the previous answer.
HEAD_SECONDS = 10.0


def patient_protocol(seconds: float = HEAD_SECONDS) -> type[asyncio.Protocol]:
    """Return uvicorn's protocol with a timeout for the head of a request."""
    from uvicorn.protocols.http.auto import AutoHTTPProtocol

    base: Any = AutoHTTPProtocol

    class Patient(base):  # type: ignore[misc]
        _waiting: asyncio.TimerHandle | None = None

        def connection_made(self, transport: asyncio.BaseTransport) -> None:
            super().connection_made(transport)
            self._wait()

        def data_received(self, data: bytes) -> None:
            super().data_received(data)
            if self._answering():
                self._stop_waiting()
            elif self._waiting is None:
                self._wait()

        def connection_lost(self, exc: Exception | None) -> None:
            self._stop_waiting()
            super().connection_lost(exc)

        def _answering(self) -> bool:
            return self.cycle is not None and not self.cycle.response_complete

        def _wait(self) -> None:
            self._waiting = asyncio.get_running_loop().call_later(seconds, self._give_up)

        def _stop_waiting(self) -> None:
            if self._waiting is not None:
                self._waiting.cancel()
                self._waiting = None

        def _give_up(self) -> None:
            self._waiting = None
            # A websocket gets its own protocol with its first answer.
            if not self._answering() and self.transport.get_protocol() is self:
                self.transport.close()

    return Patient
