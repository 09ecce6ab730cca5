"""The command `leafcut studio`."""

from __future__ import annotations

from typing import Annotated

from cyclopts import Parameter

from leafcut.cli.flags import NUMBER, switch_parameter


def open_studio(
    *,
    port: Annotated[
        NUMBER | None, Parameter(name="--port", help="port to listen on (default: 8173, or the next free one)")
    ] = None,
    no_open: Annotated[
        bool, switch_parameter("--no-open", help="print the address instead of opening a browser")
    ] = False,
) -> int:
    """Open the studio in your browser: open, see, run, compare, download. For use on this computer only."""
    from leafcut.studio.server import app as studio

    studio.serve(None if port is None else studio.parse_port(port), open_page=not no_open)
    return 0
