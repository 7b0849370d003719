"""The wheel's build hook: compile generated/c, and ship what firmware copies and what derives another robot."""

import os
import runpy
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from packaging.tags import sys_tags

SHIPPED = {
    "generated/c": "hopform/c",
    "generated/packages": "hopform/packages",
    "generated/schema.json": "hopform/schema.json",
    "generated/solver.toml": "hopform/solver.toml",
    "docs/evidence/firmware-costs.md": "hopform/firmware-costs.md",
    "derive": "hopform/_derive",
    "templates": "hopform/_templates",
    "runtime/engine": "hopform/_engine",
}
"""Folders and files of the checkout by where a wheel has them."""


class LibraryBuildHook(BuildHookInterface):
    """With a compiler the wheel is for one platform and any Python 3; without, it is pure Python, printed."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        tool = runpy.run_path(str(Path(self.root, "tools", "build_library.py")))
        try:
            tool["build_library"](Path(self.root))
        except tool["LibraryNotBuilt"] as error:
            if os.environ.get("HOPFORM_REQUIRE_C", "0") not in ("", "0"):
                self.app.abort(f"hopform: HOPFORM_REQUIRE_C is set, but {error.args[0]}")
            self.app.display_warning(f"hopform: Python only, without the C library: {error.args[0]}")
        else:
            build_data["pure_python"] = False
            build_data["tag"] = f"py3-none-{platform()}"
        if version == "standard":
            build_data["force_include"] |= SHIPPED


def platform() -> str:
    """The platform that $HOPFORM_PLATFORM names, which tools/wheels.py checks; else this machine's, without the promise
    of manylinux and musllinux."""
    platforms = (tag.platform for tag in sys_tags())
    own = next(name for name in platforms if not name.startswith(("manylinux", "musllinux")))
    return os.environ.get("HOPFORM_PLATFORM") or own
