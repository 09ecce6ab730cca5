"""The server of the studio. It listens on the loopback interface until the user presses Ctrl-C."""

from __future__ import annotations

import asyncio
import socket
import sqlite3
import sys
import threading
import webbrowser
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager, closing, contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from leafcut.errors import LeafcutError, OptionError
from leafcut.files.whole_files import OutputError
from leafcut.message import Message
from leafcut.studio.control.room import ControlRoom
from leafcut.studio.folder import LARGEST_UPLOAD, data_folder
from leafcut.studio.jobs.workers import StudioWorkers
from leafcut.studio.keys import redirect_page, write_private
from leafcut.studio.lab.room import LabRoom
from leafcut.studio.studio import HOST, PORT, Room, Studio, open_studio

if TYPE_CHECKING:
    from fastapi import FastAPI

    from leafcut.studio.server.safety import Guard

#: Number of ports to try without `--port`, starting at `PORT`.
_TRIED = 20
#: Maximum number of attempts to shut down while a connection is closing, and interval between the attempts, s.
_TRIES, _MOMENT = 40, 0.05
#: Maximum time to wait for open connections during shutdown, s.
_PATIENCE = 1


class StudioError(LeafcutError):
    """The studio cannot be opened on this computer."""


def open_with_rooms(root: Path, port: int = PORT, workers: StudioWorkers | None = None) -> Studio:
    """Open the studio (see `open_studio`) with all its rooms. Machine control comes first."""
    studio = open_studio(root, port, workers)
    rooms: tuple[Room, ...] = (ControlRoom(), LabRoom(studio.folder))
    studio.rooms.update({room.name: room for room in rooms})
    return studio


def build_api(studio: Studio) -> FastAPI:
    """Create the application with the JSON API, but without pages and access control."""
    from fastapi import FastAPI
    from fastapi.exceptions import RequestValidationError
    from starlette.exceptions import HTTPException

    from leafcut._version import __version__
    from leafcut.studio.server import routes

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        yield
        studio.close()

    app = FastAPI(
        title="leafcut",
        version=__version__,
        description=routes.__doc__ or "",
        docs_url=None,  # FastAPI's pages load scripts from another host
        redoc_url=None,
        openapi_url="/api/openapi.json",
        lifespan=lifespan,
    )
    app.include_router(routes.api_router(studio))
    routes.add_static(app)
    app.add_exception_handler(LeafcutError, routes.error_response)
    app.add_exception_handler(Exception, routes.error_response)
    app.add_exception_handler(HTTPException, routes.http_error_response)
    app.add_exception_handler(RequestValidationError, routes.invalid_request_response)
    return app


def guard_app(
    studio: Studio, app: Any, largest: int = LARGEST_UPLOAD, on_entry: Callable[[str], None] = lambda _: None
) -> Guard:
    """Add the access control of a studio to an application."""
    from leafcut.studio.server.safety import Guard

    return Guard(app, keys=studio.keys, port=studio.port, largest=largest, on_entry=on_entry)


class _Entrance:
    """Prints a single-use address in the terminal, and a new one after each use."""

    def __init__(self, studio: Studio) -> None:
        self._studio = studio
        self._offered_key = ""

    def print_address(self, words: str) -> None:
        self._offered_key = self._studio.keys.new_entry()
        print(f"{words} {self._studio.address(self._offered_key)}", flush=True)

    def record_entry(self, key: str) -> None:
        self._studio.entrance.unlink(missing_ok=True)
        if key == self._offered_key:
            self.print_address("leafcut studio, for another browser:")


def serve(port: int | None = None, *, open_page: bool = True, root: Path | None = None) -> None:
    """Print the address, open the page, and serve requests until the user presses Ctrl-C.

    Raises
    ------
    StudioError
        The extra is not installed, or the port is in use.
    OutputError
        The studio's folder cannot be written, or another studio has locked it.
    """
    try:
        import uvicorn

        from leafcut.studio.page.pages import add_pages
    except ModuleNotFoundError as problem:
        package = str(problem.name).partition(".")[0]
        if package == "leafcut":  # an internal error of leafcut; installing a package does not help
            raise
        raise StudioError(f"the studio needs the package {package}: pip install 'leafcut[studio]'") from None
    folder = root or data_folder()
    with _open_socket(port) as listening, lock_folder(folder, "http://{}:{}".format(*listening.getsockname())):
        studio = open_with_rooms(folder, listening.getsockname()[1])
        app = build_api(studio)
        add_pages(app, studio)
        door = _Entrance(studio)
        config = uvicorn.Config(
            guard_app(studio, app, on_entry=door.record_entry),
            log_level="critical",
            access_log=False,
            proxy_headers=False,
            server_header=False,
            timeout_graceful_shutdown=_PATIENCE,
            ws_max_size=1 << 20,
        )
        server = _create_server(config, studio)
        _write_keys(studio)
        door.print_address("leafcut studio:")
        print("leafcut: Ctrl-C ends it", file=sys.stderr, flush=True)
        if open_page:
            threading.Thread(target=_open_when_ready, args=(server, studio.entrance.as_uri()), daemon=True).start()
        try:
            asyncio.run(server.serve(sockets=[listening]))  # noqa: TID251  a command of its own, with no loop yet
        except KeyboardInterrupt:
            pass
        finally:
            studio.close()
            for file in (studio.token_file, studio.entrance):
                file.unlink(missing_ok=True)
            # Pages read the history until the event loop has ended.
            studio.history.close()


def _write_keys(studio: Studio) -> None:
    """Write the token for programs and the page for the browser. Raises `OutputError` if this fails."""
    try:
        write_private(studio.token_file, studio.keys.token.encode())
        write_private(studio.entrance, redirect_page(studio.address(studio.keys.new_entry())))
    except OSError as problem:
        raise OutputError("{}: cannot be written ({})", studio.folder.root, problem.strerror) from None


def _create_server(config: Any, studio: Studio) -> Any:
    """Create a server that ends all jobs during shutdown before it waits for open connections.

    Some connections wait for a job and would otherwise block the shutdown.
    """
    import uvicorn
    from websockets.exceptions import InvalidState

    class Server(uvicorn.Server):
        async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
            await asyncio.to_thread(studio.close)
            for _ in range(_TRIES):
                # A connection that is already closing cannot be closed again. It will be closed at the next attempt.
                with suppress(InvalidState):
                    return await super().shutdown(sockets)
                await asyncio.sleep(_MOMENT)
            return await super().shutdown(sockets)

    return Server(config)


def _open_socket(port: int | None) -> socket.socket:
    """Open a socket on the loopback interface. Raises `StudioError` if the port is in use or not permitted."""
    tried = range(PORT, PORT + _TRIED) if port is None else [port]
    for number in tried:
        listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, sys.platform != "win32")
        try:
            listener.bind((HOST, number))
            listener.listen(128)
        except OSError as problem:
            listener.close()
            reason = problem.strerror
        else:
            return listener
    shown = f"{PORT} to {PORT + _TRIED - 1}" if port is None else str(port)
    raise StudioError(f"port {shown} cannot be used ({reason}); choose another with --port")


def _open_when_ready(server: Any, address: str) -> None:
    for _ in range(200):
        if server.started:
            webbrowser.open(address)
            return
        threading.Event().wait(0.05)


def parse_port(word: str) -> int:
    """Parse a port number. Raises `OptionError` if the text is not a valid port."""
    if not word.isdecimal() or not 1 <= int(word) <= 65535:
        raise OptionError(f"--port: '{word}' is not a port, 1 to 65535")
    return int(word)


@contextmanager
def lock_folder(root: Path, address: str) -> Iterator[None]:
    """Lock a folder while the context is active. If the folder does not exist, create it.

    Without the lock, a second studio in the same folder would mark running jobs as interrupted and delete their files.
    The operating system releases the lock even if the process is killed. `address` is the address of this studio, which
    a second studio shows in its error message. Raises `OutputError` if another studio holds the lock, or if the folder
    cannot be written.
    """
    with closing(_open_locked_database(root, address)):
        yield


def _open_locked_database(root: Path, address: str) -> sqlite3.Connection:
    """Open a connection to an empty database and lock it, so that no other process can lock it."""
    try:
        root.mkdir(mode=0o700, parents=True, exist_ok=True)
        connection = sqlite3.connect(root / "lock.sqlite", timeout=0.0, isolation_level=None)
        connection.execute("BEGIN EXCLUSIVE")
        (root / "address").write_text(address, encoding="ascii")
    except (OSError, sqlite3.OperationalError) as problem:
        if getattr(problem, "sqlite_errorcode", None) != sqlite3.SQLITE_BUSY:
            reason = getattr(problem, "strerror", None) or problem
            raise OutputError("{}: cannot write to the studio's folder ({})", root, reason) from None
    else:
        return connection
    place: Message | str = ""
    with suppress(OSError, UnicodeDecodeError):
        place = Message(" at {}", (root / "address").read_text(encoding="ascii"))
    raise OutputError(
        "a studio is already running{}; use that one, or stop it first: both would write to {}", place, root
    )
