"""The studio's server: built from its parts, bound to this machine alone, ended by Ctrl-C."""

from __future__ import annotations

import asyncio
import hashlib
import hmac
import secrets
import socket
import sys
import threading
import webbrowser
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from leafcut.errors import LeafcutError, OptionError
from leafcut.files import OutputError
from leafcut.studio.folder import Folder, data_folder
from leafcut.studio.history import History
from leafcut.studio.jobs import Jobs
from leafcut.studio.safety import LARGEST_UPLOAD, Guard

if TYPE_CHECKING:
    from fastapi import FastAPI

HOST, PORT = "127.0.0.1", 8173
#: Without `--port`, so many ports from `PORT` on are tried.
_TRIED = 20
#: Longest wait at the end for connections that do not close, s.
_PATIENCE = 1


class StudioError(LeafcutError):
    """The studio cannot be opened here."""


@dataclass(frozen=True)
class Studio:
    """What all parts of the server share."""

    folder: Folder
    history: History
    jobs: Jobs
    token: str
    session: str
    port: int

    @property
    def address(self) -> str:
        """The address that opens the page."""
        return f"http://{HOST}:{self.port}/?token={self.token}"


def open_studio(root: Path, port: int = PORT) -> Studio:
    """Open the studio's folder and its history; jobs that were cut short by the last end are told so.

    Raises
    ------
    OutputError
        The folder or the history cannot be written.
    """
    folder = Folder(root)
    history = History(root / "history.sqlite")
    history.interrupt()
    folder.drop_unused(history.inputs_in_use())
    session = hmac.new(_key(root), b"leafcut studio", hashlib.sha256).hexdigest()
    return Studio(folder, history, Jobs(folder, history), secrets.token_urlsafe(24), session, port)


def _key(root: Path) -> bytes:
    """Return the secret that the cookie is made of; it stays the same over a restart, for pages that are open."""
    file = root / "key"
    try:
        if not file.is_file() or file.stat().st_size != 32:
            file.touch(mode=0o600)
            file.chmod(0o600)
            file.write_bytes(secrets.token_bytes(32))
        return file.read_bytes()
    except OSError as problem:
        raise OutputError(f"{file}: the studio's key cannot be kept ({problem.strerror})") from None


def make_api(studio: Studio) -> FastAPI:
    """Return the application with the JSON API, without pages and without its guard."""
    from fastapi import FastAPI
    from fastapi.exceptions import RequestValidationError
    from starlette.exceptions import HTTPException

    from leafcut import __version__
    from leafcut.studio import routes

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        yield
        studio.jobs.close()

    made = FastAPI(
        title="leafcut",
        version=__version__,
        description=routes.__doc__ or "",
        docs_url=None,  # FastAPI's pages load their scripts from another host
        redoc_url=None,
        openapi_url="/api/openapi.json",
        lifespan=lifespan,
    )
    made.include_router(routes.router(studio))
    routes.add_static(made)
    made.add_exception_handler(LeafcutError, routes.refuse)
    made.add_exception_handler(Exception, routes.refuse)
    made.add_exception_handler(HTTPException, routes.refuse_http)
    made.add_exception_handler(RequestValidationError, routes.refuse_invalid)
    return made


def guarded(studio: Studio, app: Any, largest: int = LARGEST_UPLOAD) -> Guard:
    """Return an application behind the guard of a studio."""
    return Guard(app, token=studio.token, session=studio.session, port=studio.port, largest=largest)


def serve(port: int | None = None, *, open_page: bool = True, root: Path | None = None) -> None:
    """Print the address, open the page, and serve until Ctrl-C.

    Raises
    ------
    StudioError
        The extra is not installed, or the port is taken.
    OutputError
        The studio's folder cannot be written.
    """
    try:
        import uvicorn

        from leafcut.studio.pages import add_pages
    except ImportError as problem:
        package = str(problem.name or "nicegui").partition(".")[0]
        raise StudioError(f"the studio needs the package {package}: pip install 'leafcut[studio]'") from None
    with _listen(port) as listening:
        studio = open_studio(root or data_folder(), listening.getsockname()[1])
        app = make_api(studio)
        add_pages(app, studio)
        config = uvicorn.Config(
            guarded(studio, app),
            log_level="critical",
            access_log=False,
            proxy_headers=False,
            server_header=False,
            timeout_graceful_shutdown=_PATIENCE,
            ws_max_size=1 << 20,
        )
        server = _server(config, studio)
        print(f"leafcut studio: {studio.address}", flush=True)
        print("leafcut: Ctrl-C ends it", file=sys.stderr, flush=True)
        if open_page:
            threading.Thread(target=_open_when_ready, args=(server, studio.address), daemon=True).start()
        try:
            asyncio.run(server.serve(sockets=[listening]))
        except KeyboardInterrupt:
            pass
        finally:
            studio.jobs.close()
            # Not before: until the loop has ended, pages look into it.
            studio.history.close()


def _server(config: Any, studio: Studio) -> Any:
    """Return a server that ends the runs before it waits for connections: some of them wait for a run."""
    import uvicorn

    class Server(uvicorn.Server):
        async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
            await asyncio.to_thread(studio.jobs.close)
            await super().shutdown(sockets)

    return Server(config)


def _listen(port: int | None) -> socket.socket:
    """Return a socket bound to this machine alone.

    Raises
    ------
    StudioError
        The port is taken, or may not be used.
    """
    tried = range(PORT, PORT + _TRIED) if port is None else [port]
    for number in tried:
        made = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, sys.platform != "win32")
        try:
            made.bind((HOST, number))
            made.listen(128)
        except OSError as problem:
            made.close()
            reason = problem.strerror
        else:
            return made
    shown = f"{PORT} to {PORT + _TRIED - 1}" if port is None else str(port)
    raise StudioError(f"port {shown} cannot be used ({reason}); choose another with --port")


def _open_when_ready(server: Any, address: str) -> None:
    """Open the page in the person's browser once the server listens."""
    for _ in range(200):
        if server.started:
            webbrowser.open(address)
            return
        threading.Event().wait(0.05)


def parse_port(word: str) -> int:
    """Return a port that a person typed.

    Raises
    ------
    OptionError
        It is none.
    """
    if not word.isdecimal() or not 1 <= int(word) <= 65535:
        raise OptionError(f"--port: '{word}' is not a port, 1 to 65535")
    return int(word)
