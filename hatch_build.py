"""Tells the wheel's builder which machines a wheel is for: all, or those that the machine code in it is made for."""

from __future__ import annotations

import sysconfig
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class KernelsHook(BuildHookInterface):  # type: ignore[misc]  # hatchling has no types here
    """Names this kind of machine in the wheel's tag where the package holds machine code.

    Elsewhere the code would do no harm: it is bound to system and architecture by its digest, and not run. The tag has
    installers take the wheel without code there, and this one here.
    """

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Set the tag; `version` is ``standard`` or ``editable``."""
        if version == "standard" and any(Path(self.root, "src/leafcut/kernels/shipped").glob("*.kernel")):
            machine = sysconfig.get_platform().replace("-", "_").replace(".", "_")
            if machine.startswith("linux_"):  # kernels call nothing but the C library's mathematics, older than this
                machine = f"manylinux_2_17_{machine.removeprefix('linux_')}"
            build_data["pure_python"], build_data["tag"] = False, f"py3-none-{machine}"
