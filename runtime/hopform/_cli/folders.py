"""The commands that carry a solver elsewhere: `hopform export DIR --for cmake` writes the C library as a package for a
firmware's build system, `--for fmu` an FMU; `hopform selftest` prints the digests that a board must repeat.
"""

import json as json_module
from pathlib import Path
from typing import Any, cast

from hopform import _export, _fmu
from hopform._checks import shown
from hopform._cli.use import core, robot_in_use
from hopform._errors import HopformError
from hopform._files import name_of


def export(
    folder: Path, system: str = "plain", robot: str | None = None, values: list[str] | None = None,
    prefix: str = "hopform", f32: bool = False, f64: bool = False, inputs: list[str] | None = None,
    binaries: list[str] | None = None, json: bool = False,
) -> None:  # fmt: skip
    """Write the C library as a package for firmware, or an FMU.

    A package has sources, amalgamated pair, README, costs, and a build system's manifest; with --robot also a program for
    a board, or simulated. An FMU is for FMI 3.0 co-simulation; it has the robot's values as starts.
    """
    of_packages = {"--prefix": prefix != "hopform", "--f32": f32, "--f64": f64}
    of_fmus = {"--input": bool(inputs), "--binary": bool(binaries)}
    is_fmu = system == _fmu.SYSTEM
    if given := [option for option, is_given in (of_packages if is_fmu else of_fmus).items() if is_given]:
        of_packages_alone = "of packages: an FMU is in double precision, under FMI's names"
        raise HopformError(
            f"{given[0]} is {of_packages_alone if is_fmu else f'of --for fmu, got --for {shown(system)}'}"
        )
    if is_fmu:
        files = _fmu.export(folder, robot_in_use(robot, values, "motion"), inputs or (), binaries or ())
        written = name_of(folder / files[0])
    else:
        chosen = tuple(name for name, alone in {"f32": f32, "f64": f64}.items() if alone) or _export.PRECISIONS
        act = "hop" if "stance" in core().facts.can else "motion"
        own = robot_in_use(robot, values, act) if robot or values else None
        files = _export.export(folder, _export.Wanted(cast(Any, system), prefix, chosen, own, core()))
        written = f"{len(files)} files in {name_of(folder)}; begin with {name_of(folder / 'README.md')}"
    listed = {"folder": str(folder), "files": [file.as_posix() for file in files]}
    print(json_module.dumps(listed, indent=2) if json else written)


def selftest(json: bool = False) -> None:
    """Print the digests of the selftest, which a board must repeat."""
    dtypes = {"f32": "float32", "f64": "float64"}
    digests = {f"hopform_selftest_{name}": f"{_export.selftest(dtype, core()):08x}" for name, dtype in dtypes.items()}
    print(json_module.dumps(digests, indent=2) if json else "\n".join(map(" ".join, digests.items())))
