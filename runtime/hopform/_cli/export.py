"""`hopform export DIR --for cmake`: the C library as a package for a firmware's build system; and `hopform
selftest`.
"""

import json as json_module
from pathlib import Path
from typing import cast

from hopform import _export as packages
from hopform._export import PRECISIONS, System, Wanted
from hopform._export.selftest import selftest as digest
from hopform._files import name_of


def export(
    folder: Path, system: str = "plain", prefix: str = "hopform", f32: bool = False, f64: bool = False,
    json: bool = False,
) -> None:  # fmt: skip
    """Write the C library for firmware: sources, amalgamated pair, README, costs, and a build system's manifest."""
    chosen = tuple(name for name, wanted in zip(PRECISIONS, (f32, f64), strict=True) if wanted) or PRECISIONS
    files = packages.export(folder, Wanted(cast(System, system), prefix, chosen))
    if json:
        print(json_module.dumps({"folder": str(folder), "files": [file.as_posix() for file in files]}, indent=2))
    else:
        print(f"{len(files)} files in {name_of(folder)}; begin with {name_of(folder / 'README.md')}")


def selftest(json: bool = False) -> None:
    """Print the digests of the C library's selftest, which a board must repeat."""
    digests = {
        f"hopform_selftest_{name}": f"{digest(dtype):08x}" for name, dtype in (("f32", "float32"), ("f64", "float64"))
    }
    print(json_module.dumps(digests, indent=2) if json else "\n".join(map(" ".join, digests.items())))
