"""OpenCASCADE at hand: one process has it, and forks for every solid; to import it takes longer than to read one."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from typing import Any

MODULE = "leafcut.read.step_solid"


class SolidReader:
    """Stands for `subprocess` where a solid is read: the same module reads it, in a fork that may fail or end."""

    DEVNULL = subprocess.DEVNULL
    TimeoutExpired = subprocess.TimeoutExpired

    def __init__(self) -> None:
        # It forks, so it must not have threads.
        environment = os.environ | {"OPENBLAS_NUM_THREADS": "1"}
        self._server = subprocess.Popen(
            [sys.executable, "-P", __file__], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment
        )

    def run(self, command: Sequence[str], **_: Any) -> subprocess.CompletedProcess[str]:
        """Return the result of a fork that ran a command line."""
        assert command[:4] == [sys.executable, "-P", "-m", MODULE]
        assert self._server.stdin and self._server.stdout
        self._server.stdin.write(json.dumps(command[4:]) + "\n")
        self._server.stdin.flush()
        return subprocess.CompletedProcess(command, int(self._server.stdout.readline()))

    def close(self) -> None:
        """End the process."""
        self._server.communicate()


def serve() -> None:
    """Fork for each received command line, and report its result."""
    import OCP.STEPControl  # noqa: F401  # all of OpenCASCADE is in one library

    from leafcut.read.step_solid import main

    for line in sys.stdin:
        child = os.fork()
        if not child:
            status = 1
            try:
                os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
                os.dup2(1, 2)
                status = main(json.loads(line))
            finally:
                os._exit(status)
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)


if __name__ == "__main__":
    serve()
