"""The commands that carry the C library elsewhere: `hopform export DIR --for cmake` writes it as a package for a firmware's
build system, `hopform selftest` prints the digests that a board must repeat.
"""

import json as json_module
from pathlib import Path
from typing import Any, cast

from hopform import _export
from hopform._cli.use import core, robot_in_use
from hopform._files import name_of


def export(
    folder: Path, system: str = "plain", robot: str | None = None, values: list[str] | None = None,
    prefix: str = "hopform", f32: bool = False, f64: bool = False, json: bool = False,
) -> None:  # fmt: skip
    """Write the C library for firmware, as a package of a build system.

    It has sources, amalgamated pair, README, costs, and a build system's manifest; with --robot also a program for a board,
    or simulated.
    """
    chosen = tuple(name for name, alone in {"f32": f32, "f64": f64}.items() if alone) or _export.PRECISIONS
    act = "hop" if "stance" in core().facts.can else "motion"
    own = robot_in_use(robot, values, act) if robot or values else None
    files = _export.export(folder, _export.Wanted(cast(Any, system), prefix, chosen, own, core()))
    if json:
        print(json_module.dumps({"folder": str(folder), "files": [file.as_posix() for file in files]}, indent=2))
    else:
        print(f"{len(files)} files in {name_of(folder)}; begin with {name_of(folder / 'README.md')}")


def selftest(json: bool = False) -> None:
    """Print the digests of the selftest, which a board must repeat."""
    dtypes = {"f32": "float32", "f64": "float64"}
    digests = {f"hopform_selftest_{name}": f"{_export.selftest(dtype, core()):08x}" for name, dtype in dtypes.items()}
    print(json_module.dumps(digests, indent=2) if json else "\n".join(map(" ".join, digests.items())))
