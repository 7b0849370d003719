"""The wheel's build hook: compile generated/c, and ship what firmware copies and what derives another robot."""

import os
import runpy
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
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

LATER = "HOPFORM_COMPILE_LATER"
WITHOUT_A_COMPILER = f"or {LATER}=1 pip install 'hopform[compiler]', whose zig compiles the library at its first use"


class LibraryBuildHook(BuildHookInterface[Any]):
    """A wheel is for one platform and any Python 3. Where HOPFORM_COMPILE_LATER is set it has no library, which is
    compiled at its first use, and not otherwise: pip keeps what it built, so a wheel without one would outlive its
    reason."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile aside, in a temporary folder; for an editable install where a checkout has its library."""
        later = os.environ.get(LATER, "0") not in ("", "0")
        if version == "editable":
            if not later:
                self.compile()
            return
        build_data["force_include"] |= SHIPPED
        if not later:
            self.aside = TemporaryDirectory(prefix="hopform_")
            self.compile(Path(self.aside.name))
            for library in Path(self.aside.name).iterdir():
                build_data["force_include"][str(library)] = f"hopform/{library.name}"
            build_data["pure_python"] = False
            build_data["tag"] = f"py3-none-{platform()}"

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        if hasattr(self, "aside"):
            self.aside.cleanup()

    def compile(self, folder: Path | None = None) -> Path:
        """The library, made in a folder; the build ends in one line where it cannot be made."""
        tool = runpy.run_path(str(Path(self.root, "tools", "build_library.py")))
        try:
            return Path(tool["build_library"](Path(self.root), folder))
        except tool["NoCompiler"] as error:
            sys.exit(f"hopform: {error.args[0]}, {WITHOUT_A_COMPILER}")
        except tool["LibraryNotBuilt"] as error:
            sys.exit("\n".join(["hopform: " + error.args[0], *error.args[1:]]))


def platform() -> str:
    """The platform that $HOPFORM_PLATFORM names, which tools/wheels.py checks; else this machine's, without the promise
    of manylinux and musllinux."""
    platforms = (tag.platform for tag in sys_tags())
    own = next(name for name in platforms if not name.startswith(("manylinux", "musllinux")))
    return os.environ.get("HOPFORM_PLATFORM") or own
