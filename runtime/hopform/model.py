"""What a model file takes, and the door of the derivation: `derive(FILE | NAME)` gives its formulas as objects of sympy.

    from hopform.model import *

    J = parameter("J", "kg m^2", "inertia", "positive")
    b = parameter("b", "N m s/rad", "viscous friction", "nonnegative", 0)
    q = coordinate("q", "rad", J, "wheel")
    viscous(q, b)

The elements are the derivation's own, which needs the extra `derive`; the reference lists them. A model file is a
program: reading it runs it.
"""

import sys
from functools import cache
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any

from hopform._errors import HopformError, MissingExtra

_NAMES = ("derive", "hopform._derive")
_CHECKOUT = Path(__file__).resolve().parents[2] / "derive" / "__init__.py"
_OF = {
    "Derivation": "derivation", "Mode": "mode", "derive": "derivation", "Formula": "maths.formulas", "Quantity": "ir",
}  # fmt: skip
"""Modules of names that the derivation's package `model` does not have."""


@cache
def _derivation() -> str:
    """The name of the derivation's package: of the one that is running, else of the one that is there."""
    for name in _NAMES:
        if f"{name}.model" in sys.modules:
            return name
    for name in reversed(_NAMES):
        try:
            import_module(f"{name}.model")
            return name
        except ModuleNotFoundError as error:
            if error.name == "sympy":
                raise MissingExtra("hopform.model", "derive") from None
            if error.name != name:
                raise
    if not _CHECKOUT.is_file():
        raise HopformError("hopform.model is the derivation's, which is not installed here: reinstall hopform")
    spec = spec_from_file_location("derive", _CHECKOUT)
    assert spec is not None and spec.loader is not None
    sys.modules["derive"] = package = module_from_spec(spec)
    spec.loader.exec_module(package)
    return _derivation()


def part(name: str) -> ModuleType:
    """A module of the derivation, by its name in there; MissingExtra without the extra `derive`."""
    package = _derivation()
    try:
        return import_module(f"{package}.{name}")
    except ModuleNotFoundError as error:
        if error.name in ("sympy", "mpmath", "jinja2", "pcpp", "pycparser"):
            raise MissingExtra("hopform.model", "derive") from None
        raise


def shipped() -> dict[str, Path]:
    """The files of the models that ship, by name."""
    installed = Path(__file__).with_name("_derive")
    folder = (installed if installed.is_dir() else _CHECKOUT.parent) / "models"
    return {path.stem: path for path in sorted(folder.glob("[!_]*.py"))}


def __getattr__(name: str) -> Any:
    if name.startswith("__") and name != "__all__":
        raise AttributeError(name)
    return getattr(part(_OF.get(name, "model")), name)
